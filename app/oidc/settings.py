"""What an installation says about its identity provider, as QUAYMARK_OIDC_* variables."""

from ipaddress import ip_network
from pathlib import Path
from typing import Literal, Self
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, field_validator, model_validator
from pydantic_settings import BaseSettings

from app.tables.identity import Role


class ProviderSettings(BaseSettings):
    """The identity provider; with an empty issuer there is none."""

    public_url: str = ""

    oidc_issuer: str = Field("", description="As the provider writes it in its ID tokens")
    oidc_client_id: str = ""
    oidc_client_secret: SecretStr = SecretStr("")
    oidc_client_secret_file: Path | None = None
    oidc_scopes: str = "openid email profile"
    oidc_button: str = Field("Sign in with single sign-on", min_length=1, max_length=60)
    oidc_roles_claim: str = Field("groups", description="May be nested: realm_access.roles")
    oidc_roles: dict[str, str] = Field(
        {}, description='What groups give: {"pilots": "reviewer", "staff": "viewer@Elbe"}; * is all'
    )
    oidc_create_people: bool = False
    oidc_email_domains: list[str] = []
    oidc_second_factor: Literal["ours", "provider"] = "ours"
    oidc_allowed_networks: list[str] = Field(
        [], description="Networks inside where the provider may be: 192.168.7.0/24"
    )
    oidc_leeway_s: int = Field(60, ge=0, le=600, description="How far clocks may differ")
    oidc_timeout_s: float = Field(5.0, gt=0, le=60)

    @property
    def has_provider(self) -> bool:
        """Whether people may sign in at an identity provider."""
        return bool(self.oidc_issuer)

    def provider_secret(self) -> str:
        """Return the client's secret, from its file where one is named; empty for none."""
        if self.oidc_client_secret_file is not None:
            return self.oidc_client_secret_file.read_text().strip()
        return self.oidc_client_secret.get_secret_value()

    @field_validator("oidc_allowed_networks")
    @classmethod
    def _provider_networks_are_networks(cls, networks: list[str]) -> list[str]:
        return [str(ip_network(network)) for network in networks]

    @field_validator("oidc_email_domains")
    @classmethod
    def _domains_in_one_spelling(cls, domains: list[str]) -> list[str]:
        return [domain.strip().lower().removeprefix("@") for domain in domains]

    @field_validator("oidc_roles")
    @classmethod
    def _roles_are_roles(cls, roles: dict[str, str]) -> dict[str, str]:
        for text in roles.values():
            role, at, site = text.partition("@")
            if role not in set(Role) or (at and not site):
                known = ", ".join(Role)
                raise ValueError(f"must give one of {known}, or ROLE@SITE; got {text!r}")
        return roles

    @model_validator(mode="after")
    def _provider_is_whole(self) -> Self:
        if not self.has_provider:
            return self
        parts = urlsplit(self.oidc_issuer)
        is_inside = parts.scheme == "http" and bool(self.oidc_allowed_networks)
        if not parts.hostname or not (parts.scheme == "https" or is_inside):
            raise ValueError(
                "QUAYMARK_OIDC_ISSUER must be an https address (http only for a provider in "
                "QUAYMARK_OIDC_ALLOWED_NETWORKS)"
            )
        if not self.oidc_client_id:
            raise ValueError("QUAYMARK_OIDC_CLIENT_ID is missing; the provider gives it")
        if not self.public_url:
            raise ValueError(
                "QUAYMARK_PUBLIC_URL is missing; the provider sends people back to that address"
            )
        if self.oidc_create_people and not self.oidc_roles:
            raise ValueError(
                "QUAYMARK_OIDC_CREATE_PEOPLE needs QUAYMARK_OIDC_ROLES: who comes needs a role"
            )
        return self
