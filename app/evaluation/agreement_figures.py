"""How far reviewers agree, on the poses that at least two of them judged by themselves.

A verdict given to settle a disagreement knew of the others and does not count; nor does one that
was inherited. Of each person their last word on a pose counts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.agreement import (
    Kappa,
    Scale,
    alpha_interval,
    krippendorffs_alpha,
    pairwise_kappas,
    percent_agreement,
)
from app.evaluation import review_repository as repository
from app.evaluation.breakdown import Viewer
from app.evaluation.selection import Selection
from app.tables.reviews import Grade

CATEGORIES: Mapping[Grade, int] = {grade: number for number, grade in enumerate(Grade)}
BOOTSTRAP_ROUNDS, BOOTSTRAP_SEED = 1000, 1


@dataclass(frozen=True, slots=True)
class Alpha:
    """Krippendorff's alpha on a scale, with its 95 % interval; None where undefined."""

    scale: Scale
    value: float | None
    interval: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Pair:
    """Two reviewers and Cohen's kappa on the poses both judged."""

    first: str
    second: str
    kappa: Kappa


@dataclass(frozen=True, slots=True)
class AgreementFigures:
    """Agreement on poses with more than one opinion; `share` of the pairs on a pose are equal."""

    units: int
    opinions: int
    reviewers: int
    share: float | None
    alphas: tuple[Alpha, ...]
    pairs: Sequence[Pair]


def agreement_figures(session: Session, selection: Selection, viewer: Viewer) -> AgreementFigures:
    """Tell how far the reviewers of a selection's poses agree."""
    units = [
        {person: CATEGORIES[grade] for person, grade in of_pose.items()}
        for of_pose in repository.opinions(session, selection).values()
        if len(of_pose) > 1
    ]
    ratings = [list(unit.values()) for unit in units]
    people = {person for unit in units for person in unit}
    return AgreementFigures(
        units=len(units),
        opinions=sum(len(unit) for unit in units),
        reviewers=len(people),
        share=percent_agreement(ratings),
        alphas=tuple(_alpha(ratings, scale) for scale in Scale),
        pairs=_pairs(session, units, people, viewer),
    )


def _alpha(ratings: Sequence[Sequence[int]], scale: Scale) -> Alpha:
    return Alpha(
        scale,
        krippendorffs_alpha(ratings, len(CATEGORIES), scale),
        alpha_interval(
            ratings, len(CATEGORIES), scale, rounds=BOOTSTRAP_ROUNDS, seed=BOOTSTRAP_SEED
        ),
    )


def _pairs(
    session: Session, units: Sequence[Mapping[int, int]], people: set[int], viewer: Viewer
) -> list[Pair]:
    """Return the pairs with the most poses in common first, by names only for those who may."""
    if viewer.sees_people:
        names = dict(repository.names(session, people))
    else:
        others = sorted(people - {viewer.user_id})
        names = {person: f"Reviewer {number}" for number, person in enumerate(others, start=1)}
    names[viewer.user_id] = "You"
    found = [
        Pair(names.get(first, "Somebody"), names.get(second, "Somebody"), kappa)
        for (first, second), kappa in pairwise_kappas(units, len(CATEGORIES)).items()
    ]
    return sorted(found, key=lambda pair: -pair.kappa.units)
