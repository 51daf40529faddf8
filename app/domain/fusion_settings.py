"""The numbers of fusion that the paper leaves open, in one frozen, checkable place.

A run stores these beside its poses, so that every pose can be explained and made again.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import isnan

from app.domain.reduced_decoding import DIVISORS
from app.domain.vessel_state import TrackMethod


class Preset(StrEnum):
    """The estimators of fusion."""

    PAPER = "paper"  # the published behaviour, reproduced exactly
    WATERLINE = "waterline"  # all ships of a while on one water surface


# What a run takes when nobody chooses; single labels are fused as published.
PRESET_OF_RUNS = Preset.WATERLINE


class MatchingMethod(StrEnum):
    """The ways to decide which detection shows which vessel."""

    PAPER = "paper"  # the published cost in pixels, cheapest assignment
    LIKELIHOOD = "likelihood"  # ours: how probable, against "no AIS" and "not detected"
    TRACK_VOTES = "track_votes"  # ours, and in series of images all boxes of a track vote
    LU_2021 = "lu_2021"  # Lu et al. 2021: nearest in distance and bearing
    GROUND_PLANE = "ground_plane"  # Carrillo-Perez et al. 2022, Gülsoylu et al. 2024: metres
    HUANG_2021 = "huang_2021"  # Huang et al. 2021: tracks, metres on the water
    QU_2022 = "qu_2022"  # Qu et al. 2022: tracks, when the vessel is at that place


# Each preset's own; a run may choose another.
MATCHING_OF = {Preset.PAPER: MatchingMethod.PAPER, Preset.WATERLINE: MatchingMethod.LIKELIHOOD}


@dataclass(frozen=True, slots=True)
class FusionSettings:
    """Settings of one run of fusion; the defaults are those that reproduce the paper.

    `score_threshold`, `nms_iou`, `class_ids` (COCO: 8 is boat) and `decoding_divisor` choose
    detections; fusion itself applies the first of them, so that imported detections meet the same
    bar. Raises ValueError naming the field that is out of its range.
    """

    preset: Preset = Preset.PAPER
    matching: MatchingMethod = MatchingMethod.PAPER
    score_threshold: float = 0.25
    nms_iou: float = 0.45
    class_ids: tuple[int, ...] = (8,)
    decoding_divisor: int = 1  # photographs may be decoded so much smaller for the detector
    border_tolerance_px: float = 2.0  # a box this near to the border counts as cut by it
    maximum_cost: float = 0.5  # theta; true matches of published images reach 0.23 at score 0.5
    maximum_report_age_s: float = 60.0
    maximum_range_m: float = 3000.0  # from the camera to the antenna
    track_method: TrackMethod | None = None  # to the image's moment; None: heading_dr or hermite
    image_margin: float = 0.5  # of the image's width: candidates may lie this far outside
    # Matching `likelihood` only: what is probable before looking.
    unidentified_per_image: float = 1.0  # detections that show no vessel with AIS
    detected_share: float = 0.8  # of the vessels with AIS in the image
    score_weight: float = 0.0  # how much a detection's score counts: log odds per logit
    score_center: float = 0.0  # the logit of the score that speaks neither for nor against
    series_gap_s: float = 15.0  # images at most so far apart are a series: vessels are followed
    # Preset `waterline` and matching `likelihood`: one sigma of what they estimate beside the
    # vessels, and of box edges.
    level_sigma_m: float = 1.0  # of the water against the given level
    level_window_s: float = 1800.0  # for so long the water counts as standing still
    rotation_sigma_deg: float = 0.05  # of the camera, each axis, beyond what its registration says
    box_sigma_px: float = 1.2  # as is usual: preset `waterline` learns more of the ships

    def __post_init__(self) -> None:
        for name, low, high in (
            ("score_threshold", 0.0, 1.0),
            ("nms_iou", 0.0, 1.0),
            ("border_tolerance_px", 0.0, float("inf")),
            ("maximum_cost", 0.0, float("inf")),
            ("maximum_report_age_s", 0.0, float("inf")),
            ("maximum_range_m", 0.0, float("inf")),
            ("image_margin", 0.0, 10.0),
            ("unidentified_per_image", 1e-6, 1e6),
            ("detected_share", 1e-6, 1 - 1e-6),
            ("score_weight", 0.0, 10.0),
            ("score_center", -10.0, 10.0),
            ("series_gap_s", 0.0, 600.0),
            ("level_sigma_m", 1e-6, float("inf")),
            ("level_window_s", 0.0, float("inf")),
            ("rotation_sigma_deg", 1e-6, 45.0),
            ("box_sigma_px", 1e-3, float("inf")),
        ):
            value = getattr(self, name)
            if isnan(value) or not low <= value <= high:
                raise ValueError(f"{name} must lie between {low:g} and {high:g}, got {value}")
        if not self.class_ids:
            raise ValueError("class_ids must name at least one class of the detector")
        if self.decoding_divisor not in DIVISORS:
            raise ValueError(
                f"decoding_divisor must be one of {DIVISORS}, got {self.decoding_divisor}"
            )
