"""Generated poses against known truth, run by run: errors, match rate, and calibration."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.metrics import BoxPose
from app.domain.pose_errors import (
    Calibration,
    ErrorSummary,
    calibration,
    error_in_enu_m,
    nees,
    summary,
)
from app.domain.sampling import Share
from app.evaluation import pose_repository as repository
from app.evaluation import review_repository
from app.evaluation.kept import Kept
from app.evaluation.pose_repository import PoseRow
from app.evaluation.selection import Selection
from app.evaluation.service import Correct, Judged, judge, truths_by_image
from app.tables.groundtruth import VesselTruth

KINDS = ("add_s_m", "horizontal_m", "vertical_m", "heading_deg", "height_m")
NEAR = 0.1


@dataclass(frozen=True, slots=True)
class PoseFigures:
    """How the poses of a run did; `near`: ADD-S within a tenth of the vessel's length."""

    run_id: int | None
    label: str
    images: int
    poses: int
    match_rate: Share
    wrong: Share
    near: Share
    errors: Mapping[str, ErrorSummary | None]
    calibration: Calibration
    add_s_m: Sequence[float]


@dataclass(frozen=True, slots=True)
class PoseTable:
    """All runs together, each run, and the poses that are furthest off."""

    whole: PoseFigures | None
    runs: Sequence[PoseFigures]
    worst: Sequence[Correct]


_kept: Kept[PoseTable] = Kept()


def pose_table(session: Session, chosen: Selection) -> PoseTable:
    """Judge the poses of a selection in images whose truth is known."""
    images = repository.chosen_images(session, chosen)
    image_ids = sorted({image_id for of_run in images.values() for image_id in of_run})
    if not image_ids:
        return PoseTable(None, (), ())
    poses = repository.poses_with_truth(session, chosen)
    truths = repository.truths(session, image_ids)
    labels = review_repository.run_labels(session, sorted(images))
    return _kept.get(
        _key(poses, truths, images, labels), lambda: _work_out(poses, truths, images, labels)
    )


def _key(
    poses: Sequence[PoseRow],
    truths: Sequence[VesselTruth],
    images: Mapping[int, Sequence[int]],
    labels: Mapping[int, str],
) -> str:
    """Return a digest of rows that never change: their ids say which."""
    ids = ([pose.id for pose in poses], [truth.id for truth in truths])
    return hashlib.sha256(repr((ids, images, labels)).encode()).hexdigest()


def _work_out(
    poses: Sequence[PoseRow],
    truths: Sequence[VesselTruth],
    images: Mapping[int, Sequence[int]],
    labels: Mapping[int, str],
) -> PoseTable:
    by_image = truths_by_image(truths)
    by_run: dict[int, Judged] = {}
    for run_id, of_run in images.items():
        mine = [pose for pose in poses if pose.run_id == run_id]
        by_run[run_id] = judge(mine, by_image, of_run)
    whole = Judged(
        correct=[one for judged in by_run.values() for one in judged.correct],
        wrong=[pose for judged in by_run.values() for pose in judged.wrong],
        matchable=sum(judged.matchable for judged in by_run.values()),
        matched=sum(judged.matched for judged in by_run.values()),
    )
    count = sum(map(len, images.values()))
    return PoseTable(
        whole=_figures(None, "All runs", count, whole),
        runs=[
            _figures(run_id, labels[run_id], len(images[run_id]), judged)
            for run_id, judged in sorted(by_run.items())
        ],
        worst=sorted(whole.correct, key=lambda one: -one.error.add_s_m)[:20],
    )


def _figures(run_id: int | None, label: str, images: int, judged: Judged) -> PoseFigures:
    correct = judged.correct
    groups = [one.pose.image_id for one in correct]
    poses = len(correct) + len(judged.wrong)
    near = sum(one.error.add_s_m <= NEAR * one.true.length_m for one in correct)
    return PoseFigures(
        run_id=run_id,
        label=label,
        images=images,
        poses=poses,
        match_rate=Share(judged.matched, judged.matchable),
        wrong=Share(len(judged.wrong), poses),
        near=Share(near, len(correct)),
        errors={
            kind: summary([getattr(one.error, kind) for one in correct], groups) for kind in KINDS
        },
        calibration=_calibration(correct),
        add_s_m=sorted(one.error.add_s_m for one in correct),
    )


def _calibration(correct: Sequence[Correct]) -> Calibration:
    found: dict[int, list[float]] = {2: [], 3: []}
    sigmas: dict[str, list[float]] = {"heading": [], "height": []}
    for one in correct:
        pose = one.pose
        if pose.position_covariance_in_enu_m2 is not None:
            generated = BoxPose.of(pose)
            off = error_in_enu_m(generated, BoxPose.of(one.true), pose.heading_deg)
            for dimension, values in found.items():
                part = [row[:dimension] for row in pose.position_covariance_in_enu_m2[:dimension]]
                value = nees(off[:dimension], part)
                if value is not None:
                    values.append(value)
        if pose.heading_sigma_deg:
            sigmas["heading"].append(one.error.heading_deg / pose.heading_sigma_deg)
        if pose.height_sigma_m:
            sigmas["height"].append(one.error.height_m / pose.height_sigma_m)
    return calibration(found, sigmas)
