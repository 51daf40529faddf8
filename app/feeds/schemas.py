"""Requests and answers of live feeds."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from app.addresses import check_host, check_local, check_network
from app.ais.schemas import AccountingOut
from app.feeds.condition import FeedState, FeedView
from app.sites.fields import Name, Request
from app.tables.feeds import FeedKind

FEED_EXAMPLE: JsonDict = {
    "site_id": 1,
    "name": "Receiver on the lighthouse",
    "kind": "tcp",
    "host": "ais.example.org",
    "port": 5631,
    "silent_after_s": 120,
}
MOST_SENDERS = 64


def _words(value: object) -> object:
    return value.replace(",", " ").split() if isinstance(value, str) else value


Host = Annotated[
    str,
    AfterValidator(check_host),
    Field(
        min_length=1,
        max_length=255,
        description="TCP: the name or address to connect to. UDP: this machine's address to "
        "listen on, 0.0.0.0 for all of them",
    ),
]
Port = Annotated[int, Field(ge=1, le=65_535)]
Senders = Annotated[
    list[Annotated[str, AfterValidator(check_network)]],
    BeforeValidator(_words),
    Field(
        max_length=MOST_SENDERS,
        description="UDP: addresses or networks whose datagrams are taken; empty: anybody's",
        examples=[["192.0.2.7", "198.51.100.0/24"]],
    ),
]
SilentAfter = Annotated[
    float,
    Field(ge=5, le=604_800, description="Seconds without a message after which it is an alarm"),
]


class FeedIn(Request):
    """A new feed of a site."""

    model_config = ConfigDict(json_schema_extra={"examples": [FEED_EXAMPLE]})

    site_id: int = Field(ge=1)
    name: Name
    kind: FeedKind
    host: Host = "0.0.0.0"  # noqa: S104  what a UDP listener usually means; TCP must say
    port: Port
    allowed_senders: Senders = Field(default_factory=list)
    silent_after_s: SilentAfter = 120.0
    enabled: bool = Field(default=True, description="false: set up, and started later")

    @model_validator(mode="after")
    def _fits_its_kind(self) -> Self:
        if self.kind is FeedKind.TCP and "host" not in self.model_fields_set:
            raise ValueError("a TCP feed needs the host to connect to")
        check_kind(self.kind, self.host, self.allowed_senders)
        return self


class FeedPatch(Request):
    """What to change of a feed; fields left out stay. `enabled` starts and stops it."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"enabled": False}]})

    name: Name | None = None
    host: Host | None = None
    port: Port | None = None
    allowed_senders: Senders | None = None
    silent_after_s: SilentAfter | None = None
    enabled: bool | None = None


def check_kind(kind: FeedKind, host: str, allowed_senders: list[str]) -> None:
    """Raise ValueError for a host or for senders that this kind of feed cannot have."""
    if kind is FeedKind.UDP:
        check_local(host)
    elif allowed_senders:
        raise ValueError("allowed_senders are for UDP; a TCP feed hears only whom it connects to")


class FeedOut(BaseModel):
    """A feed as it stands now."""

    id: int
    site_id: int
    name: str
    kind: FeedKind
    host: str
    port: int
    allowed_senders: list[str]
    silent_after_s: float
    enabled: bool
    version: int
    state: FeedState
    since: datetime = Field(description="Since when it has been in this state")
    alarm: bool = Field(description="No message for longer than `silent_after_s`")
    last_message_at: datetime | None
    message_age_s: float | None
    rate_per_s: float = Field(description="Messages a second, over the last half minute")
    peer: str | None = Field(description="The address it is connected to, or listens on")
    connections: int = Field(description="How often a link was made")
    dropped_lines: int = Field(description="Lines that came faster than they could be stored")
    foreign_datagrams: int = Field(description="Datagrams of senders that are not allowed")
    receiver_lag_s: float | None = Field(
        description="How much later than its own time the last report came; far from 0: the "
        "receiver's clock is wrong, or its line slow"
    )
    last_error: str | None
    last_error_at: datetime | None
    worker: str | None = Field(description="Which worker holds it")
    accounting: AccountingOut

    @classmethod
    def of(cls, view: FeedView) -> "FeedOut":
        """Show a feed."""
        feed = view.feed
        return cls(
            id=feed.id,
            site_id=feed.site_id,
            name=feed.name,
            kind=feed.kind,
            host=feed.host,
            port=feed.port,
            allowed_senders=feed.allowed_senders,
            silent_after_s=feed.silent_after_s,
            enabled=feed.enabled,
            version=feed.version,
            state=view.state,
            since=view.since,
            alarm=view.alarm,
            last_message_at=view.last_message_at,
            message_age_s=view.message_age_s,
            rate_per_s=view.rate_per_s,
            peer=view.peer,
            connections=view.connections,
            dropped_lines=view.dropped_lines,
            foreign_datagrams=view.foreign_datagrams,
            receiver_lag_s=view.receiver_lag_s,
            last_error=view.last_error,
            last_error_at=view.last_error_at,
            worker=view.worker,
            accounting=AccountingOut.model_validate(view.accounting),
        )
