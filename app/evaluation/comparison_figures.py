"""The figures that two runs are compared by, each on the images both have."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.paired_figures import (
    Counts,
    PairedFigure,
    Sums,
    Values,
    drawn_images,
    paired_median,
    paired_ratio,
    sums_by_image,
)
from app.domain.pose_changes import PlacedPose
from app.evaluation.iou import Pair
from app.evaluation.service import Correct
from app.tables.reviews import Grade

ACCEPTABLE = frozenset({Grade.GOOD, Grade.OK})
# Vessels beside the picture could not have been matched.
NOT_IN_PICTURE = frozenset({"outside_image"})
ERRORS = {
    "add_s_m": ("ADD-S", "m"),
    "horizontal_m": ("Horizontal error", "m"),
    "vertical_m": ("Vertical error", "m"),
    "heading_deg": ("Heading error", "°"),
    "height_m": ("Height error", "m"),
}


class Group(StrEnum):
    """What a figure rests on; its value is the heading of a table."""

    MATCHING = "Matching"
    REVIEWS = "Reviews"
    OVERLAP = "Overlap with boxes that people drew"
    TRUTH = "Against known truth"
    SAME_VESSELS = "Against known truth, only vessels that both runs matched rightly"


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure with its name; `unit` is "share", "m", "°" or "" for a number without one."""

    group: Group
    name: str
    label: str
    unit: str
    paired: PairedFigure


@dataclass(frozen=True, slots=True)
class Material:
    """What a run made of the images both have: counts by image, and single things with theirs."""

    poses: Sequence[PlacedPose]
    detections: Mapping[int, int]
    matches: Mapping[int, int]
    outcomes: Mapping[str, Mapping[int, int]]
    grades: Sequence[tuple[int, Grade]]
    overlaps: Sequence[Pair]
    correct: Sequence[Correct]
    wrong: Sequence[int]
    matchable: Sequence[tuple[int, int]]


class _Comparer:
    """Turns two runs' material into figures over the same drawn images."""

    def __init__(self, other: Material, run: Material, images: Sequence[int]) -> None:
        self.other, self.run = other, run
        self.place = {image_id: number for number, image_id in enumerate(images)}
        self.drawn: Counts = drawn_images(len(images))

    def of_counts(
        self,
        part: Callable[[Material], Mapping[int, int]],
        whole: Callable[[Material], Mapping[int, int]],
    ) -> PairedFigure:
        """Compare shares from counts by image."""
        other, run = (
            Sums(self._by_place(part(one)), self._by_place(whole(one)))
            for one in (self.other, self.run)
        )
        return paired_ratio(other, run, self.drawn)

    def of_means(self, values: Callable[[Material], Iterable[tuple[int, float]]]) -> PairedFigure:
        """Compare means of (image, value); of ones and noughts it is a share."""
        other, run = (self._summed(list(values(one))) for one in (self.other, self.run))
        return paired_ratio(other, run, self.drawn)

    def of_medians(
        self, other: Sequence[Correct], run: Sequence[Correct], kind: str
    ) -> PairedFigure:
        """Compare medians of absolute errors."""
        first, second = (
            Values(
                np.array([abs(getattr(one.error, kind)) for one in correct], dtype=np.float64),
                np.array([self.place[one.pose.image_id] for one in correct], dtype=np.intp),
            )
            for correct in (other, run)
        )
        return paired_median(first, second, self.drawn)

    def _summed(self, pairs: Sequence[tuple[int, float]]) -> Sums:
        places = [self.place[image_id] for image_id, _ in pairs]
        return sums_by_image([value for _, value in pairs], places, len(self.place))

    def _by_place(self, counts: Mapping[int, int]) -> FloatArray:
        found = np.zeros(len(self.place))
        for image_id, count in counts.items():
            found[self.place[image_id]] = count
        return found


def figures(other: Material, run: Material, images: Sequence[int]) -> list[Figure]:
    """Return all figures that at least one of the runs has."""
    compare = _Comparer(other, run, images)
    found = [
        *_matching(compare),
        *_reviews(compare),
        *_overlap(compare),
        *_truth(compare, other, run),
    ]
    return [one for one in found if one.paired.other.count or one.paired.run.count]


