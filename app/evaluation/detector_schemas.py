"""The detector table in REST and as CSV, the paper's own beside ours."""

from collections.abc import Sequence

from pydantic import BaseModel, Field

from app.domain.average_precision import Precision, Size
from app.domain.average_precision_interval import PrecisionIntervals
from app.evaluation.decoding import LARGEST_CHANGE, LEAST_BOXES, DecodingChange
from app.evaluation.detector_figures import SetFigures
from app.evaluation.detectors import DetectorFigures, DetectorTable
from app.evaluation.published import DETECTOR_SOURCE, DETECTORS
from app.evaluation.schemas import Interval
from app.tables.groundtruth import VesselClass

COUNTING = (
    (
        "A box that people drew is found by a detection whatever its class: detectors know one "
        "class for vessels (COCO's boat, class 8 here), the boxes' classes say which are asked for."
    ),
    (
        "Moving vessels are ship, ship_leaving_frame and subvessel, those that send AIS. In "
        "“moving” boxes of the other classes are not there, as if nobody had drawn them: a "
        "detection of a moored ship is wrong. In “moving_others_ignored” it is neither right nor "
        "wrong. “all” asks for all five classes."
    ),
    "Only images count whose boxes a person called complete and that the detector has looked at.",
    (
        "As in pycocotools: the 100 most certain detections of an image, IoU 0.50 to 0.95, 101 "
        "levels of recall; a box's area in the file says its size (small below 32², large above "
        "96² px²); a crowd is ignored."
    ),
    (
        "pycocotools never finds a box whose id is 0, and neither do these figures; “renumbered” "
        "says what they were if ids began at 1."
    ),
    "A class alone: only its boxes are asked for, a detection on another vessel's box is ignored.",
    (
        "Photographs decoded smaller: the change of AP against the same settings on whole ones. "
        f"Where it is at most {LARGEST_CHANGE} in every class set, on {LEAST_BOXES} boxes or more, "
        "new runs of the site with these settings decode smaller by themselves."
    ),
    "Intervals: 95 %, the images drawn anew 100 times with a fixed seed.",
)


class PrecisionOut(BaseModel):
    """COCO's figures, fractions of one; null where no box is asked for."""

    map_50_95: float | None
    map_50: float | None
    map_75: float | None
    ar_100: float | None
    boxes: int = Field(description="How many boxes were to be found")

    @classmethod
    def of(cls, one: Precision) -> "PrecisionOut":
        """Take the figures."""
        return cls(
            map_50_95=one.ap, map_50=one.ap50, map_75=one.ap75, ar_100=one.ar100, boxes=one.boxes
        )


class IntervalsOut(BaseModel):
    """95 % intervals."""

    map_50_95: Interval
    map_50: Interval
    ar_100: Interval

    @classmethod
    def of(cls, one: PrecisionIntervals) -> "IntervalsOut":
        """Take the ends."""
        return cls(map_50_95=one.ap, map_50=one.ap50, ar_100=one.ar100)


class ClassSetOut(PrecisionOut):
    """A detector's figures for a set of classes, over all sizes and by size."""

    class_set: str
    classes: list[VesselClass]
    other_classes: str = Field(description="absent, or ignored")
    intervals: IntervalsOut | None
    by_size: dict[str, PrecisionOut]
    renumbered: PrecisionOut | None = Field(
        description="If ids began at 1; null where no box has the id 0"
    )
    curve: dict[str, list[float]] = Field(
        description="Precision at recall 0, 0.01, ... 1, by IoU threshold"
    )

    @classmethod
    def of_set(cls, one: SetFigures) -> "ClassSetOut":
        """Take the figures."""
        return cls(
            **PrecisionOut.of(one.by_size[Size.ALL]).model_dump(),
            class_set=one.class_set.name,
            classes=list(one.class_set.classes),
            other_classes="ignored" if one.class_set.ignores_others else "absent",
            intervals=IntervalsOut.of(one.intervals) if one.intervals else None,
            by_size={
                size.value: PrecisionOut.of(figures)
                for size, figures in one.by_size.items()
                if size is not Size.ALL
            },
            renumbered=PrecisionOut.of(one.renumbered) if one.renumbered else None,
            curve={name: list(values) for name, values in one.curve.items()},
        )


class DecodingChangeOut(BaseModel):
    """What it does to AP that photographs are decoded smaller."""

    images: int
    boxes: int
    map_50_95: dict[str, float] = Field(description="Its change, by class set")
    is_harmless: bool = Field(description="New runs with these settings decode smaller")

    @classmethod
    def of(cls, one: DecodingChange) -> "DecodingChangeOut":
        """Take the changes."""
        return cls(
            images=one.images,
            boxes=one.boxes,
            map_50_95=dict(one.ap),
            is_harmless=one.is_harmless,
        )


