"""Lines of a recording into checked NMEA sentences, each with the time that came with it.

Receivers, base stations and archives write the same `!AIVDM` sentence and wrap it in different
times: a tag block before it or on its own line, a `$PGHP` line, an ISO or epoch prefix, an epoch
after the checksum. Libraries lose several of these and accept damaged sentences. So this reader
finds the sentences wherever they stand in a line, several if need be, enforces the checksum, and
gives each the best time it has: tag block, `$PGHP`, prefix, suffix, arrival, in this order.

Source: IEC 61162-1 (sentences), NMEA 0183 4.10 (tag blocks: keys c, s, g), and recordings.
"""

import re
from collections.abc import Iterable, Iterator
from datetime import datetime
from typing import NamedTuple

from app.domain.accounting import LineCounts, SentenceCounts, SentenceReject
from app.domain.nmea_times import PghpLine, TagBlock, TimeReader, xor_checksum

LONGEST_LINE = 4096  # bytes; tag blocks and JSON around a sentence stay far below
_LONGEST_SENTENCE = 200  # bytes; five slots in one sentence, twice what NMEA allows
_MOST_FRAGMENTS = 9
_MOST_GROUPS = 1024

_START = re.compile(rb"![0-9A-Z-]{2}VD[MO],")
_SENTENCE = re.compile(
    rb"!([0-9A-Z-]{2}VD[MO]),(\d\d?),(\d\d?),(\d{0,2}),([0-9A-Z]?),([0-W`-w]*),([0-5])"
    rb"\*([0-9A-Fa-f]{2})"
)
_CHECKSUM = re.compile(rb"\*([0-9A-Fa-f]{2})")


class Sentence(NamedTuple):
    """A checked AIVDM or AIVDO sentence: one part of a message, or all of it."""

    source: bytes  # station that heard it, empty if the input does not say
    tag: bytes  # talker and formatter: AIVDM, BSVDM, ...
    channel: bytes
    sequence: bytes
    fragment_count: int
    fragment_number: int
    payload: bytes
    fill_bits: int
    received_at: datetime | None


