"""Detector families: each knows one kind of network, and is chosen by its name."""

from collections.abc import Callable
from pathlib import Path

from app.domain.detection import DetectionSettings
from worker.inference.detector import Detector
from worker.inference.families.yolox import YoloxDetector
from worker.inference.session import ModelRefusedError, OnnxSession, SessionSettings

FAMILIES: dict[str, Callable[[OnnxSession, DetectionSettings], Detector]] = {
    "yolox": YoloxDetector,
}


def open_detector(
    path: Path,
    family: str,
    settings: DetectionSettings,
    session_settings: SessionSettings,
) -> Detector:
    """Load a model file as a detector of a family.

    Raises:
        ModelRefusedError: an unknown family, a file that does not load, or a model whose inputs
            or outputs do not fit the family.

    """
    if family not in FAMILIES:
        message = f"there is no detector family {family!r}; there are {', '.join(FAMILIES)}"
        raise ModelRefusedError(message)
    return FAMILIES[family](OnnxSession(path, session_settings), settings)