def _matching(compare: _Comparer) -> list[Figure]:
    return [
        Figure(
            Group.MATCHING,
            "matched_detections",
            "Detections matched with a vessel",
            "share",
            compare.of_counts(lambda one: one.matches, lambda one: one.detections),
        ),
        Figure(
            Group.MATCHING,
            "matched_vessels",
            "Vessels heard in the picture that were matched",
            "share",
            compare.of_counts(
                lambda one: one.outcomes.get("matched", {}),
                lambda one: _summed(
                    counts for name, counts in one.outcomes.items() if name not in NOT_IN_PICTURE
                ),
            ),
        ),
    ]


def _summed(many: Iterable[Mapping[int, int]]) -> Mapping[int, int]:
    found: dict[int, int] = {}
    for counts in many:
        for image_id, count in counts.items():
            found[image_id] = found.get(image_id, 0) + count
    return found


def _reviews(compare: _Comparer) -> list[Figure]:
    wanted = (
        ("good", "Good, of graded poses", frozenset({Grade.GOOD})),
        ("acceptable", "Good or OK, of graded poses", ACCEPTABLE),
        ("wrong", "Wrong match, of graded poses", frozenset({Grade.WRONG})),
    )
    return [
        Figure(Group.REVIEWS, name, label, "share", compare.of_means(_graded_as(grades)))
        for name, label, grades in wanted
    ]


def _graded_as(
    wanted: frozenset[Grade],
) -> Callable[[Material], Iterable[tuple[int, float]]]:
    return lambda one: ((image_id, float(grade in wanted)) for image_id, grade in one.grades)


def _overlap(compare: _Comparer) -> list[Figure]:
    names = {Grade.GOOD: "Good", Grade.OK: "OK", Grade.BAD: "Bad", Grade.WRONG: "Wrong match"}
    return [
        Figure(
            Group.OVERLAP,
            f"iou_{grade.value}",
            f"Mean IoU of poses graded {name}",
            "",
            compare.of_means(_overlap_of(grade)),
        )
        for grade, name in names.items()
    ]


def _overlap_of(grade: Grade) -> Callable[[Material], Iterable[tuple[int, float]]]:
    return lambda one: ((pair.image_id, pair.iou) for pair in one.overlaps if pair.grade is grade)


def _truth(compare: _Comparer, other: Material, run: Material) -> list[Figure]:
    found = [
        Figure(
            Group.TRUTH,
            "truth_matched",
            "Visible vessels with AIS that were matched rightly",
            "share",
            compare.of_means(_rightly_matched),
        ),
        Figure(
            Group.TRUTH,
            "truth_wrong",
            "Wrong matches, of poses",
            "share",
            compare.of_means(_wrongly_matched),
        ),
    ]
    both = {_vessel(one) for one in other.correct} & {_vessel(one) for one in run.correct}
    same = [[one for one in side.correct if _vessel(one) in both] for side in (other, run)]
    for group, prefix, first, second in (
        (Group.TRUTH, "", other.correct, run.correct),
        (Group.SAME_VESSELS, "same_vessels_", same[0], same[1]),
    ):
        found += [
            Figure(
                group,
                f"{prefix}{kind}",
                f"{label}, median",
                unit,
                compare.of_medians(first, second, kind),
            )
            for kind, (label, unit) in ERRORS.items()
        ]
    return found


def _vessel(one: Correct) -> tuple[int, int]:
    return one.pose.image_id, one.pose.mmsi


def _rightly_matched(one: Material) -> Iterable[tuple[int, float]]:
    found = {_vessel(correct) for correct in one.correct}
    return ((vessel[0], float(vessel in found)) for vessel in one.matchable)


def _wrongly_matched(one: Material) -> Iterable[tuple[int, float]]:
    yield from ((correct.pose.image_id, 0.0) for correct in one.correct)
    yield from ((image_id, 1.0) for image_id in one.wrong)
