r"""Sentences of the usual shape, found many at once: all that bulk decoding needs of a text.

Nearly every line of a recording looks like its neighbour: a whole message in one sentence, with its
time in a tag block, a `$PGHP` line, or an epoch after the checksum. `nmea_columns` reads all such
lines as columns; here they become *units*: a sentence with the time-only lines right before it, or
two sentences of one message that follow each other. Only what leaves no question is a unit: its
checksums hold and its time is plausible. All else that `nmea_lines` and `nmea_times` take lies in
the gaps between the units and is left to them, line by line.
"""

from collections.abc import Iterator
from datetime import datetime, timedelta

import numpy as np

from app.domain.nmea_assembly import WINDOW, Key
from app.domain.nmea_columns import ABSENT_US, Pghps, Sentences, Tags
from app.domain.nmea_times import EARLIEST, epoch_us
from app.domain.payload_bits import BoolArray, IntArray, Letters
from app.domain.text_columns import TextColumns

_WINDOW_US = WINDOW // timedelta(microseconds=1)


class Units:
    """The units of a text, a column each of what they hold.

    `received_us` is when a unit's sentence was heard, microseconds since 1970, `time_lines` how
    many lines before it told only that; `first_letters`, `lengths` and `fills` are its payload's.
    `keys` tells of which messages two parts were joined, and by what they belong together.
    """

    def __init__(self, text: bytes, not_after: datetime) -> None:
        self._text = text
        columns = TextColumns(text)
        tags, pghps = Tags(columns), Pghps(columns)
        self._parts = parts = Sentences(columns, tags)
        heard = _Heard(columns, tags, pghps, parts, not_after)
        firsts = self._joined(heard, epoch_us(not_after))
        is_unit = heard.is_sound & (parts.count == 1)
        is_unit[list(firsts)] = True
        self._at = np.flatnonzero(is_unit)
        last = self._at.copy()  # the sentence whose payload ends the message
        self.received_us = heard.received_us[self._at]
        self.keys: dict[int, Key] = {}
        for place in np.flatnonzero(parts.count[self._at] == 2).tolist():
            self.keys[place], self.received_us[place] = firsts[int(self._at[place])]
            last[place] += 1
        self.first_letters = columns.letters[parts.payloads[self._at]]
        self.fills = parts.fills[last]
        self.lengths = parts.payload_ends[self._at] - parts.payloads[self._at]
        is_joined = last > self._at
        self.lengths += is_joined * (parts.payload_ends[last] - parts.payloads[last])
        self.time_lines = heard.time_lines[self._at]
        self._starts = columns.starts[parts.line[self._at] - self.time_lines]
        self._ends = columns.nexts[parts.line[last]]
        self._columns = columns
        gaps_begin = np.concatenate([[0], self._ends])
        self._gaps = gaps_begin, np.concatenate([self._starts, [len(text)]])
        self.follow_gap: BoolArray = (self._gaps[0] < self._gaps[1])[:-1]

    def __len__(self) -> int:
        return int(self._at.size)

    def gap(self, at: int) -> bytes:
        """Return the text before a unit, or after all of them."""
        return self._text[self._gaps[0][at] : self._gaps[1][at]]

    def text(self, at: int) -> bytes:
        """Return a unit's lines."""
        return self._text[self._starts[at] : self._ends[at]]

    def letters(self, units: IntArray, count: int) -> Letters:
        """Return the payloads, of so many letters each and not joined, of some units."""
        begins = self._parts.payloads[self._at[units]]
        letters: Letters = self._columns.letters[begins[:, None] + np.arange(count)]
        return letters

    def payloads(self, units: IntArray) -> list[bytes]:
        """Return the payloads of some units."""
        text, at = self._text, self._at[units]
        begins, ends = self._parts.payloads[at].tolist(), self._parts.payload_ends[at].tolist()
        payloads = [text[begin:end] for begin, end in zip(begins, ends, strict=True)]
        for place in np.flatnonzero(self._parts.count[at] == 2).tolist():
            second = at[place] + 1
            payloads[place] += text[self._parts.payloads[second] : self._parts.payload_ends[second]]
        return payloads

    def _joined(self, heard: "_Heard", latest_us: int) -> dict[int, tuple[Key, int]]:
        """Return the first parts to which the second can be joined: by what, when heard first."""
        parts = self._parts
        is_first = (parts.count[:-1] == 2) & (parts.number[:-1] == 1) & (parts.fills[:-1] == 0)
        is_first &= (parts.count[1:] == 2) & (parts.number[1:] == 2) & heard.is_sound[:-1]
        is_first &= (parts.line[1:] == parts.line[:-1] + 1) & heard.is_told[1:]
        ours_us, theirs_us = heard.received_us[:-1], heard.told_us[1:]
        theirs_us = np.where(theirs_us == ABSENT_US, ours_us, theirs_us)
        is_first &= (abs(ours_us - theirs_us) <= _WINDOW_US) & (theirs_us <= latest_us)
        firsts = np.flatnonzero(is_first)
        received_us = np.minimum(ours_us, theirs_us)[firsts].tolist()
        may_differ = heard.is_tagged[firsts + 1].tolist()
        pairs = zip(self._names(firsts), self._names(firsts + 1), strict=True)
        joined = {}
        for at, (ours, theirs), us, is_doubtful in zip(
            firsts.tolist(), pairs, received_us, may_differ, strict=True
        ):
            if ours != theirs or (is_doubtful and not self._is_same_source(heard, at)):
                continue
            name, rest = ours
            sequence, channel, _ = rest.split(b",")
            joined[at] = (name, channel, sequence, 2), us
        return joined

    def _names(self, at: IntArray) -> Iterator[tuple[bytes, bytes]]:
        """Yield the talkers and formatters of some sentences, and their sequences and channels."""
        text = self._text
        ends = self._parts.payloads[at].tolist()
        for begin, end in zip(self._parts.begins[at].tolist(), ends, strict=True):
            yield text[begin + 1 : begin + 6], text[begin + 11 : end]

    def _is_same_source(self, heard: "_Heard", at: int) -> bool:
        """Whether a second part's tag block does not tell another station than the first part."""
        theirs = self._text[slice(*heard.tags[at + 1])]
        told = self._text[slice(*heard.tags[at])]
        pghp = self._text[slice(*heard.pghps[at])]
        if (theirs == told and not pghp) or not theirs:
            return True
        return _source(theirs, b"") in {_source(told, pghp), b""}


