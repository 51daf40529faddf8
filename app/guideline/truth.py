"""Judged poses from a simulator's truth: a calibration set that nobody had to grade.

Drawn with a seed, grade by grade in turn, so that a newcomer meets Bad and Wrong although they are
rare; the share of Good in such a set says nothing about the run.
"""

from collections.abc import Mapping, Sequence
from random import Random

import numpy as np
from sqlalchemy.orm import Session

from app.domain.judgement import BoxErrors, Judgement, foot_offset, judge_box, judge_mismatch
from app.domain.metrics import BoxPose, best_covered, pose_error
from app.guideline import repository
from app.tables.ais import Vessel
from app.tables.groundtruth import VesselTruth
from app.tables.reviews import Grade
from app.tables.runs import Pose


def draw_judged(session: Session, run_id: int, size: int, seed: int) -> list[tuple[int, Judgement]]:
    """Return up to `size` clear cases of a run as (pose id, judgement), in a random order."""
    poses = repository.candidates(session, run_id)
    truths = repository.truths(session, {pose.image_id for pose in poses})
    vessels = repository.vessels(session, (pose.mmsi for pose in poses))
    random = Random(seed)  # noqa: S311  a draw that can be repeated, not a secret
    by_grade: dict[str, list[tuple[int, Judgement]]] = {grade.value: [] for grade in Grade}
    for pose in poses:
        judgement = judge(pose, truths[pose.image_id], vessels)
        if judgement is not None and judgement.clear:
            by_grade[judgement.grade].append((pose.id, judgement))
    for found in by_grade.values():
        random.shuffle(found)
    drawn: list[tuple[int, Judgement]] = []
    while len(drawn) < size and any(by_grade.values()):
        drawn += [found.pop() for found in by_grade.values() if found][: size - len(drawn)]
    random.shuffle(drawn)
    return drawn


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
    error = pose_error(_box(pose), _box(true))
    return judge_box(
        BoxErrors(
            position=foot_offset(np.array(foot), np.array(true_foot), silhouettes[best]),
            heading_deg=error.heading_deg,
            height=error.height_m / true.height_m,
            length=(pose.length_m - true.length_m) / true.length_m,
        )
    )


def _box(row: Pose | VesselTruth) -> BoxPose:
    return BoxPose(
        centroid_in_cam_m=np.array(row.centroid_in_cam_m),
        rotvec_cam_from_vessel=np.array(row.rotvec_cam_from_vessel),
        length_m=row.length_m,
        width_m=row.width_m,
        height_m=row.height_m,
    )
