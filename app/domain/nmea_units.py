r"""Sentences of the usual shape, found many at once: all that bulk decoding needs of a text.

Nearly every line of a recording looks like its neighbour: a whole message in one sentence, with its
time in a tag block, a `$PGHP` line, or an epoch after the checksum. One regular expression finds
such a *unit* (the sentence and the time-only lines right before it), another step checks all its
checksums as one array. A message in two sentences that follow each other is a unit as well. The
expression takes less than `nmea_lines` and `nmea_times` do, never more: what it does not take lies
in the gaps between the units and is left to them, line by line.
"""

import re
from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

import numpy as np

from app.domain.nmea_assembly import WINDOW, Key
from app.domain.nmea_times import EARLIEST, FIRST_MILLISECONDS, epoch_us, xor_checksum
from app.domain.payload_bits import BoolArray, IntArray

_SUM = rb"\*([0-9A-Fa-f]{2})"
_ENTRY = rb"[abd-fh-zA-Z][a-zA-Z]?:[^,*\\!\r\n]*"  # of a tag block; neither time nor group
_TAG = rb"(?=[a-zA-Z])((?:%b(?:,|(?=\*)))*+(?:c:(\d{10}|\d{13})(?:,%b)*+)?)" % (_ENTRY, _ENTRY)
_PGHP = rb"(PGHP,\d*,(\d{4}(?:,\d\d?){5},\d{1,3}),[^*!\r\n]*)"
_NAME, _END = rb"[0-9A-Z-]{2}VD[MO]", rb"\d{0,2},[0-9A-Z]?,([0-W`-w]{1,80}),([0-5]))" + _SUM
_SENTENCE = rb"!(" + _NAME + rb",(?:1,1|(?P<two>2,1))," + _END + rb"(?:,(\d{10}))?"
_SECOND = rb"((?:\\[^\\!\r\n]*\\)?!" + _NAME + rb",2,2,[^!\\\r\n]*)"
_UNIT = re.compile(
    rb"^("
    rb"(?:\\" + _TAG + _SUM + rb"\\(?:(\r?\n)|(?=!)))?"  # a line of its own, or before the sentence
    rb"(?:\$" + _PGHP + _SUM + rb"\r?\n)?" + _SENTENCE + rb"(?(two)\r?\n" + _SECOND + rb"))\r?\n",
    re.MULTILINE,
)
_SECOND_READ = re.compile(
    rb"(?:\\" + _TAG + _SUM + rb"\\)?!(" + _NAME + rb",2,2," + _END + rb"(?:,(\d{10}))?"
)
_COLUMNS = 16  # what `_UNIT.split` gives for each unit: the gap before it, and its groups
_WINDOW_US = WINDOW // timedelta(microseconds=1)
_ABSENT_US = np.iinfo(np.int64).min
_NIBBLES = np.zeros(256, dtype=np.uint8)
for _digit in range(16):
    _NIBBLES[[ord(f"{_digit:x}"), ord(f"{_digit:X}")]] = _digit

_Column = Sequence[bytes | None]


class Units:
    """The units of a text, a column each of what they hold.

    `gaps` has the text before each unit and, last, the text after all. `received_us` is when a
    unit's sentence was heard, microseconds since 1970. `sound` tells of which units all checksums
    hold and the time is plausible: the others are to be read line by line. `keys` tells of which
    messages the two parts were joined, and by what they belong together.
    """

    def __init__(self, text: bytes, not_after: datetime) -> None:
        pieces: list[bytes] = _UNIT.split(text)
        columns = [pieces[at::_COLUMNS] for at in range(_COLUMNS)]
        self.gaps, self.texts, tags, epochs, tag_sums, tag_ends, *columns = columns
        pghps, moments, pghp_sums, bodies, twos, payloads, fills, sums, suffixes, seconds = columns
        pghp_us, is_date = _moments_us(moments)
        self.received_us = _first_present(_epochs_us(epochs), pghp_us, _epochs_us(suffixes))
        in_time = self.received_us >= epoch_us(EARLIEST)
        in_time &= self.received_us <= epoch_us(not_after)
        is_alone = _is_present(tag_ends)
        self.time_lines: IntArray = is_alone.astype(np.int64) + _is_present(pghps)
        # A tag block before the sentence that has no key `c` may tell the time in another way.
        is_told = is_alone | _is_present(epochs) | ~_is_present(tags)
        self.sound: BoolArray = in_time & is_date & is_told
        for texts, told in ((bodies, sums), (tags, tag_sums), (pghps, pghp_sums)):
            self.sound &= _checksums_hold(texts, told)
        self.payloads, self.fills = payloads, fills
        self.keys: dict[int, Key] = {}
        latest_us = epoch_us(not_after)
        for at in np.flatnonzero(_is_present(twos) & self.sound).tolist():
            first = _First(bodies[at], tags[at], pghps[at], int(self.received_us[at]), latest_us)
            self._join(at, first, seconds[at])

    def __len__(self) -> int:
        return len(self.texts)

    def _join(self, at: int, first: "_First", second: bytes) -> None:
        """Join a message's second part to its first, where nothing is unusual about it."""
        part = _second_part(first, second)
        if part is None or self.fills[at] != b"0":
            self.sound[at] = False
            return
        self.keys[at] = part.key
        self.payloads[at] += part.payload
        self.fills[at] = part.fill
        self.received_us[at] = min(first.received_us, part.received_us)


