"""Parts of a message into one payload, without ever mixing two messages.

Two or more sentences carry a long message. Parts come in any order, several receivers interleave
theirs, sequence numbers return after ten messages and parts get lost; no checksum covers the
whole. So parts belong together only if source, talker, channel, sequence and count agree and at
most five seconds lie between them. A part without a source of its own (the usual second line
after a `$PGHP`) goes to the youngest message that lacks it. If two different texts claim to be
the same part, nobody can tell which belongs, and all of them are given up.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from app.domain.accounting import SentenceCounts
from app.domain.nmea_lines import Sentence
from app.domain.rejects import Origin

WINDOW = timedelta(seconds=5)
_WINDOW_SENTENCES = 100  # where the input has no times at all
_MOST_OPEN = 4096  # bounds the memory that orphans can take

Key = tuple[bytes, bytes, bytes, int]  # talker, channel, sequence, count: what parts share


@dataclass(slots=True)
class _Open:
    """A message some of whose parts have come."""

    key: Key
    source: bytes
    received_at: datetime | None
    arrival: datetime | None
    sentence_index: int
    parts: dict[int, Sentence] = field(default_factory=dict)
    contradictions: int = 0
    origins: list[Origin] = field(default_factory=list)  # of the parts, where somebody asks


class FragmentAssembler:
    """Joins the parts of multi-sentence messages; counts assembled and orphaned sentences.

    `on_orphan` hears where each orphaned part stood, if it was added with its origin.
    """

    def __init__(
        self, sentences: SentenceCounts, on_orphan: Callable[[Origin], None] | None = None
    ) -> None:
        self._sentences = sentences
        self._on_orphan = on_orphan
        self._index = 0
        self._serial = 0
        self._open: dict[int, _Open] = {}  # by serial number, oldest first
        self._by_key: dict[Key, list[int]] = {}

    def pass_by(self, sentences: int) -> None:
        """Let so many sentences go by that made whole messages, decoded elsewhere."""
        self._index += sentences
        self._sentences.assembled += sentences

    def is_free(self, key: Key) -> bool:
        """Whether parts with this key that follow each other would join, and touch nothing else."""
        return key not in self._by_key and len(self._open) < _MOST_OPEN

    def add(
        self, sentence: Sentence, arrival: datetime | None = None, origin: Origin | None = None
    ) -> tuple[bytes, int, datetime | None] | None:
        """Return payload, fill bits and reception time once a message is complete."""
        self._index += 1
        if sentence.fragment_count == 1:
            self._sentences.assembled += 1
            return sentence.payload, sentence.fill_bits, sentence.received_at
        serial = self._serial_for(sentence, arrival)
        message = self._open[serial]
        if message.contradictions or sentence.fragment_number in message.parts:
            message.contradictions += 1
            if self._on_orphan and origin:  # it cannot become whole any more
                self._on_orphan(origin)
            return None
        message.parts[sentence.fragment_number] = sentence
        if origin:
            message.origins.append(origin)
        message.source = message.source or sentence.source
        message.received_at = message.received_at or sentence.received_at
        if len(message.parts) < sentence.fragment_count:
            return None
        self._close(serial)
        self._sentences.assembled += sentence.fragment_count
        ordered = [message.parts[number] for number in sorted(message.parts)]
        payload = b"".join(part.payload for part in ordered)
        return payload, ordered[-1].fill_bits, _earliest(ordered)

    def expire(self, now: datetime) -> None:
        """Give up live messages whose first part arrived more than five seconds ago."""
        while self._open:
            serial, oldest = next(iter(self._open.items()))
            if oldest.arrival is None or now - oldest.arrival <= WINDOW:
                return
            self._orphan(serial)

    def finish(self) -> None:
        """Give up all that is unfinished: the input has ended."""
        for serial in list(self._open):
            self._orphan(serial)

    def _serial_for(self, sentence: Sentence, arrival: datetime | None) -> int:
        """Find the message the part belongs to, youngest first, or open one."""
        key = (sentence.tag, sentence.channel, sentence.sequence, sentence.fragment_count)
        adopting: int | None = None
        for serial in reversed(tuple(self._by_key.get(key, ()))):
            message = self._open[serial]
            if self._is_stale(message, sentence, arrival):
                self._orphan(serial)
                continue
            present = message.parts.get(sentence.fragment_number)
            if sentence.source == message.source:
                # The same text again is a second copy of the message; another is a contradiction.
                if message.contradictions or present is None or present.payload != sentence.payload:
                    return serial
            elif not (sentence.source and message.source) and present is None and adopting is None:
                adopting = serial
        return self._start(key, sentence, arrival) if adopting is None else adopting

    def _is_stale(self, message: _Open, sentence: Sentence, arrival: datetime | None) -> bool:
        if arrival is not None and message.arrival is not None:
            # Live, one clock times all parts; often only the first has the receiver's time too.
            return arrival - message.arrival > WINDOW
        if message.received_at is not None and sentence.received_at is not None:
            return abs(sentence.received_at - message.received_at) > WINDOW
        return self._index - message.sentence_index > _WINDOW_SENTENCES

    def _start(self, key: Key, sentence: Sentence, arrival: datetime | None) -> int:
        if len(self._open) >= _MOST_OPEN:
            self._orphan(next(iter(self._open)))
        self._serial += 1
        self._open[self._serial] = _Open(
            key, sentence.source, sentence.received_at, arrival, self._index
        )
        self._by_key.setdefault(key, []).append(self._serial)
        return self._serial

    def _orphan(self, serial: int) -> None:
        message = self._close(serial)
        self._sentences.orphaned += len(message.parts) + message.contradictions
        for origin in message.origins:
            if self._on_orphan:
                self._on_orphan(origin)

    def _close(self, serial: int) -> _Open:
        message = self._open.pop(serial)
        siblings = self._by_key[message.key]
        siblings.remove(serial)
        if not siblings:
            del self._by_key[message.key]
        return message


def _earliest(parts: list[Sentence]) -> datetime | None:
    return min((part.received_at for part in parts if part.received_at), default=None)
