"""From lines to committed rows: one feed's decoder, its accounting, and its place in the database.

Reports and the accounting that counts them are one commit, so that the sums hold whatever happens
in between: a worker that is killed loses the lines of its last second, and neither a report without
its count nor a count without its report stays behind. What the database cannot take at the moment
is kept and offered again; meanwhile the queue fills, and then drops and counts.
"""

import copy
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy.orm import Session

from app.ais.live import Arrived, store_reports
from app.db import Database, now
from app.domain.accounting import Accounting
from app.domain.nmea import NmeaDecoder
from app.feeds import service
from app.feeds.accounts import Account, merged
from worker.feeds.line_queue import Line
from worker.feeds.link import LinkState
from worker.leases import Held, confirm

RATE_WINDOW_S = 30.0
# Receivers' clocks may be ahead; a time further off is no clock's, and arrival counts instead.
MOST_AHEAD = timedelta(days=30)


@dataclass(frozen=True, slots=True)
class Batch:
    """Reports to store, and what the feed's accounting says when they are."""

    reports: tuple[Arrived, ...]
    accounting: Accounting
    last_message_at: datetime | None
    receiver_lag_s: float | None


class FeedRecorder:
    """Decodes and stores the lines of one feed, for as long as this worker holds it."""

    def __init__(self, database: Database, feed_id: int, site_id: int, lease: Held) -> None:
        self._database = database
        self._feed_id = feed_id
        self._site_id = site_id
        self._lease = lease
        self._decoder = NmeaDecoder()
        self._known_already = Accounting()
        self._reports: list[Arrived] = []
        self._batch: Batch | None = None
        self._stored = Accounting()
        self._lag_s: float | None = None
        self._rates: deque[tuple[float, int]] = deque([(time.monotonic(), 0)])
        with database.writing() as session:
            confirm(session, lease)
            status = service.begin(session, feed_id)
            self.found = self._written = LinkState(
                condition_since=status.condition_since,
                connections=status.connections,
                foreign_datagrams=status.foreign_datagrams,
                last_error=status.last_error,
                last_error_at=status.last_error_at,
            )
            self.last_message_at = status.last_message_at
            self._account: Account = status.accounting

    @property
    def unstored_lines(self) -> int:
        """How many lines came since the last commit."""
        return self._decoder.accounting.lines.total - self._stored.lines.total

    @property
    def has_news(self) -> bool:
        """Whether the accounting says anything that was not committed."""
        return self._decoder.accounting != self._stored

    def add(self, lines: Sequence[Line], dropped: int) -> None:
        """Decode lines that came, and count those that were dropped on the way."""
        self._decoder.accounting.lines.dropped += dropped
        if lines:
            self._decoder.refuse_after(lines[-1][0] + MOST_AHEAD)
        messages = self._decoder.accounting.messages
        for arrival, line in lines:
            assembled = messages.assembled
            reports = self._decoder.feed(line, arrival)
            if messages.assembled > assembled:
                self.last_message_at = arrival
            if reports:
                self._reports += (Arrived(report, arrival) for report in reports)
                self._lag_s = (arrival - reports[0].received_at).total_seconds()

    def finish(self) -> None:
        """End the input: parts of messages that wait for the rest have no rest to wait for."""
        self._decoder.finish()

    def commit(self, link: LinkState) -> None:
        """Store what was decoded, the accounting and the link's state in one transaction.

        Raises LeaseLostError, or an error of the database: then nothing was stored, nothing is
        lost, and the next call tries the same again.
        """
        batch = self._batch = self._batch or self._next_batch()
        with self._database.writing() as session:
            confirm(session, self._lease)
            known = self._store(session, batch, link)
        self._known_already.add(known)
        self._stored = batch.accounting
        self._written = link
        self._batch = None

    def is_written(self, link: LinkState) -> bool:
        """Whether a state of the link was stored."""
        return link == self._written

    def _next_batch(self) -> Batch:
        batch = Batch(
            reports=tuple(self._reports),
            accounting=copy.deepcopy(self._decoder.accounting),
            last_message_at=self.last_message_at,
            receiver_lag_s=self._lag_s,
        )
        self._reports = []
        return batch

    def _store(self, session: Session, batch: Batch, link: LinkState) -> Accounting:
        """Store a batch; return how its messages moved from new to known before."""
        status = service.status_of(session, self._feed_id)
        account = copy.deepcopy(batch.accounting)
        account.add(self._known_already)
        expected = merged(self._account, account)
        if batch.reports and status.accounting["lines"]["total"] == expected["lines"]["total"]:
            # The last try did reach the database, and only its answer was lost.
            return _moved(expected["messages"], status.accounting["messages"])
        new = store_reports(session, self._site_id, self._feed_id, batch.reports)
        known = Accounting()
        known.messages.positions = -new.known_positions
        known.messages.statics = -new.known_statics
        known.messages.duplicates = new.known_positions + new.known_statics
        account.add(known)
        for name, value in asdict(link).items():
            setattr(status, name, value)
        status.last_message_at = batch.last_message_at
        status.receiver_lag_s = batch.receiver_lag_s
        status.rate_per_s = self._rate(batch.accounting.messages.assembled)
        status.accounting = merged(self._account, account)
        status.written_at = now()
        return known

    def _rate(self, assembled: int) -> float:
        """Return messages a second over the last half minute."""
        moment = time.monotonic()
        self._rates.append((moment, assembled))
        while len(self._rates) > 2 and self._rates[1][0] <= moment - RATE_WINDOW_S:
            self._rates.popleft()
        began, before = self._rates[0]
        return (assembled - before) / max(1.0, moment - began)


def _moved(expected: Mapping[str, Any], stored: Mapping[str, Any]) -> Accounting:
    moved = Accounting()
    for name in ("positions", "statics", "duplicates"):
        setattr(moved.messages, name, stored[name] - expected[name])
    return moved