class _First(NamedTuple):
    """What counts of a message's first part."""

    body: bytes
    tag: bytes | None
    pghp: bytes | None
    received_us: int
    latest_us: int  # plausible time


class _Second(NamedTuple):
    """What a message's second part adds; without a time of its own it was heard with the first."""

    key: Key
    payload: bytes
    fill: bytes
    received_us: int


def _second_part(first: _First, line: bytes) -> _Second | None:
    """Read the second part of a message, None if it needs a closer look or belongs to another."""
    match = _SECOND_READ.fullmatch(line)
    if match is None:
        return None
    tag, epoch, tag_sum, body, payload, fill, told, suffix = match.groups()
    name, _, _, sequence, channel, *_ = body.split(b",")
    their_name, _, _, their_sequence, their_channel, *_ = first.body.split(b",")
    if (name, sequence, channel) != (their_name, their_sequence, their_channel):
        return None
    received_us = first.received_us
    if tag is not None:
        source = _source(first.tag, first.pghp)
        is_known = epoch is not None and xor_checksum(tag) == int(tag_sum, 16)
        if not is_known or _source(tag, None) not in {source, b""}:
            return None
    if digits := epoch or suffix:
        count = int(digits)
        received_us = count * (1_000 if count >= FIRST_MILLISECONDS else 1_000_000)
    is_near = abs(received_us - first.received_us) <= _WINDOW_US
    if not is_near or received_us > first.latest_us or xor_checksum(body) != int(told, 16):
        return None
    return _Second((name, channel, sequence, 2), payload, fill, received_us)


def _source(tag: bytes | None, pghp: bytes | None) -> bytes:
    """Return the station that heard a sentence, as its tag block and its `$PGHP` line tell it."""
    told = b""
    for entry in tag.split(b",") if tag else ():
        if entry.startswith(b"s:"):
            told = entry[2:]
    return told + (b",".join(pghp.split(b",")[9:12]) if pghp else b"")


def _is_present(column: _Column) -> BoolArray:
    absent = column.count(None)
    if absent in {0, len(column)}:
        return np.full(len(column), absent == 0)
    return np.array([piece is not None for piece in column], dtype=np.bool_)


def _first_present(*columns_us: IntArray) -> IntArray:
    first, *others = columns_us
    for other in others:
        first = np.where(first == _ABSENT_US, other, first)
    return first


def _epochs_us(digits: _Column) -> IntArray:
    """Return epochs in seconds or milliseconds as microseconds, or `_ABSENT_US`."""
    epochs_us = np.full(len(digits), _ABSENT_US)
    present = _is_present(digits)
    count = np.array([int(piece) for piece in digits if piece is not None], dtype=np.int64)
    epochs_us[present] = np.where(count >= FIRST_MILLISECONDS, count * 1_000, count * 1_000_000)
    return epochs_us


def _moments_us(moments: _Column) -> tuple[IntArray, BoolArray]:
    """Return the moments of `$PGHP` lines, or `_ABSENT_US`; and which are in the calendar."""
    moments_us, is_date = np.full(len(moments), _ABSENT_US), np.full(len(moments), True)
    present = _is_present(moments)
    if not present.any():
        return moments_us, is_date
    numbers = b",".join(piece for piece in moments if piece is not None).split(b",")
    year, month, day, hour, minute, second, millisecond = (
        np.array(list(map(int, numbers)), dtype=np.int64).reshape(-1, 7).T
    )
    months = ((year - 1970) * 12 + month - 1).astype("datetime64[M]")
    first_day = months.astype("datetime64[D]").astype(np.int64)
    days_in_month = (months + 1).astype("datetime64[D]").astype(np.int64) - first_day
    is_date[present] = (
        ((year >= 1) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= days_in_month))
        & ((hour <= 23) & (minute <= 59) & (second <= 59))
    )  # fmt: skip
    seconds = ((first_day + day - 1) * 24 + hour) * 3600 + minute * 60 + second
    moments_us[present] = seconds * 1_000_000 + millisecond * 1_000
    return moments_us, is_date


def _checksums_hold(texts: _Column, told: _Column) -> BoolArray:
    """Return whether the XOR of each text's bytes is the one told in hexadecimal; True for None."""
    holds = np.full(len(texts), True)
    bodies = [text for text in texts if text is not None]
    if not bodies:
        return holds
    lengths = np.array([len(body) for body in bodies])
    letters = np.frombuffer(b"".join(bodies), dtype=np.uint8)
    found = np.bitwise_xor.reduceat(letters, np.cumsum(lengths) - lengths)
    digits = _NIBBLES[np.frombuffer(b"".join(d for d in told if d is not None), dtype=np.uint8)]
    holds[_is_present(texts)] = found == (digits[::2] << 4 | digits[1::2])
    return holds
