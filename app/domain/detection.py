"""Vessel detections: axis-aligned boxes in full-image pixels with a score and a class."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Detection:
    """A detector's box: corners (x1, y1) top-left and (x2, y2) bottom-right, px, with its score."""

    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    score: float
    class_id: int = 8
