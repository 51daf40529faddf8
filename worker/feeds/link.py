"""How a feed's link stands: what the receiving thread says and the storing thread writes down."""

import threading
from dataclasses import dataclass, replace
from datetime import datetime

from app.db import now
from app.tables.feeds import FeedCondition

LONGEST_ERROR = 500


@dataclass(frozen=True, slots=True)
class LinkState:
    """A link at a moment, in the words of `AisFeedStatus`."""

    condition_since: datetime
    condition: FeedCondition = FeedCondition.WAITING
    peer: str | None = None
    connections: int = 0
    foreign_datagrams: int = 0
    last_error: str | None = None
    last_error_at: datetime | None = None


class Link:
    """The link of one feed; every change makes a new state, so that a reader never sees half."""

    def __init__(self, state: LinkState) -> None:
        self._state = state
        self._lock = threading.Lock()

    @property
    def state(self) -> LinkState:
        """The present state."""
        return self._state

    def connected(self, peer: str) -> None:
        """Say that lines may come now, and from where."""
        with self._lock:
            self._state = replace(
                self._state,
                condition=FeedCondition.CONNECTED,
                condition_since=now(),
                peer=peer,
                connections=self._state.connections + 1,
            )

    def failed(self, reason: str, condition: FeedCondition = FeedCondition.WAITING) -> None:
        """Say why no lines can come now."""
        moment = now()
        with self._lock:
            stays = self._state.condition is condition
            self._state = replace(
                self._state,
                condition=condition,
                condition_since=self._state.condition_since if stays else moment,
                peer=None,
                last_error=reason[:LONGEST_ERROR],
                last_error_at=moment,
            )

    def left(self) -> None:
        """Say that this worker listens no longer."""
        with self._lock:
            self._state = replace(
                self._state,
                condition=FeedCondition.WAITING,
                condition_since=now(),
                peer=None,
            )

    def count_foreign(self) -> None:
        """Count a datagram from a sender that is not among those allowed."""
        with self._lock:
            self._state = replace(self._state, foreign_datagrams=self._state.foreign_datagrams + 1)
