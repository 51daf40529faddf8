"""Recordings in bulk: what is usual by the thousand, what is rare line by line, counted alike.

`NmeaDecoder` reads any line, and says what a line means. It is the reference, and for a year's
recording it is slow. So here each block of text is first taken apart into *units* of the usual
shape (`nmea_units`), whose positions are decoded as columns (`ais_bulk`). Everything else goes to
the reference at its place in the order: gaps between units, damaged checksums, messages in parts,
statics, whatever would be rejected. What both share is kept in the reference and in its order: the
memory of repeats, the parts of messages, a time on its way to the next sentence. A test holds the
two ways against each other, report by report and count by count.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_bulk import (
    POSITION_LETTERS,
    POSITION_TYPES,
    BoolArray,
    PositionBits,
    PositionTable,
)
from app.domain.ais_payload import WANTED_LETTERS
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.nmea_lines import split_blocks, split_lines
from app.domain.nmea_units import Units

Decoded = PositionTable | PositionReport | StaticReport

_IGNORED, _POSITION, _OTHER = range(3)
_KINDS = np.full(256, _IGNORED)
_KINDS[list(WANTED_LETTERS)] = _OTHER
_KINDS[list(POSITION_TYPES)] = _POSITION


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
        if block.is_first.any():
            yield block.table()

    def _read_through(self, block: "_Block") -> Iterator[Decoded]:
        """Take the plain units and read all else line by line, each at its place in the order."""
        units, start = block.units, 0
        for at in block.halts():
            self._take(block, start, at)
            yield from self._read(units.gaps[at])
            start = at
            if not block.is_plain[at] or self._reference.carries_time:
                yield from self._read(units.texts[at])
                block.is_plain[at] = False
                start += 1
        self._take(block, start, len(units))
        yield from self._read(units.gaps[-1])

    def _read(self, text: bytes) -> Iterator[Decoded]:
        if text:
            for line in text.removesuffix(b"\n").split(b"\n"):
                yield from self._reference.feed(line)

    def _take(self, block: "_Block", start: int, stop: int) -> None:
        """Take plain units that follow each other, and note which are no repeats."""
        self._reference.pass_by(stop - start)
        of = slice(*np.searchsorted(block.positions, (start, stop)))
        block.is_first[of] = self._reference.repeats.first_heard(
            block.payloads[of], block.received_us[of].tolist()
        )

    def _count(self, block: "_Block") -> None:
        """Count the units that were taken; the reference has counted what it read."""
        taken = int(np.count_nonzero(block.is_plain))
        ignored = int(np.count_nonzero(block.is_plain & (block.kinds == _IGNORED)))
        first = int(np.count_nonzero(block.is_first))
        counts = self._reference.accounting
        counts.lines.sentence += taken
        counts.lines.time_only += int(block.units.time_lines[block.is_plain].sum())
        counts.sentences.total += taken
        counts.messages.assembled += taken
        counts.messages.ignored_type += ignored
        counts.messages.positions += first
        counts.messages.duplicates += taken - ignored - first


class _Block:
    """A block's units: which are plain, and of the positions among them which are no repeats."""

    def __init__(self, units: Units) -> None:
        self.units = units
        letters = bytes([payload[0] for payload in units.payloads])
        self.kinds = _KINDS[np.frombuffer(letters, dtype=np.uint8)]
        lengths = np.array([len(payload) for payload in units.payloads], dtype=np.int64)
        fills = np.array([fill == b"0" for fill in units.fills], dtype=np.bool_)
        is_position = (self.kinds == _POSITION) & (lengths == POSITION_LETTERS) & fills
        self.positions = np.flatnonzero(is_position & units.sound)
        self.payloads = [units.payloads[at] for at in self.positions.tolist()]
        self.received_us = units.received_us[self.positions]
        self._bits = PositionBits(self.payloads)
        self.is_plain: BoolArray = units.sound & (self.kinds == _IGNORED)
        self.is_plain[self.positions] = self._bits.usable
        self.is_first: BoolArray = np.full(len(self.payloads), False)

    def halts(self) -> list[int]:
        """Return the units at which there is something to be read line by line."""
        follows_gap = np.array([bool(gap) for gap in self.units.gaps[:-1]], dtype=np.bool_)
        follows_gap[:1] = True  # a time may have come with the block before
        halts: list[int] = np.flatnonzero(follows_gap | ~self.is_plain).tolist()
        return halts

    def table(self) -> PositionTable:
        """Return the positions that are no repeats."""
        chosen = np.flatnonzero(self.is_first)
        return self._bits.table(chosen, self.received_us[chosen])
