"""A recording played as if it came live: what it says is the same."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

from app.domain.nmea import NmeaDecoder

PLAYED_AT = datetime(2026, 11, 22, 10, tzinfo=UTC)


def test_a_receiver_whose_clock_is_off_loses_no_message(shared_dir: Path) -> None:
    """Parts find together by their arrival, where only the first has the receiver's own time."""
    recording = shared_dir / "real/ais/dma_aislib_stream_29s_pghp.txt"
    stored, live = NmeaDecoder(), NmeaDecoder()
    for number, line in enumerate(recording.read_bytes().splitlines()):
        stored.feed(line)
        live.feed(line, PLAYED_AT + timedelta(milliseconds=10 * number))
    assert live.finish().messages == stored.finish().messages
    assert live.accounting.sentences.orphaned == 0
    assert live.accounting.messages.statics == 490
