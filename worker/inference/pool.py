"""Models kept loaded between batches: opening one takes longer than using it many times."""

import os
import tempfile
from pathlib import Path

from app.config import Settings
from app.detectors.service import IMPORTED_FAMILY, IMPORTED_SETTINGS_SHA256
from app.domain.arrays import UInt8Array
from app.domain.detection import Detection, DetectionSettings
from app.domain.fusion_settings import FusionSettings
from app.errors import NotFound
from app.storage import Storage
from app.tables.detection import Model
from worker.inference.detector import Detector
from worker.inference.families import detector_of, open_session
from worker.inference.session import OnnxSession, SessionSettings

MOST_LOADED = 2
SMALL_MODEL_BYTES = 10_000_000


class ImportedDetections:
    """Boxes that came from elsewhere: what was not imported for an image is not there."""

    settings_sha256 = IMPORTED_SETTINGS_SHA256
    signature: dict[str, object] = {}  # noqa: RUF012  never changed

    def decoding_divisor(self, image_px: tuple[int, int]) -> int:  # noqa: ARG002  a Detector
        """Return 1: nothing is decoded."""
        return 1

    def detect(
        self,
        image_bgr: UInt8Array,  # noqa: ARG002  a Detector
        image_px: tuple[int, int] | None = None,  # noqa: ARG002  a Detector
    ) -> list[Detection]:
        """Return nothing: all boxes there are stand in the database already."""
        return []


def threads_for(size_bytes: int) -> int:
    """Return how many threads a model is run with when nobody says: a small one leaves a core.

    Decoding takes as long as a network of this size and runs beside it, so the last core's thread
    would only wait for its turn (measured on two cores: a tenth of the CPU time of a run).
    """
    cores = os.cpu_count() or 1
    return max(1, cores - 1) if size_bytes < SMALL_MODEL_BYTES else cores


class DetectorPool:
    """The last few models, whatever they are asked to find."""

    def __init__(self, storage: Storage, settings: Settings) -> None:
        self._storage = storage
        self._threads = settings.detector_threads
        self._providers = tuple(settings.detector_providers)
        self._loaded: dict[str, OnnxSession] = {}

    @staticmethod
    def settings_sha256(model: Model, settings: FusionSettings) -> str:
        """Return the key of what a model's boxes depend on beside it, without opening it."""
        if model.family == IMPORTED_FAMILY:
            return IMPORTED_SETTINGS_SHA256
        return _of_detection(settings).sha256

    def get(self, model: Model, settings: FusionSettings) -> Detector:
        """Return a model's detector.

        Raises NotFound when its file is gone, ModelRefusedError when it cannot be loaded.
        """
        if model.family == IMPORTED_FAMILY:
            return ImportedDetections()
        if model.sha256 not in self._loaded:
            while len(self._loaded) >= MOST_LOADED:
                self._loaded.pop(next(iter(self._loaded)))
            self._loaded[model.sha256] = self._open(model)
        return detector_of(self._loaded[model.sha256], model.family, _of_detection(settings))

    def _open(self, model: Model) -> OnnxSession:
        session_settings = SessionSettings(
            threads=self._threads or threads_for(model.size_bytes), providers=self._providers
        )
        if not self._storage.exists(model.sha256):
            raise NotFound(
                f"the file of the detector {model.name!r} is gone from the store; add it again"
            )
        path = self._storage.local_path(model.sha256)
        if path is not None:
            return open_session(path, session_settings)
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / "model.onnx"
            copy.write_bytes(self._storage.read(model.sha256))
            return open_session(copy, session_settings)


def _of_detection(settings: FusionSettings) -> DetectionSettings:
    return DetectionSettings(
        score_threshold=settings.score_threshold,
        nms_iou=settings.nms_iou,
        class_ids=settings.class_ids,
        decoding_divisor=settings.decoding_divisor,
    )
