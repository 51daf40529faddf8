"""Lines on their way from the network to the database, in bounded memory.

The network does not wait and the database sometimes does. Between them stands a queue that holds so
many lines and so many bytes and no more: what comes on top is dropped and counted, because a
process that grows until it is killed loses everything.
"""

import threading
from collections import deque
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import islice

from app.domain.nmea_lines import LONGEST_LINE

MOST_BYTES = 8 << 20
Line = tuple[datetime, bytes]  # when it came (aware UTC), and what


class LineCutter:
    """Cuts a stream of bytes at line feeds; of a line without an end only the beginning is kept."""

    def __init__(self) -> None:
        self._rest = b""
        self._skipping = False

    def push(self, chunk: bytes) -> Iterator[bytes]:
        """Yield the lines that a piece of the stream completes, each at most one byte too long."""
        *complete, self._rest = (self._rest + chunk).split(b"\n")
        for line in complete:
            if not self._skipping:
                yield line[: LONGEST_LINE + 1]
            self._skipping = False
        if len(self._rest) > LONGEST_LINE:
            if not self._skipping:
                yield self._rest[: LONGEST_LINE + 1]
            self._skipping = True
            self._rest = b""

    def end(self) -> Iterator[bytes]:
        """Yield the line that the stream's end cut off, if any."""
        if self._rest and not self._skipping:
            yield self._rest
        self._rest = b""
        self._skipping = False


class LineQueue:
    """Lines in the order they came; one thread puts, another takes."""

    def __init__(self, most_lines: int, most_bytes: int = MOST_BYTES) -> None:
        self._most_lines = most_lines
        self._most_bytes = most_bytes
        self._lines: deque[Line] = deque()
        self._bytes = 0
        self._dropped = 0
        self._changed = threading.Condition()

    def put(self, arrival: datetime, lines: Sequence[bytes]) -> None:
        """Append lines that came at a moment, up to the first for which there is no room.

        Dropping the rest costs nothing a line, or a flood would starve who empties the queue; nor
        does a stream that comes byte by byte wake it before there is a line.
        """
        if not lines:
            return
        with self._changed:
            room = self._most_lines - len(self._lines)
            kept = 0
            for line in islice(lines, room):
                if self._bytes + len(line) > self._most_bytes:
                    break
                self._lines.append((arrival, line))
                self._bytes += len(line)
                kept += 1
            self._dropped += len(lines) - kept
            self._changed.notify()

    def drop(self, count: int) -> None:
        """Count lines that were lost before they could be put."""
        with self._changed:
            self._dropped += count

    def take(self, most: int, timeout_s: float) -> list[Line]:
        """Return the oldest lines, as soon as there are some; none when the time is over."""
        with self._changed:
            if not self._lines:
                self._changed.wait(timeout_s)
            taken = [self._lines.popleft() for _ in range(min(most, len(self._lines)))]
            self._bytes -= sum(len(line) for _, line in taken)
            return taken

    def take_dropped(self) -> int:
        """Return how many lines were dropped since the last call."""
        with self._changed:
            dropped, self._dropped = self._dropped, 0
            return dropped