def split_lines(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """Split a stream of bytes at line feeds, in bounded memory.

    A line longer than `LONGEST_LINE` is cut one byte after it, by which the reader knows it.
    """
    rest = b""
    skipping = False
    for chunk in chunks:
        *complete, rest = (rest + chunk).split(b"\n")
        for line in complete:
            if not skipping:
                yield line[: LONGEST_LINE + 1]
            skipping = False
        if len(rest) > LONGEST_LINE:
            if not skipping:
                yield rest[: LONGEST_LINE + 1]
            skipping = True
            rest = b""
    if rest and not skipping:
        yield rest


def split_blocks(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """Cut a stream of bytes into blocks of whole lines; the same lines as `split_lines` gives."""
    rest = b""
    skipping = False
    for chunk in chunks:
        text = rest + chunk
        if skipping:
            _, newline, text = text.partition(b"\n")
            skipping = not newline
        end = text.rfind(b"\n") + 1
        if end:
            yield text[:end]
        rest = b"" if skipping else text[end:]
        if len(rest) > LONGEST_LINE:
            yield rest[: LONGEST_LINE + 1] + b"\n"
            skipping, rest = True, b""
    if rest:
        yield rest


class LineReader:
    """Reads lines one by one and hands out their sentences; counts what it saw.

    A time on a line of its own waits for the next sentence. The second part of a message often
    follows without one; the assembler knows the first part's.
    """

    def __init__(self, lines: LineCounts, sentences: SentenceCounts, times: TimeReader) -> None:
        self._lines = lines
        self._sentences = sentences
        self._times = times
        self._tag: TagBlock | None = None
        self._pghp: PghpLine | None = None
        self._groups: dict[bytes, TagBlock] = {}

    @property
    def carries_time(self) -> bool:
        """Whether a time waits for the next sentence."""
        return self._tag is not None or self._pghp is not None

    def read(self, line: bytes, arrival: datetime | None) -> list[Sentence]:
        """Return the line's good sentences; `arrival` is the time of last resort."""
        if len(line) > LONGEST_LINE:
            self._lines.other += 1
            self._forget_times()
            return []
        if b"!" in line:
            starts = [match.start() for match in _START.finditer(line)]
            if starts:
                self._lines.sentence += 1
                return self._sentences_at(line, starts, arrival)
        self._read_other(line.strip())
        return []

    def _read_other(self, line: bytes) -> None:
        """Keep the time of a time-only line; any other sentence uses up the time before it."""
        if line.startswith(b"$PGHP,") and (pghp := self._times.pghp(line)):
            self._pghp = pghp
            self._lines.time_only += 1
        elif line.startswith(b"\\") and (tag := self._times.tag_blocks(line)):
            self._tag = self._with_group(tag)
            self._lines.time_only += 1
        else:
            self._lines.other += 1
            if line[:1] in (b"$", b"!", b"\\"):
                self._forget_times()

    def _forget_times(self) -> None:
        self._tag = self._pghp = None

    def _sentences_at(
        self, line: bytes, starts: list[int], arrival: datetime | None
    ) -> list[Sentence]:
        good = []
        before = line[: starts[0]]
        for start, end in zip(starts, [*starts[1:], len(line)], strict=True):
            self._sentences.total += 1
            match = _SENTENCE.match(line, start, end)
            sentence_end = match.end() if match else end
            after = line[sentence_end:end]
            reject = _fault(line, start, end, match)
            if match is None or reject is not None:
                self._sentences.rejected[reject or SentenceReject.SYNTAX] += 1
            else:
                good.append(self._sentence(match, before, after, arrival))
            self._forget_times()
            before = after
        return good

    def _sentence(
        self, match: re.Match[bytes], before: bytes, after: bytes, arrival: datetime | None
    ) -> Sentence:
        tag, pghp = self._tag, self._pghp
        if before and (inline := self._times.tag_blocks(before)):
            tag = self._with_group(inline)
        time = (tag and tag.time) or (pghp and pghp.time)
        if time is None and before:
            time = self._times.prefix(before)
        if time is None and after:
            time = self._times.suffix(after)
        source = (tag.source if tag else b"") + (pghp.station if pghp else b"")
        name, count, number, sequence, channel, payload, fill_bits, _ = match.groups()
        return Sentence(
            source,
            name,
            channel,
            sequence,
            int(count),
            int(number),
            payload,
            int(fill_bits),
            time or arrival,
        )

    def _with_group(self, tag: TagBlock) -> TagBlock:
        """Give later sentences of a tag block group the source and time of its first one."""
        if not tag.group:
            return tag
        first = self._groups.get(tag.group)
        if first is not None and not tag.source and tag.time is None:
            return first
        if len(self._groups) >= _MOST_GROUPS:
            self._groups.clear()
        self._groups[tag.group] = tag
        return tag


def _fault(
    line: bytes, start: int, end: int, match: re.Match[bytes] | None
) -> SentenceReject | None:
    """Return why the sentence between start and end is no good, checksum before all else."""
    if match is not None:
        star, checksum = match.end() - 3, match[8]
    elif found := _CHECKSUM.search(line, start, end):
        star, checksum = found.start(), found[1]
    else:
        return SentenceReject.CHECKSUM
    if star - start > _LONGEST_SENTENCE:
        return SentenceReject.LENGTH
    if xor_checksum(line[start + 1 : star]) != int(checksum, 16):
        return SentenceReject.CHECKSUM
    return _part_fault(match) if match else SentenceReject.SYNTAX


def _part_fault(match: re.Match[bytes]) -> SentenceReject | None:
    count, number = int(match[2]), int(match[3])
    if not 1 <= number <= count <= _MOST_FRAGMENTS:
        return SentenceReject.FRAGMENT_COUNT
    # Only a last part may end within a six-bit character.
    return SentenceReject.SYNTAX if number < count and match[7] != b"0" else None
