"""Live feeds: what the web, the worker and other features may ask for.

`readable` is the set of sites that a caller may read, None for all.
"""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.addresses import AddressError, resolve
from app.config import Settings
from app.db import now
from app.edits import flush_named
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.feeds import repository
from app.feeds.accounts import empty_account, settled
from app.feeds.condition import FeedView, view_of
from app.feeds.schemas import FeedIn, FeedPatch, check_kind
from app.paging import Paging
from app.tables.feeds import AisFeed, AisFeedStatus, FeedCondition, FeedKind

LEASE_PREFIX = "feed"
NO_FEED = "there is no such feed"
EVERY_FEED = Paging(limit=1000, after=None)
Readable = frozenset[int] | None


def check_destination(settings: Settings, kind: FeedKind, host: str, port: int) -> None:
    """Raise Invalid for an address that feeds may not connect to, or that nobody knows.

    Asks the name server, so before the first statement of a writing session.
    """
    if kind is not FeedKind.TCP:
        return
    try:
        resolve(host, port, settings.feed_allowed_networks)
    except AddressError as error:
        raise Invalid.field("host", str(error)) from error


def create_feed(session: Session, data: FeedIn, user_id: int | None) -> AisFeed:
    """Set up a feed. Raises Conflict for a name or a port in use."""
    feed = AisFeed(
        site_id=data.site_id,
        name=data.name,
        kind=data.kind,
        host=data.host,
        port=data.port,
        allowed_senders=data.allowed_senders,
        silent_after_s=data.silent_after_s,
        enabled=data.enabled,
        created_by_id=user_id,
    )
    _refuse_what_is_taken(session, feed)
    session.add(feed)
    _flush(session, feed)
    return feed


def update_feed(session: Session, feed: AisFeed, data: FeedPatch) -> AisFeed:
    """Change, start or stop a feed. Raises Conflict, Invalid."""
    changes = {
        name: value
        for name, value in data.model_dump(exclude_unset=True).items()
        if value is not None
    }
    if changes.get("enabled") and not feed.enabled:
        feed.started_at = now()
    for name, value in changes.items():
        setattr(feed, name, value)
    try:
        check_kind(feed.kind, feed.host, feed.allowed_senders)
    except ValueError as error:
        field = "host" if feed.kind is FeedKind.UDP else "allowed_senders"
        raise Invalid.field(field, str(error)) from error
    with session.no_autoflush:
        _refuse_what_is_taken(session, feed)
    _flush(session, feed)
    return feed


def remove_feed(session: Session, feed: AisFeed) -> None:
    """Remove a feed; what it brought stays, and says that it came from it."""
    feed.removed_at = now()
    _flush(session, feed)


def restore_feed(session: Session, feed_id: int) -> None:
    """Bring a removed feed back, switched on if it was. Raises Conflict as `create_feed` does."""
    feed = repository.removed_feed(session, feed_id)
    if feed is None:
        raise Conflict("the site it belongs to is deleted too; restore that first")
    _refuse_what_is_taken(session, feed)
    feed.removed_at = None
    if feed.enabled:  # it has not been silent while nobody listened
        feed.started_at = now()
    _flush(session, feed)


def get_feed(session: Session, feed_id: int) -> AisFeed:
    """Return a feed. Raises NotFound."""
    feed = repository.feed(session, feed_id)
    if feed is None:
        raise NotFound(NO_FEED)
    return feed


def list_views(
    session: Session, readable: Readable, paging: Paging = EVERY_FEED, site_id: int | None = None
) -> tuple[list[FeedView], str | None]:
    """Return a part of the list of feeds as they stand now, oldest first, and the next cursor."""
    feeds, next_cursor = repository.feeds(session, readable, paging, site_id)
    return _views(session, feeds), next_cursor


def view(session: Session, feed: AisFeed) -> FeedView:
    """Return a feed as it stands now."""
    return _views(session, [feed])[0]


def alarms(session: Session, readable: Readable, site_id: int | None = None) -> list[FeedView]:
    """Return the feeds that have been silent for longer than they may."""
    views, _ = list_views(session, readable, site_id=site_id)
    return [view for view in views if view.alarm]


def suspect_clocks(session: Session, readable: Readable, site_id: int) -> list[FeedView]:
    """Return the feeds heard at a site whose receiver's clock is suspect.

    What they bring stands at the times they give, which is not when it was sent: images of now get
    no vessels from it.
    """
    views, _ = list_views(session, readable, site_id=site_id)
    return [view for view in views if view.clock_is_suspect]


def switched_on(session: Session) -> dict[int, int]:
    """Return the versions of all feeds that are to run, by id."""
    return repository.switched_on(session)


def feed_to_run(session: Session, feed_id: int) -> AisFeed | None:
    """Return a feed that is still there to be received."""
    return repository.feed(session, feed_id)


def begin(session: Session, feed_id: int) -> AisFeedStatus:
    """Return a feed's status as a worker that takes it over begins with; made if need be."""
    status = repository.status(session, feed_id)
    if status is None:
        status = AisFeedStatus(feed_id=feed_id, accounting=empty_account())
        session.add(status)
    status.condition = FeedCondition.WAITING
    status.condition_since = now()
    status.peer = None
    status.accounting = settled(status.accounting)
    session.flush()
    return status


def status_of(session: Session, feed_id: int) -> AisFeedStatus:
    """Return the status that `begin` made. Raises NotFound."""
    status = repository.status(session, feed_id)
    if status is None:
        raise NotFound("the feed was removed together with its site")
    return status


def _views(session: Session, feeds: Sequence[AisFeed]) -> list[FeedView]:
    statuses = repository.statuses(session, [feed.id for feed in feeds])
    holders = repository.holders(session, [_lease_name(feed) for feed in feeds])
    moment = now()
    return [
        view_of(feed, statuses.get(feed.id), holders.get(_lease_name(feed)), moment)
        for feed in feeds
    ]


def _lease_name(feed: AisFeed) -> str:
    return f"{LEASE_PREFIX}:{feed.id}"


def _refuse_what_is_taken(session: Session, feed: AisFeed) -> None:
    if feed.kind is FeedKind.UDP and repository.is_port_taken(
        session, feed.host, feed.port, feed.id
    ):
        taken = f"another feed listens on {feed.host} port {feed.port} already"
        raise Conflict(taken, fields=(FieldError("port", taken),))
    if repository.is_name_taken(session, feed.site_id, feed.name, feed.id):
        raise Conflict(_named(feed), fields=(FieldError("name", _named(feed)),))


def _flush(session: Session, feed: AisFeed) -> None:
    flush_named(session, _named(feed))


def _named(feed: AisFeed) -> str:
    return f"this site already has a feed named {feed.name!r}"
