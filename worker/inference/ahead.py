"""Photographs looked at ahead of what is made of their boxes: decoding and detecting side by side.

Decoding takes as long as a small detector, fusing and storing come after both, and each would
leave the machine's other cores idle. Decoder and network leave Python's lock, so they work in
threads of their own while poses are fused and written. One image decoded ahead is enough: the
slowest of the three sets the pace however many wait, and each takes 15 MB.
"""

import threading
from collections.abc import Collection, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from app.domain.detection import Detection
from app.errors import AppError
from app.storage import Storage
from worker.inference.detector import Detector
from worker.inference.image import Photograph, decode_photograph

_DECODED_AT_ONCE = 2


@dataclass(frozen=True, slots=True)
class Unusable:
    """A photograph that cannot be looked at, and why: one bad file among thousands."""

    reason: str


class Looks:
    """What a detector finds in a run's photographs, by their hash, as it comes to be known."""

    def __init__(self) -> None:
        self.is_wanted = True
        self.found: dict[str, Future[list[Detection] | Unusable]] = {}

    def of(self, sha256: str) -> list[Detection] | Unusable:
        """Wait for what was found in a photograph. Raises what the detector raised."""
        return self.found[sha256].result()

    def keep(self, sha256s: Collection[str]) -> None:
        """Forget what was found in all other photographs."""
        self.found = {sha256: future for sha256, future in self.found.items() if sha256 in sha256s}

    def give_up(self) -> None:
        """Look at no more of them: nobody will ask."""
        self.is_wanted = False


class DetectAhead:
    """Looks at stored photographs in two threads of its own, in the order they are asked for."""

    def __init__(self, storage: Storage) -> None:
        self._storage = storage
        # One thread each: the first in line must not wait for room that the next one has taken.
        self._decoder = ThreadPoolExecutor(1, thread_name_prefix="decode")
        self._detector = ThreadPoolExecutor(1, thread_name_prefix="detect")
        self._room = threading.Semaphore(_DECODED_AT_ONCE)

    def begin(self, looks: Looks, detector: Detector, sha256s: Iterable[str]) -> None:
        """Begin to look at those photographs that are not looked at yet; returns at once."""
        for sha256 in sha256s:
            if sha256 not in looks.found:
                decoded = self._decoder.submit(self._decode, looks, detector, sha256)
                looks.found[sha256] = self._detector.submit(self._detect, detector, decoded)

    def _decode(self, looks: Looks, detector: Detector, sha256: str) -> Photograph | Unusable:
        self._room.acquire()  # given back when it is detected
        if not looks.is_wanted:
            return Unusable("not wanted any more")
        try:
            return decode_photograph(self._storage.read(sha256), detector.decoding_divisor)
        except (AppError, ValueError) as error:
            return Unusable(str(error))

    def _detect(
        self, detector: Detector, decoded: Future[Photograph | Unusable]
    ) -> list[Detection] | Unusable:
        try:
            seen = decoded.result()
            if isinstance(seen, Unusable):
                return seen
            return detector.detect(seen.pixels_bgr, (seen.width_px, seen.height_px))
        finally:
            self._room.release()
