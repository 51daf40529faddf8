"""What callers do with feeds: the permission, the change and the audit line together.

REST and the pages both go through here.
"""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.config import Settings
from app.db import Database
from app.deletions import service as deletions
from app.feeds import service
from app.feeds.schemas import FeedIn, FeedPatch
from app.sites.actions import site_for
from app.tables.feeds import AisFeed


def feed_for(session: Session, access: Access, scope: Scope, feed_id: int) -> AisFeed:
    """Return a feed on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    feed = service.get_feed(session, feed_id)
    access.require(scope, feed.site_id)
    return feed


def check_new(database: Database, settings: Settings, access: Access, data: FeedIn) -> None:
    """Refuse a feed of a foreign site, or to an address that feeds may not use."""
    with database.reading() as session:
        site_for(session, access, Scope.INGEST, data.site_id)
    service.check_destination(settings, data.kind, data.host, data.port)


def check_change(
    database: Database, settings: Settings, access: Access, feed_id: int, data: FeedPatch
) -> None:
    """Refuse a change of a foreign feed, or to an address that feeds may not use."""
    with database.reading() as session:
        feed = feed_for(session, access, Scope.INGEST, feed_id)
    if data.host is not None or data.port is not None:
        host, port = data.host or feed.host, data.port or feed.port
        service.check_destination(settings, feed.kind, host, port)


def create_feed(session: Session, access: Access, data: FeedIn) -> AisFeed:
    """Set up a feed, after `check_new`."""
    site_for(session, access, Scope.INGEST, data.site_id)
    feed = service.create_feed(session, data, access.user_id)
    address = f"{feed.kind.value} {feed.host} {feed.port}"
    record(
        session, access, "create", "feed", feed.id, feed.site_id, name=feed.name, address=address
    )
    return feed


def update_feed(session: Session, access: Access, feed: AisFeed, data: FeedPatch) -> AisFeed:
    """Change, start or stop a feed, after `check_change`."""
    service.update_feed(session, feed, data)
    changes = data.model_dump(mode="json", exclude_unset=True)
    record(session, access, "update", "feed", feed.id, feed.site_id, changes=changes)
    return feed


def remove_feed(session: Session, access: Access, feed: AisFeed) -> None:
    """Remove a feed for 30 days; what it brought stays."""
    deletions.delete(
        session, "feed", [feed.id], site_id=feed.site_id, label=feed.name, user_id=access.user_id
    )
    service.remove_feed(session, feed)
    record(session, access, "delete", "feed", feed.id, feed.site_id, name=feed.name)
