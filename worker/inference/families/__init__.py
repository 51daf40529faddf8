"""Detector families: each knows one kind of network, and is chosen by name or by its signature."""

from collections.abc import Callable
from pathlib import Path

import structlog

from app.detectors.families import AUTO
from app.domain.detection import DetectionSettings
from worker.inference.detector import Detector
from worker.inference.families import detr, end_to_end, yolov3, yolox
from worker.inference.families.detr import QueryDetector
from worker.inference.families.end_to_end import EndToEndDetector
from worker.inference.families.yolov3 import Yolov3Detector
from worker.inference.families.yolox import YoloxDetector
from worker.inference.session import ModelRefusedError, OnnxSession, SessionSettings
from worker.inference.tensors import listed

log = structlog.get_logger()


def _yolox(session: OnnxSession, settings: DetectionSettings, _family: str) -> Detector:
    return YoloxDetector(session, settings)


FAMILIES: dict[str, Callable[[OnnxSession, DetectionSettings, str], Detector]] = {
    yolox.YOLOX: _yolox,
    yolov3.YOLOV3: Yolov3Detector,
    detr.DETR: QueryDetector,
    detr.DEFORMABLE: QueryDetector,
    detr.TWO_STAGE: QueryDetector,
    end_to_end.CASCADE: EndToEndDetector,
}
_EXPECTED = {
    yolox.YOLOX: yolox.EXPECTED,
    yolov3.YOLOV3: yolov3.EXPECTED,
    "DETR and Deformable DETR": detr.EXPECTED,
    end_to_end.CASCADE: end_to_end.EXPECTED,
}


def open_detector(
    path: Path,
    family: str,
    settings: DetectionSettings,
    session_settings: SessionSettings,
) -> Detector:
    """Load a model file as a detector of a family, or of the family that it shows itself.

    Raises:
        ModelRefusedError: an unknown family, a file that does not load, or a model whose inputs
            or outputs do not fit the family.

    """
    if family not in FAMILIES and family != AUTO:
        message = f"there is no detector family {family!r}; there are {', '.join(FAMILIES)}"
        raise ModelRefusedError(message)
    return detector_of(open_session(path, session_settings), family, settings)


def open_session(path: Path, settings: SessionSettings) -> OnnxSession:
    """Load a model file. Raises ModelRefusedError when it does not load."""
    session = OnnxSession(path, settings)
    if session.unused_providers:
        log.warning("providers do not take this model", providers=session.unused_providers)
    return session


def detector_of(session: OnnxSession, family: str, settings: DetectionSettings) -> Detector:
    """Return a loaded model as a detector of a family, or of the one that it shows itself.

    Raises:
        ModelRefusedError: the model's inputs or outputs do not fit the family.

    """
    if family == AUTO:
        family = recognised(session)
    if end_to_end.signature_of(session) is not None:
        return EndToEndDetector(session, settings, family)
    return FAMILIES[family](session, settings, family)


def recognised(session: OnnxSession) -> str:
    """Return the family that a model's inputs and outputs show. Raises ModelRefusedError."""
    queries = detr.signature_of(session)
    if queries is not None:
        return detr.family_of(queries, session.metadata)
    if end_to_end.signature_of(session) is not None:
        return end_to_end.CASCADE
    if yolox.fits(session):
        return yolox.YOLOX
    if yolov3.signature_of(session) is not None:
        return yolov3.YOLOV3
    expected = "; ".join(f"{family}: {text}" for family, text in _EXPECTED.items())
    raise ModelRefusedError(
        f"the model has {listed(session.inputs, 'input')}; {listed(session.outputs, 'output')}. "
        f"That fits no family. Known are {expected}"
    )
