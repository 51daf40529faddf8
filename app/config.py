"""Settings: every knob of an installation, read once from QUAYMARK_* variables.

The defaults make a working single-machine installation in the folder `var`: SQLite, local files,
a secret generated on first use. In production the secret must be given, because a secret that
anybody can read in a public repository protects nothing.
"""

import re
import secrets
from functools import lru_cache
from ipaddress import ip_network
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, SecretStr, field_validator, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from app.mail.settings import MailSettings
from app.oidc.settings import ProviderSettings

PLACEHOLDER_SECRETS = frozenset(
    {"", "changeme", "change-me", "secret", "password", "placeholder", "quaymark", "development"},
)
SHORTEST_SECRET = 32

TILE_URL = re.compile(
    r"(?P<scheme>https?)://(?P<host>(?:\{s\}\.)?[\w.-]+(?::\d+)?)/\S*\{z\}\S*"
    r"(?:\{x\}\S*\{-?y\}|\{-?y\}\S*\{x\})\S*"
)


def tile_origin(url: str) -> str | None:
    """Return the origin of a tile URL as a content policy names it; None if it is no such URL."""
    found = TILE_URL.fullmatch(url)
    if found is None:
        return None
    return f"{found['scheme']}://{found['host'].replace('{s}', '*')}"


class Settings(MailSettings, ProviderSettings, BaseSettings):
    """What an installation can choose. Units stand in the names."""

    model_config = SettingsConfigDict(env_prefix="QUAYMARK_", extra="ignore")

    environment: Literal["development", "production"] = "development"
    data_dir: Path = Path("var")
    database_url: str = ""
    storage_url: str = ""
    secret_key: SecretStr = SecretStr("")

    host: str = "127.0.0.1"
    port: int = Field(8000, ge=0, le=65535)
    allowed_hosts: list[str] = ["*"]
    session_hours: int = Field(24 * 7, ge=1)
    sign_in_attempts: int = Field(10, ge=1)
    sign_in_window_s: int = Field(300, ge=1)
    metrics_token: SecretStr = SecretStr("")
    metrics_allowed_addresses: list[str] = ["127.0.0.1", "::1"]

    max_requests: int = Field(200, ge=1, description="Under way at a time; more are 503")
    max_streams: int = Field(500, ge=1, description="Pages that watch something at a time")
    max_upload_bytes: int = Field(64 * 2**20, ge=1)
    max_model_bytes: int = Field(1024 * 2**20, ge=1)
    max_ais_file_bytes: int = Field(1024 * 2**20, ge=1)
    max_archive_bytes: int = Field(64 * 2**30, ge=1, description="Of photographs, unpacked")
    max_image_pixels: int = Field(100_000_000, ge=1)

    map_tile_url: str = Field(
        "", description="Tiles of the maps, https://.../{z}/{x}/{y}.png; empty: a grid of metres"
    )
    map_attribution: str = Field("", description="Whom the tiles' licence wants named")

    review_lease_s: float = Field(600, gt=0, description="How long a queue's item is held")

    feed_allowed_networks: list[str] = Field(
        [], description="Networks inside that AIS feeds may connect to: 192.168.7.0/24"
    )
    feed_connect_timeout_s: float = Field(4.0, gt=0)
    feed_longest_retry_s: float = Field(10.0, gt=0, description="Longest pause before a retry")
    feed_stall_s: float = Field(60.0, gt=0, description="Silence after which a link is made anew")
    feed_commit_s: float = Field(1.0, gt=0)
    feed_queue_lines: int = Field(20_000, ge=1, description="Held before lines are dropped")

    webhook_allowed_networks: list[str] = Field(
        [], description="Networks inside that webhooks may be sent to: 192.168.7.0/24"
    )
    webhook_timeout_s: float = Field(10.0, gt=0, le=60)
    webhook_pauses_s: list[float] = Field(
        [5.0, 60.0, 300.0, 1800.0, 7200.0, 28800.0],
        description="Before each further try, when a receiver fails",
    )
    webhook_look_every_s: float = Field(1.0, gt=0)

    worker_concurrency: int = Field(1, ge=1)
    detector_threads: int = Field(
        0, ge=0, description="0: as many as cores, for small models one less"
    )
    detector_providers: list[str] = ["CPUExecutionProvider"]
    images_per_step: int = Field(25, ge=1, le=100)
    rehash_bytes_per_s: float = Field(
        20e6, gt=0, description="How fast stored files are hashed again, once a day"
    )
    alarms_look_every_s: float = Field(
        30.0, gt=0, description="How often it is looked whether an alarm is to be mailed"
    )
    heartbeat_s: float = Field(1.0, gt=0)
    takeover_after_s: float = Field(4.0, gt=0)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if not self.database_url:
            self.database_url = f"sqlite:///{self.data_dir.resolve() / 'quaymark.db'}"
        if self.database_url.startswith(("postgres://", "postgresql://")):
            _, _, rest = self.database_url.partition("://")
            self.database_url = f"postgresql+psycopg://{rest}"
        if not self.storage_url:
            self.storage_url = str(self.data_dir.resolve() / "files")
        if self.environment == "production":
            self._refuse_a_placeholder_secret()
        return self

    @field_validator("map_tile_url")
    @classmethod
    def _tiles_have_a_place(cls, url: str) -> str:
        if url and tile_origin(url) is None:
            message = (
                "QUAYMARK_MAP_TILE_URL must be like https://tiles.example.org/{z}/{x}/{y}.png, "
                f"got {url!r}"
            )
            raise ValueError(message)
        return url

    @field_validator("feed_allowed_networks", "webhook_allowed_networks")
    @classmethod
    def _networks_are_networks(cls, networks: list[str]) -> list[str]:
        return [str(ip_network(network)) for network in networks]

    def _refuse_a_placeholder_secret(self) -> None:
        secret = self.secret_key.get_secret_value()
        if secret.lower() in PLACEHOLDER_SECRETS or len(secret) < SHORTEST_SECRET:
            message = (
                f"QUAYMARK_SECRET_KEY must be at least {SHORTEST_SECRET} random characters in "
                "production; make one with: python3 -c 'import secrets; "
                "print(secrets.token_urlsafe(48))'"
            )
            raise ValueError(message)

    def secret(self) -> bytes:
        """Return the installation's secret; made and kept in the data folder when none is set."""
        given = self.secret_key.get_secret_value()
        if given:
            return given.encode()
        path = self.data_dir / "secret"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch(mode=0o600)
            path.write_text(secrets.token_urlsafe(48))
        return path.read_text().encode()

    @property
    def idle_limit_s(self) -> float:
        """How long a worker's transaction may stand idle: far longer than makes a worker dead."""
        return 10 * self.takeover_after_s

    @property
    def is_sqlite(self) -> bool:
        """Whether the embedded database is in use."""
        return self.database_url.startswith("sqlite")


@lru_cache(maxsize=1)
def get_settings() -> Settings:
    """Return the process's settings, read once."""
    return Settings()
