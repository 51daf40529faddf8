"""Vessel detections: axis-aligned boxes in full-image pixels with a score and a class.

Boxes are what YOLOX and COCO mean by them: they bound the vessel's pixels, from the left edge of
the leftmost to the right edge of the rightmost, counted from the image's edge. The paper feeds
these numbers to geometry as they are, and so do we: half a pixel is centimetres at 300 m.
"""

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property
from math import isnan

from app.domain.reduced_decoding import DIVISORS

COCO_BOAT = 8
# Boxes count from the image's edge, geometry from the centre of its first pixel.
HALF_PIXEL = 0.5
NOBODYS_SCORE = -1.0


@dataclass(frozen=True, slots=True)
class Detection:
    """A detector's box: corners (x1, y1) top-left and (x2, y2) bottom-right, px, with its score."""

    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    score: float
    class_id: int = COCO_BOAT

    @property
    def has_area(self) -> bool:
        """Whether it has a width and a height."""
        return self.x1_px < self.x2_px and self.y1_px < self.y2_px

    @property
    def edges_px(self) -> tuple[float, float, float, float]:
        """Left, upper, right and lower edge."""
        return self.x1_px, self.y1_px, self.x2_px, self.y2_px


def passed_over(detection: Detection) -> Detection:
    """Return a box without area as one that no threshold lets through, in the same place of a list.

    Such boxes come with the files of other detectors: false detections, which match no vessel.
    """
    return replace(
        detection, x2_px=detection.x1_px + 1.0, y2_px=detection.y1_px + 1.0, score=NOBODYS_SCORE
    )


@dataclass(frozen=True)
class DetectionSettings:
    """What, beside image and model, the boxes depend on.

    `class_ids` are the detector's classes that count as vessels (COCO: 8 is boat);
    `decoding_divisor` says by how much photographs may be decoded smaller. Detections are stored
    under `sha256` and reused by every run with the same settings. Raises ValueError naming the
    field that is out of its range.
    """

    score_threshold: float = 0.25
    nms_iou: float = 0.45
    class_ids: tuple[int, ...] = (COCO_BOAT,)
    decoding_divisor: int = 1

    def __post_init__(self) -> None:
        for name in ("score_threshold", "nms_iou"):
            value = getattr(self, name)
            if isnan(value) or not 0 <= value <= 1:
                raise ValueError(f"{name} must lie between 0 and 1, got {value}")
        if not self.class_ids or min(self.class_ids) < 0:
            raise ValueError(f"class_ids must name classes from 0 on, got {self.class_ids}")
        if self.decoding_divisor not in DIVISORS:
            raise ValueError(
                f"decoding_divisor must be one of {DIVISORS}, got {self.decoding_divisor}"
            )

    @cached_property
    def canonical_json(self) -> str:
        """The settings as one line that is the same for equal settings on every machine."""
        values: dict[str, object] = {
            "class_ids": sorted(set(self.class_ids)),
            "nms_iou": float(self.nms_iou),
            "score_threshold": float(self.score_threshold),
        }
        if self.decoding_divisor != 1:  # else the key stays that of boxes found in all years
            values["decoding_divisor"] = self.decoding_divisor
        return json.dumps(values, sort_keys=True, separators=(",", ":"))

    @cached_property
    def sha256(self) -> str:
        """The key of these settings: hexadecimal SHA-256 of the canonical JSON."""
        return hashlib.sha256(self.canonical_json.encode()).hexdigest()