class DetectorOut(BaseModel):
    """A detector with one setting, and how it did."""

    model_id: int
    name: str
    label: str = Field(description="The name, and what tells it from others of the same name")
    family: str
    score_threshold: float | None = Field(description="Null: it came with its boxes")
    nms_iou: float | None
    decoding_divisor: int = Field(description="1: whole photographs")
    decoding_change: DecodingChangeOut | None = Field(
        description="Null where photographs are whole, or were never tried whole"
    )
    images: int = Field(description="Complete images that it was judged on")
    images_without_detections: int = Field(
        description="Of those, images that an imported file does not speak of; taken as empty"
    )
    images_not_looked_at: int
    detections: int
    class_sets: list[ClassSetOut]
    by_class: dict[VesselClass, PrecisionOut] = Field(
        description="Each class alone: boxes of the others are ignored"
    )

    @classmethod
    def of(cls, one: DetectorFigures, others: Sequence[DetectorFigures]) -> "DetectorOut":
        """Take the figures; `others` are all detectors of the table."""
        return cls(
            model_id=one.model.id,
            name=one.model.name,
            label=_label(one, [other for other in others if other.model is one.model]),
            family=one.model.family,
            score_threshold=one.settings.score_threshold if one.settings else None,
            nms_iou=one.settings.nms_iou if one.settings else None,
            decoding_divisor=one.settings.decoding_divisor if one.settings else 1,
            decoding_change=DecodingChangeOut.of(one.decoding) if one.decoding else None,
            images=one.images,
            images_without_detections=one.empty,
            images_not_looked_at=one.unseen,
            detections=one.figures.detections,
            class_sets=[ClassSetOut.of_set(figures) for figures in one.figures.sets],
            by_class={name: PrecisionOut.of(alone) for name, alone in one.figures.by_class.items()},
        )


def _label(one: DetectorFigures, alike: Sequence[DetectorFigures]) -> str:
    """Return a model's name with those of its settings that tell it from others of its rows."""
    words = [one.model.name]
    mine, settings = one.settings, [other.settings for other in alike]
    for name, text in (
        ("score_threshold", "scores from {}"),
        ("nms_iou", "overlap up to {}"),
        ("class_ids", "classes {}"),
        ("decoding_divisor", "decoded at 1/{}"),
    ):
        if mine is not None and len({getattr(other, name, None) for other in settings}) > 1:
            words.append(text.format(getattr(mine, name)))
    return ", ".join(words).replace("decoded at 1/1", "whole photographs")


class PublishedDetectorOut(BaseModel):
    """A detector of the paper's table."""

    name: str
    moving: tuple[float, float, float] = Field(description="mAP@.5:.95, mAP@.5, AR@100")
    all: tuple[float, float, float] = Field(description="mAP@.5:.95, mAP@.5, AR@100")


class DetectorTableOut(BaseModel):
    """The paper's detector table from the boxes that people drew here."""

    images: int = Field(description="With ground truth, complete or not")
    images_complete: int
    boxes_by_class: dict[VesselClass, int] = Field(description="In the complete images")
    detectors: list[DetectorOut]
    counting: list[str]
    paper: list[PublishedDetectorOut]
    paper_source: str


def detectors_out(table: DetectorTable) -> DetectorTableOut:
    """Write the table out."""
    return DetectorTableOut(
        images=table.images,
        images_complete=table.images_complete,
        boxes_by_class=dict(table.boxes),
        detectors=[DetectorOut.of(one, table.detectors) for one in table.detectors],
        counting=list(COUNTING),
        paper=[
            PublishedDetectorOut(name=one.name, moving=one.moving, all=one.all_classes)
            for one in DETECTORS
        ],
        paper_source=DETECTOR_SOURCE,
    )


_FIGURES = ("map_50_95", "map_50", "ar_100")
CSV_COLUMNS = (
    "detector",
    "score_threshold",
    "decoding_divisor",
    "class_set",
    "size",
    "images",
    "boxes",
    "detections",
    *_FIGURES,
    *(f"{name}_{end}" for name in _FIGURES for end in ("low", "high")),
)


def csv_rows(table: DetectorTableOut) -> list[dict[str, object]]:
    """Return a line for each detector, class set and size, then the paper's."""
    lines: list[dict[str, object]] = []
    for one in table.detectors:
        for figures in one.class_sets:
            by_size: dict[str, PrecisionOut] = {"all": figures, **figures.by_size}
            for size, values in by_size.items():
                line: dict[str, object] = {
                    "detector": one.name,
                    "score_threshold": one.score_threshold,
                    "decoding_divisor": one.decoding_divisor,
                    "class_set": figures.class_set,
                    "size": size,
                    "images": one.images,
                    "boxes": values.boxes,
                    "detections": one.detections,
                    **{name: getattr(values, name) for name in _FIGURES},
                }
                if size == "all" and figures.intervals is not None:
                    for name in _FIGURES:
                        low, high = getattr(figures.intervals, name)
                        line |= {f"{name}_low": low, f"{name}_high": high}
                lines.append(line)
    for paper in table.paper:
        for class_set, printed in (("moving", paper.moving), ("all", paper.all)):
            lines.append(
                {
                    "detector": f"{paper.name} (paper)",
                    "class_set": class_set,
                    "size": "all",
                    "images": 1000,
                    **dict(zip(_FIGURES, printed, strict=True)),
                }
            )
    return lines
