"""Recordings in bulk: what is usual by the thousand, what is rare line by line, counted alike.

`NmeaDecoder` reads any line, and says what a line means. It is the reference, and for a year's
recording it is slow. So here each block of text is first taken apart into *units* of the usual
shape (`nmea_units`), whose payloads are decoded as columns (`ais_bulk`, `static_bulk`). Everything
else goes to the reference at its place in the order: gaps between units, damaged checksums, parts
that do not follow each other, whatever would be rejected. What both share is kept in the reference
and in its order: the memory of repeats, the parts of messages, a time on its way to the next
sentence. A test holds the two ways against each other, report by report and count by count.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import POSITION_LETTERS, POSITION_TYPES, PositionBits, PositionTable
from app.domain.ais_payload import WANTED_LETTERS
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.nmea_lines import split_blocks, split_lines
from app.domain.nmea_units import Units
from app.domain.payload_bits import BoolArray
from app.domain.static_bulk import STATIC_TYPES, StaticBits
from app.domain.static_table import StaticTable

Decoded = PositionTable | StaticTable | PositionReport | StaticReport

_IGNORED, _POSITION, _STATIC, _OTHER = range(4)
_KINDS = np.full(256, _IGNORED)
_KINDS[list(WANTED_LETTERS)] = _OTHER
_KINDS[list(POSITION_TYPES)] = _POSITION
_KINDS[list(STATIC_TYPES)] = _STATIC


def decode_recording(chunks: Iterable[bytes], decoder: NmeaDecoder) -> Iterator[Decoded]:
    """Yield the reports of a whole recording; the accounting is the decoder's.

    The order of reports is kept from block to block, not within one. Where the decoder tells each
    rejected line, all lines are read one by one.
    """
    if decoder.tells_rejects:
        yield from decode_lines(split_lines(chunks), decoder)
        return
    bulk = _BulkDecoder(decoder)
    for text in split_blocks(chunks):
        yield from bulk.decode(text)
    decoder.finish()


class _BulkDecoder:
    """Decodes blocks of text with the help of the reference."""

    def __init__(self, reference: NmeaDecoder) -> None:
        self._reference = reference

    def decode(self, text: bytes) -> Iterator[Decoded]:
        """Yield the reports of whole lines."""
        block = _Block(Units(text, self._reference.not_after))
        yield from self._read_through(block)
        self._count(block)
        yield from block.reports()

    def _read_through(self, block: "_Block") -> Iterator[Decoded]:
        """Take the plain units and read all else line by line, each at its place in the order."""
        units, start = block.units, 0
        for at in block.halts():
            yield from self._take(block, start, at)
            yield from self._read(units.gap(at))
            start = at
            if not block.is_plain[at] or self._reference.carries_time:
                yield from self._read_unit(block, at)
                start += 1
        yield from self._take(block, start, len(units))
        yield from self._read(units.gap(len(units)))

    def _read_unit(self, block: "_Block", at: int) -> Iterator[Decoded]:
        block.is_plain[at] = False
        return self._read(block.units.text(at))

    def _read(self, text: bytes) -> Iterator[Decoded]:
        if text:
            for line in text.removesuffix(b"\n").split(b"\n"):
                yield from self._reference.feed(line)

    def _take(self, block: "_Block", start: int, stop: int) -> Iterator[Decoded]:
        """Take plain units that follow each other, but those whose parts meet unfinished ones."""
        for at in block.joined_within(start, stop):
            if not self._reference.may_join(block.units.keys[at]):
                self._take_plain(block, start, at)
                yield from self._read_unit(block, at)
                start = at + 1
        self._take_plain(block, start, stop)

    def _take_plain(self, block: "_Block", start: int, stop: int) -> None:
        """Take plain units that follow each other, and note which are no repeats."""
        self._reference.pass_by(int(block.sentences[start:stop].sum()))
        of = slice(*np.searchsorted(block.wanted, (start, stop)))
        block.is_first[of] = self._reference.repeats.first_heard(
            block.payloads[of], block.received_us[of].tolist()
        )

    def _count(self, block: "_Block") -> None:
        """Count the units that were taken; the reference has counted what it read."""
        taken = int(np.count_nonzero(block.is_plain))
        sentences = int(block.sentences[block.is_plain].sum())
        ignored = int(np.count_nonzero(block.is_plain & (block.kinds == _IGNORED)))
        first = block.kinds[block.wanted[block.is_first]]
        counts = self._reference.accounting
        counts.lines.sentence += sentences
        counts.lines.time_only += int(block.units.time_lines[block.is_plain].sum())
        counts.sentences.total += sentences
        counts.messages.assembled += taken
        counts.messages.ignored_type += ignored
        counts.messages.positions += int(np.count_nonzero(first == _POSITION))
        counts.messages.statics += int(np.count_nonzero(first == _STATIC))
        counts.messages.duplicates += taken - ignored - first.size


class _Block:
    """A block's units: which are plain, which of them are wanted, and of these no repeats."""

    def __init__(self, units: Units) -> None:
        self.units = units
        self.kinds = _KINDS[units.first_letters]
        self.sentences = np.ones(len(units), dtype=np.int64)
        self._joined = np.array(sorted(units.keys), dtype=np.int64)
        self.sentences[self._joined] = 2
        is_position = (self.kinds == _POSITION) & (units.fills == 0)
        is_position &= (units.lengths == POSITION_LETTERS) & (self.sentences == 1)
        self._positions = np.flatnonzero(is_position)
        self._statics = np.flatnonzero(self.kinds == _STATIC)
        self._position_bits = PositionBits(units.letters(self._positions, POSITION_LETTERS))
        bits = 6 * units.lengths - units.fills
        self._static_bits = StaticBits(units.payloads(self._statics), bits[self._statics])
        self.is_plain: BoolArray = self.kinds == _IGNORED
        self.is_plain[self._positions] = self._position_bits.usable
        self.is_plain[self._statics] = self._static_bits.usable
        self.wanted = np.flatnonzero(self.is_plain & (self.kinds != _IGNORED))
        self.payloads = units.payloads(self.wanted)
        self.received_us = units.received_us[self.wanted]
        self.is_first: BoolArray = np.full(len(self.payloads), False)

    def halts(self) -> list[int]:
        """Return the units at which there is something to be read line by line."""
        has_gap = self.units.follow_gap.copy()
        has_gap[:1] = True  # a time may have come with the block before
        halts: list[int] = np.flatnonzero(has_gap | ~self.is_plain).tolist()
        return halts

    def joined_within(self, start: int, stop: int) -> list[int]:
        """Return the units from `start` to before `stop` whose message came in two parts."""
        first, last = np.searchsorted(self._joined, (start, stop))
        joined: list[int] = self._joined[first:last].tolist()
        return joined

    def reports(self) -> Iterator[Decoded]:
        """Yield the reports that are no repeats, as tables."""
        first = self.wanted[self.is_first]
        positions = np.flatnonzero(np.isin(self._positions, first, assume_unique=True))
        if positions.size:
            received_us = self.units.received_us[self._positions[positions]]
            yield self._position_bits.table(positions, received_us)
        statics = np.flatnonzero(np.isin(self._statics, first, assume_unique=True))
        yield from self._static_bits.tables(statics, self.units.received_us[self._statics[statics]])
