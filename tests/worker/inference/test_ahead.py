"""Decoding one image ahead of the detector."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.errors import NotFound
from app.storage import Storage
from tests.factories.imagery import photograph
from worker.inference.ahead import DecodeAhead
from worker.inference.image import decode_image


@pytest.fixture
def storage(tmp_path: Path) -> Storage:
    """Give a file store."""
    return Storage(str(tmp_path / "files"))


def test_pixels_come_in_order(storage: Storage) -> None:
    """Each photograph's own pixels come in its turn."""
    files = [photograph(seed) for seed in range(5)]
    hashes = [storage.put(data).sha256 for data in files]
    for future, data in zip(DecodeAhead(storage).pixels_of(hashes), files, strict=True):
        np.testing.assert_array_equal(future.result(), decode_image(data))


def test_a_bad_file_is_an_error_in_its_turn_only(storage: Storage) -> None:
    """What is damaged or gone raises when it is asked for; the others are not touched by it."""
    good = storage.put(photograph()).sha256
    damaged = storage.put(b"no photograph").sha256
    first, second, third, fourth = DecodeAhead(storage).pixels_of([damaged, good, "0" * 64, good])
    with pytest.raises(ValueError, match="cannot be decoded"):
        first.result()
    with pytest.raises(NotFound):
        third.result()
    assert second.result().shape == fourth.result().shape == (48, 64, 3)


def test_one_is_decoded_ahead_and_no_more(storage: Storage) -> None:
    """However many images a run has, two of them are in memory."""
    sha256 = storage.put(photograph()).sha256
    asked: list[int] = []

    def hashes() -> Iterator[str]:
        for number in range(5):
            asked.append(number)
            yield sha256

    pixels = DecodeAhead(storage).pixels_of(hashes())
    for turn in range(4):
        next(pixels).result()
        assert len(asked) == turn + 2
    assert list(DecodeAhead(storage).pixels_of([])) == []
