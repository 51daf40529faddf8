"""What others have published, to be printed beside our own figures with what they are shares of."""

from collections.abc import Mapping
from dataclasses import dataclass

from app.domain.matching_table import TOTAL, Result, RowName


@dataclass(frozen=True, slots=True)
class PublishedRow:
    """A line of the paper's table as printed."""

    count: int
    percent_of_visible: float
    percent_of_annotations: float | None = None


@dataclass(frozen=True, slots=True)
class RelatedSystem:
    """Another system's percentage, and what is known of the whole it is a part of."""

    name: str
    percent: float
    remark: str


PAPER_SOURCE = (
    "BONK-pose paper, table of association results: 581 vessels in a random sample of 500 images"
)
PAPER_VISIBLE, PAPER_ANNOTATIONS = 581, 434
PAPER_ROWS: Mapping[RowName, PublishedRow] = {
    RowName(Result.CORRECT, "good"): PublishedRow(375, 64.54, 86.41),
    RowName(Result.CORRECT, "ok"): PublishedRow(33, 5.68, 7.60),
    RowName(Result.CORRECT, "bad"): PublishedRow(2, 0.34, 0.46),
    RowName(Result.CORRECT, TOTAL): PublishedRow(410, 70.56, 94.47),
    RowName(Result.WRONG, "missing_ais"): PublishedRow(9, 1.55, 2.07),
    RowName(Result.WRONG, "false_positive"): PublishedRow(2, 0.34, 0.46),
    RowName(Result.WRONG, "cost_function"): PublishedRow(9, 1.55, 2.07),
    RowName(Result.WRONG, "subvessel"): PublishedRow(4, 0.69, 0.92),
    RowName(Result.WRONG, TOTAL): PublishedRow(24, 4.13, 5.52),
    RowName(Result.NO_MATCH, "not_detected"): PublishedRow(3, 0.52),
    RowName(Result.NO_MATCH, "no_ais"): PublishedRow(139, 23.92),
    RowName(Result.NO_MATCH, "neither"): PublishedRow(2, 0.34),
    RowName(Result.NO_MATCH, "cost_too_high"): PublishedRow(3, 0.52),
    RowName(Result.NO_MATCH, TOTAL): PublishedRow(147, 25.30),
}
_NOT_SAID = "the paper that cites it does not say of what; not comparable row by row."
RELATED: tuple[RelatedSystem, ...] = (
    RelatedSystem(
        "Lu et al. 2021",
        75.70,
        "Accuracy with dead reckoning; their association counts pairs of an AIS message and a "
        "vessel, so a vessel without AIS is in no denominator.",
    ),
    RelatedSystem("Huang et al. 2021", 74.3, f"Accuracy on average; {_NOT_SAID}"),
    RelatedSystem("Qu et al. 2022", 81.42, f"Overall accuracy; {_NOT_SAID}"),
    RelatedSystem("Gülsoylu et al. 2024", 74.76, f"Accuracy on average; {_NOT_SAID}"),
)


@dataclass(frozen=True, slots=True)
class PublishedDetector:
    """A detector of the paper's table: AP at 0.5 to 0.95, AP at 0.5, AR at 100; both class sets."""

    name: str
    moving: tuple[float, float, float]
    all_classes: tuple[float, float, float]


DETECTOR_SOURCE = (
    "BONK-pose paper, table of detectors: 1,000 images of 2560 x 1920 px, detectors trained on "
    "COCO as published, its class boat against all boxes of the class set"
)
DETECTORS: tuple[PublishedDetector, ...] = (
    PublishedDetector("YOLOX-X", (0.626, 0.805, 0.756), (0.398, 0.588, 0.514)),
    PublishedDetector("YOLOX-L", (0.603, 0.794, 0.746), (0.363, 0.550, 0.473)),
    PublishedDetector("YOLOX-S", (0.542, 0.764, 0.698), (0.277, 0.457, 0.429)),
    PublishedDetector("YOLOv3", (0.379, 0.659, 0.549), (0.232, 0.476, 0.332)),
    PublishedDetector("DETR", (0.451, 0.696, 0.645), (0.278, 0.513, 0.398)),
    PublishedDetector("Deformable DETR", (0.510, 0.737, 0.703), (0.337, 0.562, 0.447)),
    PublishedDetector("Deformable DETR, two-stage", (0.585, 0.775, 0.761), (0.372, 0.571, 0.531)),
    PublishedDetector("Cascade R-CNN r50", (0.511, 0.725, 0.680), (0.309, 0.527, 0.427)),
)
