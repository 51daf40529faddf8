"""Poses against truth, for sites whose truth is known because they are simulated.

A pose is a correct match when the vessel that its detection covers best is the vessel that AIS
said. The match rate's denominator are the vessels that could have been matched: in the image, with
AIS, and at least half visible. Errors are those of correct matches only; wrong ones are counted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sqlalchemy.orm import Session

from app.domain.metrics import BoxPose, PoseError, Spread, best_covered, pose_error, spread
from app.evaluation import pose_repository as repository
from app.evaluation.pose_repository import PoseRow
from app.tables.groundtruth import VesselTruth

LEAST_VISIBLE = 0.5


@dataclass(frozen=True, slots=True)
class Correct:
    """A correct match with its errors."""

    pose: PoseRow
    true: VesselTruth
    error: PoseError


@dataclass(slots=True)
class Judged:
    """What became of poses: correct ones with their errors, and wrong ones, by run where asked.

    `matchable_vessels` are (image, MMSI) of those that could have been matched.
    """

    correct: list[Correct] = field(default_factory=list)
    wrong: list[PoseRow] = field(default_factory=list)
    matchable_vessels: frozenset[tuple[int, int]] = frozenset()
    matchable: int = 0
    matched: int = 0


@dataclass(frozen=True, slots=True)
class TruthFigures:
    """How runs did against the truth; spreads are None where there is no correct match."""

    matchable: int
    matched: int
    correct: int
    wrong: int
    horizontal_m: Spread | None
    vertical_m: Spread | None
    heading_deg: Spread | None
    height_m: Spread | None
    add_s_m: Spread | None


def against_truth(session: Session, run_ids: Sequence[int]) -> TruthFigures | None:
    """Judge the poses of runs; None where nothing is known to be true."""
    images = repository.images_of_runs(session, run_ids)
    image_ids = sorted({image_id for of_run in images.values() for image_id in of_run})
    truths = truths_by_image(repository.truths(session, image_ids))
    if not truths:
        return None
    judged = judge(repository.poses_of_runs(session, run_ids), truths, image_ids)
    errors = [one.error for one in judged.correct]
    return TruthFigures(
        matchable=judged.matchable,
        matched=judged.matched,
        correct=len(errors),
        wrong=len(judged.wrong),
        horizontal_m=spread([error.horizontal_m for error in errors]),
        vertical_m=spread([error.vertical_m for error in errors]),
        heading_deg=spread([error.heading_deg for error in errors]),
        height_m=spread([error.height_m for error in errors]),
        add_s_m=spread([error.add_s_m for error in errors]),
    )


def truths_by_image(truths: Sequence[VesselTruth]) -> dict[int, list[VesselTruth]]:
    """Put what is true to the images it is true of."""
    found: dict[int, list[VesselTruth]] = {}
    for truth in truths:
        found.setdefault(truth.image_id, []).append(truth)
    return found


def judge(
    poses: Sequence[PoseRow],
    truths: Mapping[int, Sequence[VesselTruth]],
    image_ids: Sequence[int],
) -> Judged:
    """Compare poses with the truth of the images that were looked at."""
    judged = Judged()
    matched: set[tuple[int, int]] = set()
    for pose in poses:
        true = _vessel_under(pose, truths.get(pose.image_id, ()))
        if true is None or true.mmsi != pose.mmsi:
            judged.wrong.append(pose)
            continue
        matched.add((pose.image_id, pose.mmsi))
        error = pose_error(BoxPose.of(pose), BoxPose.of(true))
        judged.correct.append(Correct(pose, true, error))
    matchable = frozenset(
        (truth.image_id, truth.mmsi)
        for image_id in image_ids
        for truth in truths.get(image_id, ())
        if truth.mmsi is not None and truth.visible_fraction >= LEAST_VISIBLE
    )
    judged.matchable_vessels = matchable
    judged.matchable, judged.matched = len(matchable), len(matchable & matched)
    return judged


def _vessel_under(pose: PoseRow, truths: Sequence[VesselTruth]) -> VesselTruth | None:
    """Return the true vessel whose visible silhouette a pose's detection covers best."""
    silhouettes = [(truth.x1_px, truth.y1_px, truth.x2_px, truth.y2_px) for truth in truths]
    best = best_covered((pose.x1_px, pose.y1_px, pose.x2_px, pose.y2_px), silhouettes)
    return None if best is None else truths[best]
