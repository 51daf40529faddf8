"""How a feed stands, from what was set up, what its worker last wrote, and the present moment.

Five states. *Stopped*: switched off. *Refused*: its address is one that feeds may not use.
*Waiting*: no link, or no worker that holds it. *Silent*: linked, and no message for longer than
the feed's own limit. *Connected*: messages come. An alarm is raised in whatever state as soon as
the last message is older than the limit, because a receiver that is down is as silent as a broken
one.
"""

from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any

from app.domain.plausibility import is_contradicted
from app.feeds.accounts import empty_account
from app.feeds.repository import Holder
from app.tables.feeds import AisFeed, AisFeedStatus, FeedCondition

RATE_HOLDS_S = 10.0  # an older rate is of a time when messages came
WORKER_SEEN_WITHIN_S = 10.0
LEAST_LAG_S, LARGEST_LAG_S = -5.0, 60.0  # of a line behind the time its receiver gave it
NO_WORKER = "No worker has taken this feed; see whether one runs."


class FeedState(StrEnum):
    """How a feed stands, in the words of the page."""

    CONNECTED = "connected"
    WAITING = "waiting"
    SILENT = "silent"
    REFUSED = "refused"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class FeedView:
    """A feed as it stands at a moment."""

    feed: AisFeed
    state: FeedState
    since: datetime
    alarm: bool
    silent_for_s: float
    last_message_at: datetime | None
    message_age_s: float | None
    rate_per_s: float
    peer: str | None
    connections: int
    foreign_datagrams: int
    receiver_lag_s: float | None
    last_error: str | None
    last_error_at: datetime | None
    worker: str | None
    accounting: dict[str, Any]

    @property
    def clock_is_suspect(self) -> bool:
        """Whether the times its receiver gives contradict those at which lines arrive."""
        return self.receiver_lag_s is not None and not (
            LEAST_LAG_S <= self.receiver_lag_s <= LARGEST_LAG_S
        )

    @property
    def is_withheld(self) -> bool:
        """Whether what it brings now is kept from all images, because of its receiver's clock."""
        return self.receiver_lag_s is not None and is_contradicted(self.receiver_lag_s)

    @property
    def dropped_lines(self) -> int:
        """How many lines came faster than they could be stored."""
        dropped: int = self.accounting["lines"]["dropped"]
        return dropped


def view_of(
    feed: AisFeed, status: AisFeedStatus | None, holder: Holder | None, moment: datetime
) -> FeedView:
    """Return how a feed stands at a moment."""
    if holder and (moment - holder.last_seen_at).total_seconds() > WORKER_SEEN_WITHIN_S:
        holder = None
    last = status.last_message_at if status else None
    heard = max(filter(None, (last, feed.started_at)))
    silent_for_s = max(0.0, (moment - heard).total_seconds())
    alarm = feed.enabled and silent_for_s > feed.silent_after_s
    state, since = _state(feed, status, holder, heard, alarm=alarm)
    is_fresh = last is not None and (moment - last).total_seconds() < RATE_HOLDS_S
    error, error_at = (status.last_error, status.last_error_at) if status else (None, None)
    if feed.enabled and holder is None and silent_for_s > WORKER_SEEN_WITHIN_S:
        error, error_at = NO_WORKER, moment
    return FeedView(
        feed=feed,
        state=state,
        since=since,
        alarm=alarm,
        silent_for_s=silent_for_s,
        last_message_at=last,
        message_age_s=max(0.0, (moment - last).total_seconds()) if last else None,
        rate_per_s=status.rate_per_s if status and is_fresh else 0.0,
        peer=status.peer if status and state in _LINKED else None,
        connections=status.connections if status else 0,
        foreign_datagrams=status.foreign_datagrams if status else 0,
        receiver_lag_s=status.receiver_lag_s if status else None,
        last_error=error,
        last_error_at=error_at,
        worker=f"{holder.host}, process {holder.pid}" if holder and feed.enabled else None,
        accounting=status.accounting if status else empty_account(),
    )


_LINKED = (FeedState.CONNECTED, FeedState.SILENT)


def _state(
    feed: AisFeed,
    status: AisFeedStatus | None,
    holder: Holder | None,
    heard: datetime,
    *,
    alarm: bool,
) -> tuple[FeedState, datetime]:
    if not feed.enabled:
        return FeedState.STOPPED, feed.started_at
    if holder is None or status is None:
        return FeedState.WAITING, max(heard, holder.last_seen_at) if holder else heard
    if status.condition is not FeedCondition.CONNECTED:
        return FeedState(status.condition.value), status.condition_since
    if alarm:
        silent_since = heard + timedelta(seconds=feed.silent_after_s)
        return FeedState.SILENT, max(silent_since, status.condition_since)
    return FeedState.CONNECTED, status.condition_since
