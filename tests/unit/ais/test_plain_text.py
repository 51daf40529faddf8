"""Whatever a text is written in, its lines and letters arrive."""

import io

import pytest

from app.ais.recording import Recording
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, tag_block

TIME = tag_block("c:1714564806")
LINES = [TIME + encoded(POSITION)[0], *(TIME + part for part in encoded(VOYAGE))]


@pytest.mark.parametrize(
    "data",
    [
        "\r".join(LINES).encode(),
        ("\r".join(LINES) + "\r").encode() + bytes(400_000),
        "\r\n".join(LINES).encode("utf-16"),
        "\n".join(LINES).encode("utf-16-be").join([b"\xfe\xff", b""]),
    ],
    ids=["carriage returns", "room set aside", "UTF-16", "big-endian UTF-16"],
)
def test_unusual_texts_are_read(data: bytes) -> None:
    """Lone carriage returns end lines, zeros behind a text are no line, UTF-16 is text."""
    recording = Recording(io.BytesIO(data), max_bytes=1 << 20)
    assert len(list(recording.reports())) == 2
    accounting = recording.accounting
    assert (accounting.lines.sentence, accounting.sentences.assembled) == (3, 3)
    assert (accounting.messages.positions, accounting.messages.statics) == (1, 1)
    assert accounting.balances
