"""The letters of a text as one array, and where in it something stands.

A line of text is read letter by letter by a program that looks at one line. Looking at thousands,
the places of all line ends, commas and marks are found first, each by one comparison of the whole
text; what stands between them is then read for all lines at once, by a few steps on columns.
"""

import numpy as np
import numpy.typing as npt

from app.domain.nmea_lines import LONGEST_LINE
from app.domain.payload_bits import BoolArray, IntArray

_MARGIN = 32  # zeros after the text, so that reading a little past its end finds none
_SPARE = 16  # places after the last one: as many commas may be asked for
_NO_DIGIT = 1 << 10
_HEXADECIMAL = np.full(256, _NO_DIGIT)
for _digit in range(16):
    _HEXADECIMAL[[ord(f"{_digit:x}"), ord(f"{_digit:X}")]] = _digit


class TextColumns:
    r"""A text of whole lines, and the places in it of what parts its fields.

    `starts` is where lines begin, `stops` where they end before `\n` or `\r\n`, `nexts` where the
    next begins; lines `are_short` enough to be read.
    `marks` are the places of exclamation mark, star, backslash and line end, `strange`
    of whatever is no armoured letter. What is not found stands at the text's length.
    """

    def __init__(self, text: bytes) -> None:
        self.letters = np.frombuffer(text + bytes(_MARGIN), dtype=np.uint8)
        self._length = len(text)
        letters = self.letters[: self._length]
        is_feed, is_return = letters == ord("\n"), letters == ord("\r")
        feeds = np.flatnonzero(is_feed)
        self.nexts: IntArray = feeds + 1
        self.starts: IntArray = np.concatenate([[0], self.nexts])[: feeds.size]
        self.stops: IntArray = feeds - ((feeds > self.starts) & is_return[feeds - 1])
        self.are_short: BoolArray = feeds - self.starts <= LONGEST_LINE
        self.commas = self._places(letters == ord(","))
        self.marks = self._places(
            is_feed | is_return | (letters == ord("!")) | (letters == ord("*"))
            | (letters == ord("\\"))
        )  # fmt: skip
        # Unsigned letters below the first of a range wrap round to large ones.
        self.strange = self._places((letters - 48 >= 40) & (letters - 96 >= 24))

    def first(self, places: IntArray, since: IntArray) -> IntArray:
        """Return the first of some places that is not before another, for many others."""
        found: IntArray = places[np.searchsorted(places, np.minimum(since, self._length))]
        return found

    def numbers(self, begins: IntArray, ends: IntArray, most: int) -> tuple[IntArray, BoolArray]:
        """Return the decimal numbers between places, and which are any, of `most` digits."""
        places = ends[:, None] - 1 - np.arange(most)
        digits = self.letters[places] - 48
        inside = places >= begins[:, None]
        is_number = (digits <= 9) | ~inside
        widths = ends - begins
        values: IntArray = np.where(inside, digits, 0) @ 10 ** np.arange(most)
        return values, is_number.all(axis=1) & (widths >= 1) & (widths <= most)

    def sums_hold(self, begins: IntArray, stars: IntArray) -> BoolArray:
        """Return where the XOR of the letters before a star is the one told behind it."""
        pairs = np.stack([begins, stars], axis=1).ravel()
        found = np.bitwise_xor.reduceat(self.letters, pairs)[::2] if begins.size else begins
        told = _HEXADECIMAL[self.letters[stars + 1]] << 4 | _HEXADECIMAL[self.letters[stars + 2]]
        holds: BoolArray = found == told
        return holds

    def _places(self, are_there: npt.NDArray[np.bool_]) -> IntArray:
        return np.concatenate([np.flatnonzero(are_there), np.full(_SPARE, self._length)])
