"""Judged poses from a simulator's truth: a calibration set that nobody had to grade."""

from collections.abc import Mapping, Sequence

import numpy as np
from sqlalchemy.orm import Session

from app.domain.judgement import BoxErrors, Judgement, foot_offset, judge_box, judge_mismatch
from app.domain.metrics import BoxPose, best_covered, pose_error
from app.guideline import repository
from app.tables.ais import Vessel
from app.tables.groundtruth import VesselTruth
from app.tables.runs import Pose


def judged_by_truth(session: Session, run_id: int) -> list[tuple[int, Judgement]]:
    """Return the clear cases of a run as (pose id, judgement)."""
    poses = repository.candidates(session, run_id)
    truths = repository.truths(session, {pose.image_id for pose in poses})
    vessels = repository.vessels(session, (pose.mmsi for pose in poses))
    judged = [(pose.id, judge(pose, truths[pose.image_id], vessels)) for pose in poses]
    return [(pose_id, found) for pose_id, found in judged if found is not None and found.clear]


def judge(
    pose: Pose, truths: Sequence[VesselTruth], vessels: Mapping[int, Vessel]
) -> Judgement | None:
    """Judge a pose by the vessel its detection shows; None where a box has no whole foot."""
    box = pose.match.detection
    silhouettes = [(true.x1_px, true.y1_px, true.x2_px, true.y2_px) for true in truths]
    best = best_covered((box.x1_px, box.y1_px, box.x2_px, box.y2_px), silhouettes)
    vessel = vessels.get(pose.mmsi)
    said = (vessel.name if vessel else None) or f"MMSI {pose.mmsi}"
    if best is None:
        return judge_mismatch(None, seen_has_ais=False, said=said)
    true = truths[best]
    if true.mmsi != pose.mmsi:
        return judge_mismatch(true.identifier, seen_has_ais=true.mmsi is not None, said=said)
    foot, true_foot = pose.corners_in_image_px[:4], true.corners_in_image_px[:4]
    if None in foot or None in true_foot:
        return None
    error = pose_error(BoxPose.of(pose), BoxPose.of(true))
    return judge_box(
        BoxErrors(
            position=foot_offset(np.array(foot), np.array(true_foot), silhouettes[best]),
            heading_deg=error.heading_deg,
            height=error.height_m / true.height_m,
            length=(pose.length_m - true.length_m) / true.length_m,
        )
    )
