"""What REST says about people and tokens."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from app.auth.access import Access, Scope
from app.auth.passwords import LONGEST_PASSWORD, SHORTEST_PASSWORD
from app.auth.users import MembershipSpec, normalised_email
from app.tables.identity import ApiToken, Role, User

Email = Annotated[
    str, Field(max_length=254, examples=["ada@harbour.example"]), AfterValidator(normalised_email)
]
Password = Annotated[
    str,
    Field(
        min_length=SHORTEST_PASSWORD,
        max_length=LONGEST_PASSWORD,
        examples=["four words are easily kept"],
    ),
]
Name = Annotated[str, Field(max_length=200, examples=["Ada"])]


class MembershipBody(BaseModel):
    """A role on one site, or on all sites when `site_id` is null."""

    model_config = ConfigDict(extra="forbid")

    role: Role = Field(examples=["reviewer"])
    site_id: int | None = Field(None, description="null: all sites")

    def spec(self) -> MembershipSpec:
        """Return what the service takes."""
        return MembershipSpec(self.role, self.site_id)


class UserOut(BaseModel):
    """A person and their roles."""

    id: int
    email: str
    name: str
    is_active: bool
    memberships: list[MembershipBody]
    has_second_factor: bool
    owes_second_factor: bool = Field(description="Demanded and not set up: they may do nothing")
    created_at: datetime
    version: int

    @classmethod
    def of(cls, user: User) -> Self:
        """Return what REST says about a stored person."""
        return cls(
            id=user.id,
            email=user.email,
            name=user.name,
            is_active=user.is_active,
            memberships=[
                MembershipBody(role=membership.role, site_id=membership.site_id)
                for membership in user.memberships
            ],
            has_second_factor=user.totp_secret is not None,
            owes_second_factor=user.totp_required and user.totp_secret is None,
            created_at=user.created_at,
            version=user.version,
        )


class UserIn(BaseModel):
    """A person to be added."""

    model_config = ConfigDict(extra="forbid")

    email: Email
    password: Password
    name: Name = ""
    memberships: list[MembershipBody] = Field(default_factory=list, max_length=1000)


class UserPatch(BaseModel):
    """What may change about a person; what is left out stays."""

    model_config = ConfigDict(extra="forbid")

    name: Name | None = None
    is_active: bool | None = None
    password: Password | None = None
    memberships: list[MembershipBody] | None = Field(None, max_length=1000)


class MeOut(BaseModel):
    """Who the caller is and what they may do."""

    id: int
    email: str
    name: str
    is_admin: bool
    memberships: list[MembershipBody]
    scopes: list[Scope]

    @classmethod
    def of(cls, access: Access) -> Self:
        """Return what REST says about a caller."""
        return cls(
            id=access.user_id,
            email=access.email,
            name=access.name,
            is_admin=access.is_admin,
            memberships=[
                MembershipBody(role=role, site_id=site_id) for site_id, role in access.roles.items()
            ],
            scopes=sorted(access.scopes()),
        )


class TokenIn(BaseModel):
    """A token to be made."""

    model_config = ConfigDict(extra="forbid")

    name: Name = Field("", examples=["nightly export"])
    scopes: list[Scope] = Field(min_length=1, examples=[["read", "export"]])
    expires_days: int | None = Field(
        None,
        ge=1,
        le=3650,
        description=(
            "90 when left out. A token that a token makes ends with its maker, by time or by "
            "revocation; more days than that are refused"
        ),
    )


class TokenOut(BaseModel):
    """A token without its text, which nobody keeps."""

    id: int
    user_id: int
    name: str
    scopes: list[Scope]
    created_at: datetime
    expires_at: datetime
    last_used_at: datetime | None
    revoked_at: datetime | None

    @classmethod
    def of(cls, token: ApiToken) -> Self:
        """Return what REST says about a stored token."""
        return cls(
            id=token.id,
            user_id=token.user_id,
            name=token.name,
            scopes=[Scope(scope) for scope in token.scopes],
            created_at=token.created_at,
            expires_at=token.expires_at,
            last_used_at=token.last_used_at,
            revoked_at=token.revoked_at,
        )


class NewTokenOut(TokenOut):
    """A fresh token with its text, shown this once."""

    token: str = Field(examples=["qm_..."])
