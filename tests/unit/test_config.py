"""Settings that would make an installation unsafe are refused when it starts."""

import secrets
from pathlib import Path

import pytest
from pydantic import ValidationError

from app.auth.headers import content_security_policy
from app.config import PLACEHOLDER_SECRETS, Settings, tile_origin


@pytest.mark.parametrize("secret", [*sorted(PLACEHOLDER_SECRETS), "ChangeMe", "too short"])
def test_production_refuses_a_placeholder_secret(secret: str, tmp_path: Path) -> None:
    """A secret that anybody can know stops the start, and the message says how to make one."""
    with pytest.raises(ValidationError, match="QUAYMARK_SECRET_KEY must be"):
        Settings(environment="production", secret_key=secret, data_dir=tmp_path)


def test_production_takes_a_random_secret(tmp_path: Path) -> None:
    """A long random secret is used as it is given."""
    secret = secrets.token_urlsafe(48)
    settings = Settings(environment="production", secret_key=secret, data_dir=tmp_path)
    assert settings.secret() == secret.encode()
    assert secret not in repr(settings)


def test_elsewhere_a_secret_is_made_and_kept(tmp_path: Path) -> None:
    """Without one, each installation makes its own, for its owner's eyes only."""
    first = Settings(data_dir=tmp_path / "a").secret()
    assert Settings(data_dir=tmp_path / "a").secret() == first
    assert Settings(data_dir=tmp_path / "b").secret() != first
    assert (tmp_path / "a" / "secret").stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("url", "origin"),
    [
        ("https://tile.example.org/{z}/{x}/{y}.png", "https://tile.example.org"),
        ("https://{s}.tile.example.org/{z}/{x}/{y}@2x.png?key=a", "https://*.tile.example.org"),
        ("http://10.0.0.7:8080/tiles/{z}/{y}/{x}", "http://10.0.0.7:8080"),
    ],
)
def test_maps_open_the_policy_for_their_own_tiles_only(
    url: str, origin: str, tmp_path: Path
) -> None:
    """Pictures may come from where the tiles are, and from nowhere else."""
    settings = Settings(data_dir=tmp_path, map_tile_url=url)
    found = tile_origin(settings.map_tile_url)
    assert found == origin
    policy = content_security_policy(found).header_value
    assert f"img-src 'self' blob: data: {origin}" in policy
    assert origin not in policy.replace(f"data: {origin}", "")


@pytest.mark.parametrize(
    "url",
    ["tile.example.org", "https://a b/{z}/{x}/{y}", "https://t.example; script-src */{z}/{x}/{y}"],
)
def test_an_address_that_is_none_of_tiles_stops_the_start(url: str, tmp_path: Path) -> None:
    """A mistyped address is refused by name, and can say nothing else in the policy."""
    with pytest.raises(ValidationError, match="QUAYMARK_MAP_TILE_URL must be like"):
        Settings(data_dir=tmp_path, map_tile_url=url)
