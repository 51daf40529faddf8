"""What REST says about invitations, new passwords, second factors and sessions."""

from datetime import datetime
from enum import StrEnum
from typing import Self

from pydantic import BaseModel, ConfigDict, Field

from app.auth.schemas import Email
from app.tables.identity import AccountLink, LoginSession, Role


class InvitationIn(BaseModel):
    """Somebody to be invited, with a role on a site, or on all sites when `site_id` is null."""

    model_config = ConfigDict(extra="forbid")

    email: Email
    role: Role = Field(examples=["reviewer"])
    site_id: int | None = Field(None, description="null: all sites")
    by_mail: bool = Field(default=False, description="Send the link, too; needs a mail server")


class InvitationOut(BaseModel):
    """An invitation that nobody has followed yet."""

    id: int
    email: str
    role: Role | None
    site_id: int | None
    created_at: datetime
    expires_at: datetime

    @classmethod
    def of(cls, link: AccountLink) -> Self:
        """Return what REST says about a stored invitation."""
        return cls(
            id=link.id,
            email=link.email,
            role=link.role,
            site_id=link.site_id,
            created_at=link.created_at,
            expires_at=link.expires_at,
        )


class NewInvitationOut(InvitationOut):
    """A fresh invitation with its link, shown this once."""

    url: str = Field(examples=["https://quay.example/join?token=qm_..."])


class ResetIn(BaseModel):
    """How a person gets the link for a new password."""

    model_config = ConfigDict(extra="forbid")

    by_mail: bool = Field(default=False, description="Send it to them instead of showing it")


class ResetOut(BaseModel):
    """A link for a new password, shown this once; null when it goes by mail."""

    url: str | None = Field(examples=["https://quay.example/join?token=qm_..."])
    expires_at: datetime | None


class FactorWish(StrEnum):
    """What an administrator wants of somebody's second factor."""

    DEMAND = "demand"
    FREE = "free"
    RESET = "reset"


class FactorIn(BaseModel):
    """Demand a second factor, demand it no longer, or take away a lost one."""

    model_config = ConfigDict(extra="forbid")

    wanted: FactorWish


class FactorOut(BaseModel):
    """Whether a person has a second factor here, and whether they must."""

    is_on: bool
    is_demanded: bool


class HandOverIn(BaseModel):
    """Who gets a person's open work."""

    model_config = ConfigDict(extra="forbid")

    taker_id: int = Field(examples=[2])


class HandOverOut(BaseModel):
    """How many items of review queues were handed over."""

    items: int


class SessionOut(BaseModel):
    """A browser that is signed in."""

    id: int
    created_at: datetime
    expires_at: datetime
    user_agent: str = Field(examples=["Mozilla/5.0 (X11; Linux x86_64)"])
    address: str = Field(examples=["192.0.2.7"])
    is_present: bool = Field(description="Whether it is the one that asks")

    @classmethod
    def of(cls, found: LoginSession, present_id: int | None) -> Self:
        """Return what REST says about a stored session."""
        return cls(
            id=found.id,
            created_at=found.created_at,
            expires_at=found.expires_at,
            user_agent=found.user_agent,
            address=found.address,
            is_present=found.id == present_id,
        )
