"""Detecting ahead of what is made of the boxes."""

import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from app.domain.arrays import UInt8Array
from app.domain.detection import Detection
from app.storage import Storage
from tests.factories.imagery import photograph
from worker.inference.ahead import DetectAhead, Looks, Unusable


class Measuring:
    """A detector that says how large a photograph is, when it is let."""

    settings_sha256 = ""
    signature: dict[str, object] = {}  # noqa: RUF012  never changed

    def __init__(self) -> None:
        self.may_go_on = threading.Event()
        self.may_go_on.set()
        self.asked = 0

    def decoding_divisor(self, image_px: tuple[int, int]) -> int:
        """Count what is decoded."""
        self.asked += 1
        return 2 if image_px[0] % 2 == 0 else 1

    def detect(
        self, image_bgr: UInt8Array, image_px: tuple[int, int] | None = None
    ) -> list[Detection]:
        """Return the reduced and the whole size as a box."""
        assert self.may_go_on.wait(30)
        assert image_px is not None
        return [Detection(image_bgr.shape[1], image_bgr.shape[0], *image_px, 1.0)]


@pytest.fixture
def storage(tmp_path: Path) -> Storage:
    """Give a file store."""
    return Storage(str(tmp_path / "files"))


def stored(storage: Storage, count: int) -> Sequence[str]:
    """Store photographs of 64 x 48 px."""
    return [storage.put(photograph(seed)).sha256 for seed in range(count)]


def test_each_photograph_has_its_own_boxes_and_a_bad_one_its_reason(storage: Storage) -> None:
    """Decoded at half its size, told of the whole; damaged and lost files spoil only themselves."""
    good = stored(storage, 3)
    damaged = storage.put(b"\xff\xd8 no photograph").sha256
    looks = Looks()
    DetectAhead(storage).begin(looks, Measuring(), [damaged, good[0], "0" * 64, *good])
    for sha256 in good:
        assert looks.of(sha256) == [Detection(32, 24, 64, 48, 1.0)]
    for sha256, reason in ((damaged, "cannot be decoded"), ("0" * 64, "gone from the store")):
        unusable = looks.of(sha256)
        assert isinstance(unusable, Unusable)
        assert reason in unusable.reason


def test_two_are_decoded_at_once_and_none_that_nobody_wants(storage: Storage) -> None:
    """However many wait, two are in memory; after a run was cancelled the rest is left alone."""
    detector, looks, ahead = Measuring(), Looks(), DetectAhead(storage)
    detector.may_go_on.clear()
    sha256s = stored(storage, 6)
    ahead.begin(looks, detector, sha256s)
    looks.give_up()
    detector.may_go_on.set()
    assert isinstance(looks.of(sha256s[-1]), Unusable)
    assert detector.asked <= 2
    later = Looks()
    ahead.begin(later, detector, sha256s)
    assert later.of(sha256s[-1]) == [Detection(32, 24, 64, 48, 1.0)]


def test_nothing_is_looked_at_twice(storage: Storage) -> None:
    """What was begun with the batch before is not begun again, and what has passed is forgotten."""
    detector, looks, ahead = Measuring(), Looks(), DetectAhead(storage)
    sha256s = stored(storage, 4)
    ahead.begin(looks, detector, sha256s[:3])
    looks.keep(sha256s[1:])
    ahead.begin(looks, detector, sha256s[1:])
    assert [looks.of(sha256) for sha256 in sha256s[1:]]
    assert detector.asked == 4
    assert list(looks.found) == sha256s[1:]
