"""A request's body in the pieces that the network brought it in.

Joining a pack of megabytes only to cut it into its files again copies every byte twice, in memory
that the system has to make anew each time. So the pieces stay as they came until a file is wanted.
"""

import bisect
from collections.abc import Iterable
from itertools import accumulate, pairwise


class Octets:
    """Bytes in pieces, read by their place in the whole."""

    def __init__(self, pieces: Iterable[bytes]) -> None:
        self._pieces = [piece for piece in pieces if piece]
        self._starts = list(accumulate(map(len, self._pieces), initial=0))

    @property
    def size_bytes(self) -> int:
        """How many bytes there are."""
        return self._starts[-1]

    def part(self, begin: int, end: int) -> bytes:
        """Return the bytes from `begin` up to `end`, both within the body."""
        number = bisect.bisect_right(self._starts, begin) - 1
        found = []
        for piece, (start, stop) in zip(
            self._pieces[number:], pairwise(self._starts[number:]), strict=True
        ):
            if start >= end:
                break
            found.append(memoryview(piece)[max(begin - start, 0) : min(end, stop) - start])
        return b"".join(found)

    def whole(self) -> bytes:
        """Return all bytes."""
        return b"".join(self._pieces)
