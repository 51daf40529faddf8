"""Bytes that claim to be photographs."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import Invalid, TooLarge, UnsupportedMedia
from app.imagery.names import content_disposition, tidy
from app.imagery.photo import check_decodes, inspect
from tests.factories.imagery import photograph

JPEG = photograph(taken="2026:01:02 03:04:05", offset="+01:00")
PNG = photograph(kind="PNG", taken="2026:01:02 03:04:05")
WEBP = photograph(kind="WEBP", taken="2026:01:02 03:04:05")


@pytest.mark.parametrize("data", [JPEG, PNG, WEBP], ids=["jpeg", "png", "webp"])
def test_a_header_tells_size_and_moment(data: bytes) -> None:
    """All three formats give their size and the moment of their EXIF."""
    photo = inspect(data, 10_000)
    assert (photo.width_px, photo.height_px) == (64, 48)
    assert photo.exif_taken_at is not None
    assert photo.exif_taken_at.hour == 3
    check_decodes(data, photo)


@given(
    st.sampled_from([JPEG, PNG, WEBP]),
    st.lists(st.tuples(st.integers(0, 5000), st.binary(min_size=1, max_size=8)), max_size=6),
    st.integers(0, 6000),
)
def test_damaged_bytes_are_refused_or_harmless(
    data: bytes, damages: list[tuple[int, bytes]], length: int
) -> None:
    """However a file is damaged or cut, it is taken or refused with an answer for the user."""
    damaged = bytearray(data)
    for place, change in damages:
        damaged[place : place + len(change)] = change
    cut = bytes(damaged[:length] if length < 5500 else damaged)
    with suppress(Invalid, TooLarge, UnsupportedMedia):
        check_decodes(cut, inspect(cut, 10_000))


def test_padding_of_cheap_cameras_is_no_damage() -> None:
    """Bytes between a JPEG's pixels and its end marker lose no pixel, so the file is taken."""
    padded = JPEG[:-2] + b"\0" * 9 + JPEG[-2:]
    check_decodes(padded, inspect(padded, 10_000))
    with pytest.raises(Invalid, match="cut off"):
        check_decodes(JPEG[:-40], inspect(JPEG, 10_000))


@given(st.text(max_size=400))
def test_any_name_becomes_a_harmless_one(name: str) -> None:
    """A tidied name has no folder, no control character and sane length; its header is ASCII."""
    tidied = tidy(name, "image/jpeg")
    assert 1 <= len(tidied) <= 200
    assert not set(tidied) & set("/\\\r\n\0")
    header = content_disposition(tidied)
    assert header.isascii()
    assert header.isprintable()
    assert tidy(tidied, "image/jpeg") == tidied
