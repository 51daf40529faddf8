"""NMEA text into AIS reports: lines, parts, payloads and repeats, with a full accounting.

The decoder is fed line by line and holds only what a few seconds of input need, so a year's
recording and a live feed go through the same code. Nothing is lost in silence: see `accounting`.
One decoder serves one input, because parts and repeats are told apart within it.
"""

from collections.abc import Iterable, Iterator
from datetime import datetime

from app.domain.accounting import Accounting
from app.domain.ais import PositionReport, StaticReport
from app.domain.ais_payload import RejectedMessageError, Reports, decode_payload
from app.domain.nmea_assembly import FragmentAssembler, Key
from app.domain.nmea_lines import LineReader
from app.domain.nmea_times import DISTANT, TimeReader
from app.domain.rejects import RejectLog
from app.domain.repeats import RepeatFilter


class NmeaDecoder:
    """Decodes lines one after another and keeps their accounting.

    `not_after` bounds plausible times: pass the present moment, with an allowance for clocks,
    to refuse recordings from the future. `rejects` hears of each line that was not taken.
    """

    def __init__(self, not_after: datetime = DISTANT, rejects: RejectLog | None = None) -> None:
        self._rejects = rejects
        self.accounting = Accounting() if rejects is None else rejects.accounting()
        sentences = self.accounting.sentences
        self._times = TimeReader(not_after)
        self._reader = LineReader(self.accounting.lines, sentences, self._times)
        on_orphan = None if rejects is None else rejects.orphaned
        self._assembler = FragmentAssembler(sentences, on_orphan)
        self.repeats = RepeatFilter()

    def refuse_after(self, moment: datetime) -> None:
        """Move the bound of plausible times: live input goes on for months."""
        self._times.not_after = moment

    def feed(self, line: bytes | str, arrival: datetime | None = None) -> Reports:
        """Decode one line (with or without its line end).

        Args:
            line: NMEA text as it stands in a file or comes from a feed.
            arrival: for live input, when it came (aware UTC). Old recordings have none: their
                sentences without a time of their own are rejected, as nobody can date them.

        Returns:
            The reports of the messages that this line completes, none to a few.

        """
        raw = line.encode("utf-8", "replace") if isinstance(line, str) else line
        origin = None if self._rejects is None else self._rejects.at(raw)
        if arrival is not None:
            self._assembler.expire(arrival)
        reports: Reports = ()
        for sentence in self._reader.read(raw, arrival):
            message = self._assembler.add(sentence, arrival, origin)
            if message is not None:
                reports += self._decode(*message)
        return reports

    @property
    def not_after(self) -> datetime:
        """The bound of plausible times."""
        return self._times.not_after

    @property
    def tells_rejects(self) -> bool:
        """Whether somebody hears of each line that is not taken."""
        return self._rejects is not None

    @property
    def carries_time(self) -> bool:
        """Whether a time waits for the next sentence."""
        return self._reader.carries_time

    def pass_by(self, sentences: int) -> None:
        """Let so many sentences go by that made whole messages, decoded elsewhere."""
        self._assembler.pass_by(sentences)

    def may_join(self, key: Key) -> bool:
        """Whether the parts of a message that follow each other may be joined elsewhere."""
        return self._assembler.is_free(key)

    def finish(self) -> Accounting:
        """End the input: what is unfinished becomes orphaned. Return the accounting."""
        self._assembler.finish()
        return self.accounting

    def _decode(self, payload: bytes, fill_bits: int, received_at: datetime | None) -> Reports:
        messages = self.accounting.messages
        messages.assembled += 1
        try:
            reports = decode_payload(payload, fill_bits, received_at)
        except RejectedMessageError as rejected:
            messages.rejected[rejected.reason] += 1
            return ()
        if reports is None:
            messages.ignored_type += 1
        elif self.repeats.is_repeat(payload, reports[0].received_at):
            messages.duplicates += 1
        else:
            if isinstance(reports[0], PositionReport):
                messages.positions += 1
            else:
                messages.statics += 1
            return reports
        return ()


def decode_lines(
    lines: Iterable[bytes | str], decoder: NmeaDecoder
) -> Iterator[PositionReport | StaticReport]:
    """Yield the reports of a whole recording; the accounting is the decoder's."""
    for line in lines:
        yield from decoder.feed(line)
    decoder.finish()
