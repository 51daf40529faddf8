"""Feeds received in the test's own threads, from a receiver on this machine."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
import sqlalchemy as sa

from app.config import Settings
from app.db import Database
from app.tables.ais import AisPosition, AisStatic
from app.tables.feeds import AisFeed, AisFeedStatus, FeedCondition, FeedKind
from tests.factories.sites import make_site
from tests.feeder import Feeder
from tests.worker.conftest import (
    database,
    database_url,
    postgres_cluster,
    reused_database,
    settings,
    sqlite_template,
    start_worker,
)
from worker.feeds import FeedLoops
from worker.loops import LoopSupervisor

__all__ = [
    "database",
    "database_url",
    "postgres_cluster",
    "reused_database",
    "settings",
    "sqlite_template",
    "start_worker",
]

IMPATIENT = {
    "heartbeat_s": 0.1,
    "takeover_after_s": 1.0,
    "feed_allowed_networks": ["127.0.0.0/8"],
    "feed_commit_s": 0.05,
    "feed_longest_retry_s": 0.3,
}


class Feeds:
    """Sets up feeds, receives them as a worker does, and reads what became of them."""

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._settings = settings
        self._supervisors: list[LoopSupervisor] = []
        with database.writing() as session:
            self.site_id = make_site(session).id

    def add(self, port: int, kind: FeedKind = FeedKind.TCP, **columns: Any) -> int:
        """Set up a feed from this machine; returns its id."""
        with self._database.writing() as session:
            feed = AisFeed(
                **{
                    "site_id": self.site_id,
                    "name": f"feed {port}",
                    "kind": kind,
                    "host": "127.0.0.1",
                    "port": port,
                    "silent_after_s": 60.0,
                    **columns,
                }
            )
            session.add(feed)
            session.flush()
            return feed.id

    def receive(self, worker: str = "worker", **changes: object) -> LoopSupervisor:
        """Receive all feeds as one worker, until the test ends or the answer is stopped."""
        settings = self._settings.model_copy(update=IMPATIENT | changes)
        supervisor = LoopSupervisor(
            self._database, settings, worker, [FeedLoops(self._database, settings)]
        )
        self._supervisors.append(supervisor)
        supervisor.start()
        return supervisor

    def status(self, feed_id: int) -> AisFeedStatus | None:
        """Return what the worker last wrote of a feed."""
        with self._database.reading() as session:
            return session.get(AisFeedStatus, feed_id)

    def count(self, feed_id: int, *path: str) -> int:
        """Return a count of a feed's accounting, such as `count(1, "lines", "total")`."""
        status = self.status(feed_id)
        value: Any = status.accounting if status else {}
        for step in path:
            value = value.get(step, 0) if value else 0
        return int(value)

    def has(self, feed_id: int, expected: int, *path: str) -> Callable[[], bool]:
        """Return the question whether a count has come to a value."""
        return lambda: self.count(feed_id, *path) == expected

    def is_at(self, feed_id: int, condition: FeedCondition) -> Callable[[], bool]:
        """Return the question whether a link stands somewhere."""
        return lambda: (
            (status := self.status(feed_id)) is not None and (status.condition is condition)
        )

    def says(self, feed_id: int, words: str) -> Callable[[], bool]:
        """Return the question whether a feed's last error holds these words."""
        return lambda: (
            (status := self.status(feed_id)) is not None and (words in (status.last_error or ""))
        )

    def positions(self, feed_id: int) -> list[AisPosition]:
        """Return the positions that came by a feed."""
        with self._database.reading() as session:
            return list(session.scalars(sa.select(AisPosition).filter_by(feed_id=feed_id)))

    def statics(self, feed_id: int) -> list[AisStatic]:
        """Return the static reports that came by a feed."""
        with self._database.reading() as session:
            return list(session.scalars(sa.select(AisStatic).filter_by(feed_id=feed_id)))

    def stop(self) -> None:
        """Stop receiving."""
        for supervisor in self._supervisors:
            supervisor.stop(5)


@pytest.fixture
def feeds(database: Database, settings: Settings) -> Iterator[Feeds]:
    """Give what sets up and receives feeds."""
    feeds = Feeds(database, settings)
    yield feeds
    feeds.stop()


@pytest.fixture
def feeder() -> Iterator[Feeder]:
    """Give a receiver on this machine."""
    with Feeder() as feeder:
        yield feeder