class _Heard:
    """When each sentence was heard, by what is written before it and behind it.

    `is_sound` tells where that leaves no question, `told_us` what the line itself says. `tags` and
    `pghps` are where the text of the tag block and of the `$PGHP` line begins and ends.
    """

    def __init__(
        self,
        text: TextColumns,
        all_tags: Tags,
        all_pghps: Pghps,
        parts: Sentences,
        not_after: datetime,
    ) -> None:
        self.is_tagged: BoolArray = all_tags.ends[parts.line] >= 0
        before = parts.line - 1
        has_pghp = ~self.is_tagged & (before >= 0) & all_pghps.is_good[before]
        pghp_us = np.where(has_pghp, all_pghps.moments_us[before], ABSENT_US)
        pghps = (text.starts[before] + 1, np.where(has_pghp, text.stops[before] - 3, 0))
        self.pghps = np.stack(pghps, axis=1)
        before -= has_pghp
        is_after_tag = ~self.is_tagged & (before >= 0) & all_tags.is_alone[before]
        tag_line = np.where(self.is_tagged, parts.line, before)
        has_tag = self.is_tagged | is_after_tag
        tag_us = np.where(has_tag, all_tags.epochs_us[tag_line], ABSENT_US)
        tags = (all_tags.begins[tag_line], np.where(has_tag, all_tags.ends[tag_line], 0))
        self.tags = np.stack(tags, axis=1)
        self.time_lines: IntArray = has_pghp.astype(np.int64) + is_after_tag
        self.told_us = _first_present(tag_us, parts.suffixes_us)
        self.received_us = _first_present(tag_us, pghp_us, parts.suffixes_us)
        # A tag block before the sentence that has no key `c` may tell the time in another way.
        self.is_told: BoolArray = ~self.is_tagged | (tag_us != ABSENT_US)
        self.is_sound: BoolArray = self.is_told & (self.received_us >= epoch_us(EARLIEST))
        self.is_sound &= self.received_us <= epoch_us(not_after)


def _source(tag: bytes, pghp: bytes) -> bytes:
    """Return the station that heard a sentence, as its tag block and its `$PGHP` line tell it."""
    told = b""
    for entry in tag.split(b","):
        if entry.startswith(b"s:"):
            told = entry[2:]
    return told + b",".join(pghp.split(b",")[9:12])


def _first_present(*columns_us: IntArray) -> IntArray:
    first, *others = columns_us
    for other in others:
        first = np.where(first == ABSENT_US, other, first)
    return first
