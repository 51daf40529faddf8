"""SQL of live feeds."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.feeds import AisFeed, AisFeedStatus, FeedKind
from app.tables.operation import Lease, WorkerHeartbeat

Readable = frozenset[int] | None


@dataclass(frozen=True, slots=True)
class Holder:
    """The worker that holds a feed, and since when it has had it."""

    host: str
    pid: int
    last_seen_at: datetime


def feed(session: Session, feed_id: int) -> AisFeed | None:
    """Return a feed that was not removed."""
    found = find(session, AisFeed, feed_id)
    return found if found is not None and found.removed_at is None else None


def removed_feed(session: Session, feed_id: int) -> AisFeed | None:
    """Return a feed that was removed."""
    found = find(session, AisFeed, feed_id)
    return found if found is not None and found.removed_at is not None else None


def feeds(
    session: Session, readable: Readable, paging: Paging, site_id: int | None
) -> tuple[Sequence[AisFeed], str | None]:
    """Return a part of the list of feeds, oldest first."""
    statement = sa.select(AisFeed).where(AisFeed.removed_at.is_(None))
    if readable is not None:
        statement = statement.where(AisFeed.site_id.in_(readable))
    if site_id is not None:
        statement = statement.where(AisFeed.site_id == site_id)
    return fetch_page(session, statement, AisFeed.id, paging)


def switched_on(session: Session) -> dict[int, int]:
    """Return the versions of all feeds that are to run, by id."""
    statement = sa.select(AisFeed.id, AisFeed.version).where(
        AisFeed.enabled, AisFeed.removed_at.is_(None)
    )
    return {row.id: row.version for row in session.execute(statement)}


def status(session: Session, feed_id: int) -> AisFeedStatus | None:
    """Return what the worker last wrote of a feed."""
    return session.get(AisFeedStatus, feed_id)


def statuses(session: Session, feed_ids: Iterable[int]) -> dict[int, AisFeedStatus]:
    """Return what workers last wrote, by feed."""
    statement = sa.select(AisFeedStatus).where(AisFeedStatus.feed_id.in_(list(feed_ids)))
    return {row.feed_id: row for row in session.scalars(statement)}


def holders(session: Session, lease_names: Iterable[str]) -> dict[str, Holder]:
    """Return which workers hold these leases, by name, and when each was last seen."""
    statement = (
        sa.select(Lease.name, WorkerHeartbeat)
        .join(WorkerHeartbeat, WorkerHeartbeat.executor_id == Lease.holder)
        .where(Lease.name.in_(list(lease_names)))
    )
    return {
        name: Holder(worker.host, worker.pid, worker.last_seen_at)
        for name, worker in session.execute(statement)
    }


def is_name_taken(session: Session, site_id: int, name: str, but_for: int | None) -> bool:
    """Whether another feed of the site has this name."""
    return _exists(
        session,
        but_for,
        AisFeed.site_id == site_id,
        AisFeed.name == name,
    )


def is_port_taken(session: Session, host: str, port: int, but_for: int | None) -> bool:
    """Whether another feed listens on this port of this address."""
    return _exists(
        session,
        but_for,
        AisFeed.kind == FeedKind.UDP,
        AisFeed.host == host,
        AisFeed.port == port,
    )


def _exists(session: Session, but_for: int | None, *conditions: sa.ColumnElement[bool]) -> bool:
    statement = sa.select(AisFeed.id).where(
        AisFeed.removed_at.is_(None), AisFeed.id != (but_for or 0), *conditions
    )
    return session.scalar(statement.limit(1)) is not None
