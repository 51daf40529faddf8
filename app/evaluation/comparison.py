"""Two runs side by side on the images both have: counts, figures, and pose by pose what changed.

Everything is counted on the images that both runs have done, so that a difference is one of the
runs and not of what they looked at. Figures are compared in pairs, image by image.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.pose_changes import PlacedPose, PosePair, paired_poses
from app.evaluation import comparison_repository as repository
from app.evaluation import pose_repository
from app.evaluation.comparison_figures import Figure, Material, figures
from app.evaluation.iou import iou_figures
from app.evaluation.kept import Kept
from app.evaluation.review_repository import verdicts
from app.evaluation.selection import Asked, Selection
from app.evaluation.service import Judged, judge, truths_by_image
from app.runs.service import OUTCOMES
from app.tables.runs import Run


@dataclass(frozen=True, slots=True)
class Count:
    """How many of something each run has on the images both have."""

    name: str
    label: str
    other: int
    run: int


@dataclass(frozen=True, slots=True)
class Comparison:
    """What two runs made of their images; `pairs` are the poses in images both have."""

    images_other: int
    images_run: int
    images_both: int
    counts: Sequence[Count]
    figures: Sequence[Figure]
    pairs: Sequence[PosePair]


_kept: Kept[Comparison] = Kept(16)


def compare(session: Session, run: Run, other: Run) -> Comparison:
    """Compare a run with another one; the caller may read both."""
    known = repository.fingerprint(session, sorted({run.id, other.id}))
    return _kept.get(
        f"{session.get_bind()} {run.id} {other.id} {known}",
        lambda: _work_out(session, run, other),
    )


def _work_out(session: Session, run: Run, other: Run) -> Comparison:
    done = {one.id: repository.done_images(session, one.id) for one in (other, run)}
    of_other = set(done[other.id])
    both = [image_id for image_id in done[run.id] if image_id in of_other]
    theirs, mine = (_material(session, one, frozenset(both)) for one in (other, run))
    return Comparison(
        images_other=len(done[other.id]),
        images_run=len(done[run.id]),
        images_both=len(both),
        counts=_counts(theirs, mine),
        figures=figures(theirs, mine, both),
        pairs=_pairs(theirs.poses, mine.poses, both),
    )


def _material(session: Session, run: Run, images: frozenset[int]) -> Material:
    """Read what a run made of some images, and what is known of that."""
    chosen = _all_of(run)
    poses = [pose for pose in repository.poses(session, run.id) if pose.image_id in images]
    image_of = {pose.id: pose.image_id for pose in poses}
    standing = {
        verdict.pose_id: verdict.grade
        for verdict in verdicts(session, chosen)
        if verdict.pose_id in image_of
    }
    judged = _judged(session, chosen)
    return Material(
        poses=poses,
        detections=_within(repository.detections(session, run.id), images),
        matches=_within(repository.matches(session, run.id), images),
        outcomes={
            outcome: _within(counts, images)
            for outcome, counts in repository.outcomes(session, run.id).items()
        },
        grades=[(image_of[pose_id], grade) for pose_id, grade in standing.items()],
        overlaps=[
            pair
            for pair in iou_figures(session, chosen, clip=True).pairs
            if pair.image_id in images
        ],
        correct=[one for one in judged.correct if one.pose.image_id in images],
        wrong=[pose.image_id for pose in judged.wrong if pose.image_id in images],
        matchable=[key for key in judged.matchable_vessels if key[0] in images],
    )


def _judged(session: Session, chosen: Selection) -> Judged:
    """Judge a run's poses where the truth is known."""
    image_ids = [
        one for found in pose_repository.chosen_images(session, chosen).values() for one in found
    ]
    truths = truths_by_image(pose_repository.truths(session, image_ids))
    return judge(pose_repository.poses_with_truth(session, chosen), truths, image_ids)


def _all_of(run: Run) -> Selection:
    asked = Asked(run.id, None, None, None, None, None, None)
    return Selection(asked, frozenset({run.site_id}), run.site_id, None)


def _within(counts: Mapping[int, int], images: frozenset[int]) -> Mapping[int, int]:
    return {image_id: count for image_id, count in counts.items() if image_id in images}


def _counts(other: Material, run: Material) -> list[Count]:
    def totals(name: str, label: str, both: Sequence[Mapping[int, int]]) -> Count:
        return Count(name, label, *(sum(counts.values()) for counts in both))

    found = [
        totals("detections", "Detections", [other.detections, run.detections]),
        totals("matches", "Detections matched with a vessel", [other.matches, run.matches]),
        Count("poses", "Poses", len(other.poses), len(run.poses)),
        Count(
            "detections_unmatched",
            "Detections without a vessel",
            *(sum(one.detections.values()) - sum(one.matches.values()) for one in (other, run)),
        ),
    ]
    found += [
        totals(
            f"vessels_{outcome}",
            f"Vessels heard: {label[0].lower()}{label[1:]}",
            [one.outcomes.get(outcome, {}) for one in (other, run)],
        )
        for outcome, label in OUTCOMES.items()
        if outcome in other.outcomes or outcome in run.outcomes
    ]
    return found


def _pairs(
    other: Sequence[PlacedPose], run: Sequence[PlacedPose], images: Sequence[int]
) -> list[PosePair]:
    """Pair the poses of each image, images in their order."""
    sides: list[dict[int, list[PlacedPose]]] = [{}, {}]
    for side, poses in zip(sides, (other, run), strict=True):
        for pose in poses:
            side.setdefault(pose.image_id, []).append(pose)
    first, second = sides
    return [
        pair
        for image_id in images
        for pair in paired_poses(first.get(image_id, ()), second.get(image_id, ()))
    ]
