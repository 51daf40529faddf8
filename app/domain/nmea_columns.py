r"""Tag blocks, `$PGHP` lines and sentences of all lines of a text, a column each of what they hold.

Each line is taken only if all of it is understood and its checksums hold: this takes less than
`nmea_lines` and `nmea_times` do, never more. Columns called `at` a line have as many rows as the
text has lines.

Source: as for `nmea_lines` and `nmea_times`.
"""

import numpy as np

from app.domain.nmea_times import FIRST_MILLISECONDS
from app.domain.payload_bits import BoolArray, IntArray
from app.domain.text_columns import TextColumns

ABSENT_US = np.iinfo(np.int64).min
_LONGEST_PAYLOAD = 80  # letters
_LAST_FILL = 5
_NEVER = -1
_CAPITALS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_DIGITS = b"0123456789"
_BANG, _STAR, _COMMA, _COLON, _BACKSLASH = b"!*,:\\"
_PGHP = np.frombuffer(b"$PGHP,", dtype=np.uint8)


def _set_of(letters: bytes) -> BoolArray:
    among = np.full(256, False)
    among[list(letters)] = True
    return among


_IS_LETTER = _set_of(_CAPITALS + _CAPITALS.lower())
_IS_OTHER_KEY = _IS_LETTER & ~_set_of(b"cg")  # of a tag block: neither time nor group
_IS_NAME = _set_of(_CAPITALS + _DIGITS)
_IS_TALKER = _IS_NAME | _set_of(b"-")


class Tags:
    r"""Tag blocks at the beginning of lines: their text `begins` and `ends`, -1 without one.

    Each tells its time at most once, `epochs_us` (or `ABSENT_US`), and speaks of no group. A line
    `is_alone` that holds nothing else.
    """

    def __init__(self, text: TextColumns) -> None:
        letters = text.letters
        at = np.flatnonzero(letters[text.starts] == _BACKSLASH)
        begins = text.starts[at] + 1
        ends = text.first(text.marks, begins)
        is_good = (letters[ends] == _STAR) & (letters[ends + 3] == _BACKSLASH)
        is_good &= text.are_short[at] & text.sums_hold(begins, ends)
        at, begins, ends = at[is_good], begins[is_good], ends[is_good]
        epochs_us, is_good = _told(text, begins, ends)
        at, begins, ends = at[is_good], begins[is_good], ends[is_good]
        self.begins, self.ends = (np.full(text.starts.size, _NEVER) for _ in range(2))
        self.epochs_us = np.full(text.starts.size, ABSENT_US)
        self.begins[at], self.ends[at], self.epochs_us[at] = begins, ends, epochs_us[is_good]
        self.is_alone: BoolArray = (self.ends != _NEVER) & (self.ends + 4 == text.stops)


def _told(text: TextColumns, begins: IntArray, ends: IntArray) -> tuple[IntArray, BoolArray]:
    """Return the times of tag blocks, and which hold nothing unusual."""
    letters, commas = text.letters, text.commas
    count = np.searchsorted(commas, ends) - np.searchsorted(commas, begins) + 1
    first = np.cumsum(count) - count
    of = np.repeat(np.arange(begins.size), count)
    nth = np.arange(of.size) - first[of]
    comma = np.searchsorted(commas, begins)[of] + nth
    starts = np.where(nth == 0, begins[of], commas[comma - 1] + 1)
    stops = np.minimum(commas[comma], ends[of])
    key, second, third = (letters[starts + place] for place in range(3))
    is_time = (key == ord("c")) & (second == _COLON)
    is_other = (second == _COLON) | (_IS_LETTER[second] & (third == _COLON))
    times = np.flatnonzero(is_time)
    values, is_number = text.numbers(starts[times] + 2, stops[times], 13)
    widths = stops[times] - starts[times] - 2
    is_known = (is_other & _IS_OTHER_KEY[key]) | is_time
    is_known[times] &= is_number & ((widths == 10) | (widths == 13))
    is_good = np.bincount(of[~is_known], minlength=begins.size) == 0
    is_good &= np.bincount(of[times], minlength=begins.size) <= 1
    epochs_us = np.full(begins.size, ABSENT_US)
    epochs_us[of[times]] = _epochs_us(values)
    return epochs_us, is_good


