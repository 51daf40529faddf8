r"""When a sentence was heard: the times that receivers and archives wrap around it.

Five habits, none of them part of the AIS message: a tag block (`\s:b2,c:1364272372*57\`, c in
seconds or milliseconds), a Gatehouse `$PGHP` sentence, an ISO date or an epoch before the
sentence, an epoch after its checksum (US Coast Guard) or a date in a remark behind it. Recordings
hold broken ones, such as an epoch in the year 2363, so a time counts only if its checksum is right
and it is plausible.

Source: NMEA 0183 4.10 (tag blocks), dma-ais/AisLib's documentation of `$PGHP`, recordings.
"""

import re
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

EARLIEST = datetime(2000, 1, 1, tzinfo=UTC)  # AIS was not carried before
DISTANT = datetime(2100, 1, 1, tzinfo=UTC)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
FIRST_MILLISECONDS = 100_000_000_000  # as seconds this would be the year 5138

_TAG_BLOCK = re.compile(rb"\\([^\\*]*)\*([0-9A-Fa-f]{2})\\")
_GROUP = re.compile(rb"\d+-\d+-(\d+)")
_ISO = re.compile(
    rb"(\d{4})[-/](\d\d)[-/](\d\d)[T ](\d\d):(\d\d):(\d\d)(?:[.,](\d{1,6})\d*)?"
    rb" ?(?:(Z|UTC)|([+-])(\d\d):?(\d\d))?"
)
_COMPACT = re.compile(
    rb"(?<![\d.:])(20\d\d)(\d\d)(\d\d)[T _-]?(\d\d)(\d\d)(\d\d)(?:[.,](\d{1,6})\d*)?(?!\d)"
    rb"(?:(Z|UTC)|([+-])(\d\d):?(\d\d))?"
)
_EPOCH_BEFORE = re.compile(rb"(?<![\d.:])(\d{13}|\d{10}(?:\.\d{1,9})?)(?![\d.])")
_EPOCH_AFTER = re.compile(rb"[,;|:\s\"]\s*(\d{13}|\d{10}(?:\.\d{1,9})?)(?=[,;|\s\")}\]]|$)")


def xor_checksum(body: bytes) -> int:
    """Return the NMEA checksum: all bytes between the start character and `*`, XORed.

    Folds the bytes as one integer, which is several times faster than a loop over them.
    """
    folded = int.from_bytes(body, "big")
    half_bits = 4 << len(body).bit_length()
    while half_bits >= 8:
        folded ^= folded >> half_bits
        half_bits >>= 1
    return folded & 0xFF


def epoch_us(moment: datetime) -> int:
    """Return a moment as microseconds since 1970 in UTC."""
    return (moment - _EPOCH) // _MICROSECOND


def moment_of(us: int) -> datetime:
    """Return the moment so many microseconds after 1970 began, aware UTC."""
    return _EPOCH + us * _MICROSECOND


class TagBlock(NamedTuple):
    """What the tag blocks before a sentence say of it."""

    time: datetime | None
    source: bytes  # key s, empty if absent
    group: bytes  # id of the sentence group (key g), empty if absent


class PghpLine(NamedTuple):
    """What a `$PGHP` line says of the sentence after it."""

    time: datetime | None
    station: bytes  # country, region and base station


class TimeReader:
    """Reads the times around sentences; `not_after` bounds what is plausible."""

    def __init__(self, not_after: datetime = DISTANT) -> None:
        self.not_after = not_after

    def plausible(self, moment: datetime | None) -> datetime | None:
        """Return the moment if AIS existed then and it is not in the future."""
        return moment if moment is not None and EARLIEST <= moment <= self.not_after else None

    def tag_blocks(self, text: bytes) -> TagBlock | None:
        """Read the tag blocks in a piece of a line; None if there is no valid one."""
        time: datetime | None = None
        source = group = b""
        found = False
        for body, checksum in _TAG_BLOCK.findall(text):
            if xor_checksum(body) != int(checksum, 16):
                continue
            found = True
            for entry in body.split(b","):
                key, _, value = entry.partition(b":")
                if key == b"c":
                    time = self.epoch(value) or time
                elif key == b"s":
                    source = value
                elif key == b"g" and (match := _GROUP.fullmatch(value)):
                    group = match[1]
        return TagBlock(time, source, group) if found else None

    def pghp(self, line: bytes) -> PghpLine | None:
        """Read a `$PGHP` line (UTC); None if its checksum or its fields are wrong."""
        body, _, checksum = line[1:].partition(b"*")
        fields = body.split(b",")
        try:
            if int(checksum[:2], 16) != xor_checksum(body):
                return None
            year, month, day, hour, minute, second, millisecond = map(int, fields[2:9])
            moment = datetime(
                year, month, day, hour, minute, second, millisecond * 1000, tzinfo=UTC
            )
        except (ValueError, OverflowError):
            return None
        return PghpLine(self.plausible(moment), b",".join(fields[9:12]))

    def prefix(self, text: bytes) -> datetime | None:
        """Read an ISO date (UTC unless it says otherwise) or an epoch before a sentence."""
        if match := _ISO.search(text):
            return self.plausible(_of_iso(match))
        for match in _EPOCH_BEFORE.finditer(text):
            if moment := self.epoch(match[1]):
                return moment
        return self._compact(text)

    def suffix(self, text: bytes) -> datetime | None:
        """Read the first plausible epoch among the fields after a sentence's checksum, or a date.

        AIS-catcher writes the latter into its remark: `( MSG: 3, timestamp: 20220729191340)`.
        """
        for match in _EPOCH_AFTER.finditer(text):
            if moment := self.epoch(match[1]):
                return moment
        if date := _ISO.search(text):
            return self.plausible(_of_iso(date))
        return self._compact(text)

    def _compact(self, text: bytes) -> datetime | None:
        match = _COMPACT.search(text)
        return self.plausible(_of_iso(match)) if match else None

    def epoch(self, digits: bytes) -> datetime | None:
        """Read an epoch in seconds, with or without a fraction, or in milliseconds."""
        whole, _, fraction = digits.partition(b".")
        if not whole.isdigit() or len(whole) > 14 or not (fraction.isdigit() or not fraction):
            return None
        count = int(whole)
        if count >= FIRST_MILLISECONDS:
            span = timedelta(milliseconds=count)
        else:
            span = timedelta(seconds=count, microseconds=int(fraction[:6].ljust(6, b"0")))
        return self.plausible(_EPOCH + span)


def _of_iso(match: re.Match[bytes]) -> datetime | None:
    year, month, day, hour, minute, second = (int(match[i]) for i in range(1, 7))
    microsecond = int((match[7] or b"0").ljust(6, b"0"))
    try:
        moment = datetime(year, month, day, hour, minute, second, microsecond, tzinfo=UTC)
        if match[9]:
            offset = timedelta(hours=int(match[10]), minutes=int(match[11]))
            moment += offset if match[9] == b"-" else -offset
    except (ValueError, OverflowError):
        return None
    return moment
