"""Settings that would make an installation unsafe are refused when it starts."""

import secrets
from pathlib import Path

import pytest
from pydantic import ValidationError

from app.config import PLACEHOLDER_SECRETS, Settings


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
