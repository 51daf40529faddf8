"""Poses against truth, for sites whose truth is known because they are simulated.

A pose is a correct match when the vessel that its detection covers best is the vessel that AIS
said. The match rate's denominator are the vessels that could have been matched: in the image, with
AIS, and at least half visible. Errors are those of correct matches only; wrong ones are counted.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.metrics import BoxPose, PoseError, Spread, best_covered, pose_error, spread
from app.evaluation import repository
from app.tables.groundtruth import VesselTruth
from app.tables.runs import Pose

LEAST_VISIBLE = 0.5


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
    truths = repository.truths(session, run_ids)
    if not truths:
        return None
    by_image: dict[int, list[VesselTruth]] = defaultdict(list)
    for truth in truths:
        by_image[truth.image_id].append(truth)
    errors: list[PoseError] = []
    matched: set[tuple[int, int]] = set()
    wrong = 0
    for pose in repository.poses(session, run_ids):
        true = _vessel_under(pose, by_image[pose.image_id])
        if true is None or true.mmsi != pose.mmsi:
            wrong += 1
            continue
        matched.add((pose.image_id, pose.mmsi))
        errors.append(pose_error(BoxPose.of(pose), BoxPose.of(true)))
    matchable = {
        (truth.image_id, truth.mmsi)
        for truth in truths
        if truth.mmsi is not None and truth.visible_fraction >= LEAST_VISIBLE
    }
    return TruthFigures(
        matchable=len(matchable),
        matched=len(matchable & matched),
        correct=len(errors),
        wrong=wrong,
        horizontal_m=spread([error.horizontal_m for error in errors]),
        vertical_m=spread([error.vertical_m for error in errors]),
        heading_deg=spread([error.heading_deg for error in errors]),
        height_m=spread([error.height_m for error in errors]),
        add_s_m=spread([error.add_s_m for error in errors]),
    )


def _vessel_under(pose: Pose, truths: Sequence[VesselTruth]) -> VesselTruth | None:
    """Return the true vessel whose visible silhouette a pose's detection covers best."""
    box = pose.match.detection
    silhouettes = [(truth.x1_px, truth.y1_px, truth.x2_px, truth.y2_px) for truth in truths]
    best = best_covered((box.x1_px, box.y1_px, box.x2_px, box.y2_px), silhouettes)
    return None if best is None else truths[best]
