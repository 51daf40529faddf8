"""The loop of a feed: one thread receives, this one decodes and commits about once a second."""

import threading
import time

import structlog
from sqlalchemy.exc import InterfaceError, InternalError, OperationalError
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database, now
from app.feeds import service
from app.tables.feeds import AisFeed, FeedKind
from worker.feeds.line_queue import LineQueue
from worker.feeds.link import Link
from worker.feeds.recorder import FeedRecorder
from worker.feeds.sources import TcpSource, UdpSource
from worker.leases import Held

log = structlog.get_logger()
LINES_AT_ONCE = 2_000  # a transaction of a tenth of a second: others want to write too
TAKE_TIMEOUT_S = 0.2
RETRY_COMMIT_S = 0.5
FAREWELL_S = 3.0


class FeedLoops:
    """What the supervisor runs for feeds (see worker/loops.py)."""

    name = service.LEASE_PREFIX

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._settings = settings

    def wanted(self, session: Session) -> dict[int, int]:
        """Return the feeds that are switched on, each with its version."""
        return service.switched_on(session)

    def run(self, item_id: int, lease: Held, stop: threading.Event) -> None:
        """Receive and store until told to stop."""
        with self._database.reading() as session:
            feed = service.feed_to_run(session, item_id)
        if feed is not None:
            FeedRun(self._database, self._settings, feed, lease).run(stop)


class FeedRun:
    """One worker's time with one feed."""

    def __init__(self, database: Database, settings: Settings, feed: AisFeed, lease: Held) -> None:
        self._settings = settings
        self._feed = feed
        self._recorder = FeedRecorder(database, feed.id, feed.site_id, lease)
        self._queue = LineQueue(settings.feed_queue_lines)
        self._link = Link(self._recorder.found)
        self._hang_up = threading.Event()
        self._receiver = threading.Thread(
            target=_source_of(feed, settings).run,
            args=(self._queue, self._link, self._hang_up),
            name=f"{lease.name} source",
            daemon=True,
        )
        self._is_silent = False
        self._log = log.bind(feed_id=feed.id, site_id=feed.site_id, feed=feed.name)

    def run(self, stop: threading.Event) -> None:
        """Receive and store until told to stop; then store what came before that."""
        self._receiver.start()
        try:
            last_commit = time.monotonic()
            while not stop.is_set():
                if not self._receiver.is_alive():
                    raise RuntimeError("the receiving thread ended")  # the supervisor begins anew
                self._take(TAKE_TIMEOUT_S)
                self._watch_silence()
                is_due = time.monotonic() - last_commit >= self._settings.feed_commit_s
                if is_due or self._recorder.unstored_lines >= LINES_AT_ONCE:
                    while not self._commit() and not stop.wait(RETRY_COMMIT_S):
                        pass
                    last_commit = time.monotonic()
        finally:
            self._hang_up.set()
            self._receiver.join(FAREWELL_S)
        self._say_farewell()

    def _take(self, timeout_s: float) -> int:
        room = LINES_AT_ONCE - self._recorder.unstored_lines
        lines = self._queue.take(max(1, room), timeout_s)
        self._recorder.add(lines, self._queue.take_dropped())
        return len(lines)

    def _commit(self) -> bool:
        """Commit what there is; False while the database is away or full, which loses nothing."""
        state = self._link.state
        if not self._recorder.has_news and self._recorder.is_written(state):
            return True
        try:
            self._recorder.commit(state)
        except (OperationalError, InterfaceError, InternalError) as error:
            self._log.warning("feed cannot be stored at the moment", error=str(error.orig))
            return False
        return True

    def _say_farewell(self) -> None:
        """Store what was received before the link was closed, if the database takes it in time."""
        self._link.left()
        deadline = time.monotonic() + FAREWELL_S
        while time.monotonic() < deadline:
            is_empty = not self._take(0)
            if is_empty:
                self._recorder.finish()
            if not self._commit():
                time.sleep(RETRY_COMMIT_S)
            elif is_empty:
                return
        lines = self._recorder.unstored_lines
        self._log.error("feed was left with lines that could not be stored", lines=lines)

    def _watch_silence(self) -> None:
        heard = max(filter(None, (self._recorder.last_message_at, self._feed.started_at)))
        silent_s = (now() - heard).total_seconds()
        is_silent = silent_s > self._feed.silent_after_s
        if is_silent and not self._is_silent:
            self._log.warning("feed silent", silent_s=round(silent_s))
        elif self._is_silent and not is_silent:
            self._log.info("feed heard again")
        self._is_silent = is_silent


def _source_of(feed: AisFeed, settings: Settings) -> TcpSource | UdpSource:
    if feed.kind is FeedKind.TCP:
        return TcpSource(feed.host, feed.port, settings)
    return UdpSource(feed.host, feed.port, feed.allowed_senders, settings)