class Pghps:
    """Lines that are `$PGHP`, at each line: which are good, and `moments_us`."""

    def __init__(self, text: TextColumns) -> None:
        self.is_good: BoolArray = np.full(text.starts.size, False)
        self.moments_us = np.full(text.starts.size, ABSENT_US)
        is_of = (text.letters[text.starts] == _PGHP[0]) & text.are_short
        at = np.flatnonzero(is_of)
        begins = text.starts[at]
        stars = np.maximum(text.stops[at] - 3, begins)  # a line may be shorter
        is_good = (text.letters[begins[:, None] + np.arange(_PGHP.size)] == _PGHP).all(axis=1)
        is_good &= text.first(text.marks, begins) == stars
        is_good &= (text.letters[stars] == _STAR) & text.sums_hold(begins + 1, stars)
        at, begins, stars = at[is_good], begins[is_good], stars[is_good]
        comma = np.searchsorted(text.commas, begins)[:, None] + np.arange(9)
        commas = text.commas[comma]
        _, is_good = text.numbers(commas[:, 0] + 1, commas[:, 1], 9)
        is_good |= commas[:, 1] == commas[:, 0] + 1
        is_good &= (commas[:, 8] < stars) & (commas[:, 2] == commas[:, 1] + 5)
        numbers = []
        for nth, most in enumerate((4, 2, 2, 2, 2, 2, 3), start=1):
            number, is_number = text.numbers(commas[:, nth] + 1, commas[:, nth + 1], most)
            numbers.append(number)
            is_good &= is_number
        moments_us, is_date = _moments_us(*(number[is_good] for number in numbers))
        at = at[is_good][is_date]
        self.is_good[at] = True
        self.moments_us[at] = moments_us[is_date]


class Sentences:
    r"""Sentences with a message of one part or a part of two, one a line, tagged or not.

    `line` is the number of the line, `begins` the place of the exclamation mark. `count` and
    `number` tell which part it is. A payload lies from `payloads` to before `payload_ends`;
    `suffixes_us` is the time behind the checksum, or `ABSENT_US`.
    """

    def __init__(self, text: TextColumns, tags: Tags) -> None:
        letters = text.letters
        starts = np.where(tags.ends == _NEVER, text.starts, tags.ends + 4)
        line = np.flatnonzero((letters[starts] == _BANG) & text.are_short)
        begins = starts[line]
        comma = np.searchsorted(text.commas, begins)
        sequence_end, channel_end, end = (text.commas[comma + nth] for nth in (3, 4, 5))
        star = text.first(text.marks, begins + 1)
        head = letters[begins[:, None] + np.arange(11)].T
        count, number = head[7].astype(np.int64) - 48, head[9].astype(np.int64) - 48
        is_good = (head[6] == _COMMA) & (head[8] == _COMMA) & (head[10] == _COMMA)
        is_good &= _IS_TALKER[head[1]] & _IS_TALKER[head[2]] & (head[3] == ord("V"))
        is_good &= (head[4] == ord("D")) & ((head[5] == ord("M")) | (head[5] == ord("O")))
        is_good &= ((count == 1) | (count == 2)) & (number >= 1) & (number <= count)
        _, is_sequence = text.numbers(begins + 11, sequence_end, 2)
        is_good &= is_sequence | (sequence_end == begins + 11)
        is_channel = (channel_end == sequence_end + 2) & _IS_NAME[letters[sequence_end + 1]]
        is_good &= is_channel | (channel_end == sequence_end + 1)
        payload, fill = channel_end + 1, letters[star - 1].astype(np.int64) - 48
        is_good &= (text.first(text.strange, payload) == end) & (end == star - 2)
        is_good &= (end > payload) & (end - payload <= _LONGEST_PAYLOAD)
        is_good &= (fill >= 0) & (fill <= _LAST_FILL) & (letters[star] == _STAR)
        stop = text.stops[line]
        values, is_number = text.numbers(star + 4, stop, 10)
        has_suffix = (stop == star + 14) & (letters[star + 3] == _COMMA) & is_number
        is_good &= (has_suffix | (stop == star + 3)) & text.sums_hold(begins + 1, star)
        suffixes_us = np.where(has_suffix, _epochs_us(values), ABSENT_US)
        self.line, self.begins = line[is_good], begins[is_good]
        self.count, self.number = count[is_good], number[is_good]
        self.payloads, self.payload_ends = payload[is_good], end[is_good]
        self.fills, self.suffixes_us = fill[is_good], suffixes_us[is_good]


def _epochs_us(epochs: IntArray) -> IntArray:
    """Return epochs in seconds or milliseconds as microseconds."""
    return epochs * np.where(epochs >= FIRST_MILLISECONDS, 1_000, 1_000_000)


def _moments_us(
    year: IntArray, month: IntArray, day: IntArray, hour: IntArray, minute: IntArray,
    second: IntArray, millisecond: IntArray,
) -> tuple[IntArray, BoolArray]:  # fmt: skip
    """Return moments, and which of them are in the calendar."""
    months = ((year - 1970) * 12 + month - 1).astype("datetime64[M]")
    first_day = months.astype("datetime64[D]").astype(np.int64)
    days_in_month = (months + 1).astype("datetime64[D]").astype(np.int64) - first_day
    is_date = (
        ((year >= 1) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= days_in_month))
        & ((hour <= 23) & (minute <= 59) & (second <= 59))
    )  # fmt: skip
    seconds = ((first_day + day - 1) * 24 + hour) * 3600 + minute * 60 + second
    return seconds * 1_000_000 + millisecond * 1_000, is_date
