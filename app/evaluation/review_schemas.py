"""Shapes of the figures of review in REST."""

from collections.abc import Mapping
from datetime import datetime

from pydantic import BaseModel, Field

from app.domain.agreement import Scale
from app.evaluation.agreement_figures import (
    BOOTSTRAP_ROUNDS,
    BOOTSTRAP_SEED,
    AgreementFigures,
    Pair,
)
from app.evaluation.breakdown import By
from app.evaluation.review_figures import Group, ReviewFigures, Wanted
from app.evaluation.review_progress import ReviewProgress
from app.evaluation.schemas import Interval, SampleOut, ShareOut
from app.evaluation.tally import Tally
from app.tables.reviews import Grade


class TallyOut(BaseModel):
    """Verdicts by grade and reason, with the shares of Good and of Good or OK."""

    graded: int
    grades: Mapping[Grade, int]
    reasons: Mapping[Grade, Mapping[str, int]]
    good: ShareOut
    acceptable: ShareOut


class GroupOut(TallyOut):
    """A part of the poses; `poses` is null by reviewer, where parts overlap."""

    key: str
    label: str
    poses: int | None


class WantedOut(BaseModel):
    """How many graded poses the wanted half-width needs if the share stays `expected_share`."""

    expected_share: float
    of_many: int = Field(description="Of endlessly many such poses")
    more_of_many: int
    of_these: int = Field(description="Of these poses only (finite population)")
    more_of_these: int


class WantedBoth(BaseModel):
    """What a wanted precision needs, for each of the two shares."""

    half_width: float
    good: WantedOut
    acceptable: WantedOut


class AlphaOut(BaseModel):
    """Krippendorff's alpha; the interval is a bootstrap over poses."""

    scale: Scale
    value: float | None
    interval: Interval | None


class PairOut(BaseModel):
    """Two reviewers, the poses both judged, and Cohen's kappa (Fleiss's interval)."""

    first: str
    second: str
    units: int
    agreed: int
    kappa: float | None
    interval: Interval | None


class AgreementOut(BaseModel):
    """Agreement on the poses that at least two people judged by themselves."""

    units: int
    opinions: int
    reviewers: int
    share: float | None = Field(description="Equal pairs of opinions among all pairs on a pose")
    alphas: list[AlphaOut]
    bootstrap_rounds: int
    bootstrap_seed: int
    pairs: list[PairOut]


class ReviewFiguresOut(TallyOut):
    """How the poses of a selection were judged."""

    poses: int
    ungraded: int
    inherited: int = Field(description="Verdicts taken over from an earlier run, of those counted")
    second_opinions: int = Field(description="Counted for agreement only")
    guideline_versions: Mapping[int, int]
    sample: SampleOut | None
    wanted: WantedBoth
    agreement: AgreementOut
    by: By | None
    groups: list[GroupOut]


class StepOut(BaseModel):
    """The grades of five minutes."""

    start: datetime
    grades: int
    own: int


class ReviewProgressOut(BaseModel):
    """How far a review is; `own` is the caller's part."""

    poses: int
    graded: int
    images: int
    complete_images: int
    own_graded: int
    grades_per_min: float
    own_grades_per_min: float
    remaining_s: float | None
    last_graded_at: datetime | None
    last_hour: list[StepOut]


def figures_out(
    figures: ReviewFigures, agreement: AgreementFigures, sample: SampleOut | None
) -> ReviewFiguresOut:
    """Write figures out."""
    return ReviewFiguresOut(
        **tally_fields(figures.tally),
        poses=figures.poses,
        ungraded=figures.poses - figures.tally.graded,
        inherited=figures.inherited,
        second_opinions=figures.second_opinions,
        guideline_versions=figures.guideline_versions,
        sample=sample,
        wanted=WantedBoth(
            half_width=figures.half_width,
            good=_wanted(figures.wanted_good),
            acceptable=_wanted(figures.wanted_acceptable),
        ),
        agreement=_agreement(agreement),
        by=figures.by,
        groups=[group_out(group) for group in figures.groups],
    )


def group_out(group: Group) -> GroupOut:
    """Write a part's figures out."""
    return GroupOut(
        **tally_fields(group.tally), key=group.key, label=group.label, poses=group.poses
    )


def tally_fields(tally: Tally) -> dict[str, object]:
    """Return the fields that every tally has."""
    return {
        "graded": tally.graded,
        "grades": tally.grades,
        "reasons": {grade: found for grade, found in tally.reasons.items() if found},
        "good": ShareOut.of(tally.good),
        "acceptable": ShareOut.of(tally.acceptable),
    }


def _wanted(wanted: Wanted) -> WantedOut:
    return WantedOut(
        expected_share=wanted.share,
        of_many=wanted.of_many,
        more_of_many=wanted.more_of_many,
        of_these=wanted.of_these,
        more_of_these=wanted.more_of_these,
    )


def _agreement(figures: AgreementFigures) -> AgreementOut:
    return AgreementOut(
        units=figures.units,
        opinions=figures.opinions,
        reviewers=figures.reviewers,
        share=figures.share,
        alphas=[
            AlphaOut(scale=alpha.scale, value=alpha.value, interval=alpha.interval)
            for alpha in figures.alphas
        ],
        bootstrap_rounds=BOOTSTRAP_ROUNDS,
        bootstrap_seed=BOOTSTRAP_SEED,
        pairs=[_pair(pair) for pair in figures.pairs],
    )


def _pair(pair: Pair) -> PairOut:
    return PairOut(
        first=pair.first,
        second=pair.second,
        units=pair.kappa.units,
        agreed=pair.kappa.agreed,
        kappa=pair.kappa.kappa,
        interval=pair.kappa.interval,
    )


def progress_out(progress: ReviewProgress) -> ReviewProgressOut:
    """Write a review's progress out."""
    return ReviewProgressOut(
        poses=progress.poses,
        graded=progress.graded,
        images=progress.images,
        complete_images=progress.complete_images,
        own_graded=progress.own_graded,
        grades_per_min=progress.grades_per_min,
        own_grades_per_min=progress.own_grades_per_min,
        remaining_s=progress.remaining_s,
        last_graded_at=progress.last_graded_at,
        last_hour=[
            StepOut(start=step.start, grades=step.grades, own=step.own)
            for step in progress.last_hour
        ],
    )
