"""Poses with what people say of them, and what that comes to for a run."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.sampling import wilson_interval
from app.errors import NotFound
from app.identities import service as identities
from app.identities.shown import Identities
from app.paging import Paging
from app.reviews import correction_repository, repository
from app.reviews.repository import Beside, PoseFilters
from app.tables.ais import Vessel
from app.tables.imagery import Image
from app.tables.reviews import Correction, Grade, Review
from app.tables.runs import Pose


@dataclass(frozen=True, slots=True)
class ReviewedPose:
    """A pose, the vessel it is of, and what people say of it.

    `reviews` are the standing ones, the one that counts first; `correction` the one that counts;
    `beside` and `told` (of vessels) are as the reader sees it.
    """

    pose: Pose
    vessel: Vessel | None
    reviews: Sequence[Review]
    correction: Correction | None
    corrected_vessel: Vessel | None
    beside: Beside
    reader_id: int | None
    told: Identities

    @property
    def review(self) -> Review | None:
        """The verdict that stands for the pose."""
        return self.reviews[0] if self.reviews else None

    @property
    def mine(self) -> Review | None:
        """The reader's own standing verdict."""
        own = (review for review in self.reviews if review.user_id == self.reader_id)
        return next(own, None) if self.reader_id is not None else None

    @property
    def disagreement(self) -> bool:
        """Whether people differ and nobody settled it."""
        differ = len({review.grade for review in self.reviews}) > 1
        return differ and not any(review.settles for review in self.reviews)


@dataclass(frozen=True, slots=True)
class Verdicts:
    """How a run's poses were judged, with 95 % intervals of the shares."""

    poses: int
    counts: Mapping[Grade, int]
    graded: int
    good: float | None
    good_interval: tuple[float, float]
    acceptable: float | None
    acceptable_interval: tuple[float, float]


def site_of_pose(session: Session, pose_id: int) -> int:
    """Return the site a pose belongs to. Raises NotFound."""
    site_id = repository.site_of_pose(session, pose_id)
    if site_id is None:
        raise NotFound("there is no such pose")
    return site_id


def get_pose(session: Session, pose_id: int, reader_id: int | None = None) -> ReviewedPose:
    """Return a pose with its vessel and verdicts. Raises NotFound."""
    pose = repository.pose(session, pose_id)
    if pose is None:
        raise NotFound("there is no such pose")
    return with_verdicts(session, [pose], reader_id)[0]


def list_poses(
    session: Session,
    site_ids: frozenset[int] | None,
    paging: Paging,
    wanted: PoseFilters,
) -> tuple[list[ReviewedPose], str | None]:
    """Return a page of poses with their vessels and verdicts."""
    poses, cursor = repository.poses(session, site_ids, paging, wanted)
    return with_verdicts(session, poses, wanted.reader_id), cursor


def appearances(
    session: Session,
    site_ids: frozenset[int] | None,
    paging: Paging,
    mmsi: int,
    reader_id: int | None,
) -> tuple[list[ReviewedPose], str | None]:
    """Return a page of the poses of a vessel."""
    return list_poses(session, site_ids, paging, PoseFilters(mmsi=mmsi, reader_id=reader_id))


def poses_by_id(
    session: Session, pose_ids: Sequence[int], reader_id: int | None
) -> Mapping[int, ReviewedPose]:
    """Return some poses with their vessels and verdicts."""
    poses = repository.poses_by_id(session, pose_ids)
    return {found.pose.id: found for found in with_verdicts(session, poses, reader_id)}


def poses_of_images(
    session: Session, run_id: int, image_ids: Sequence[int], reader_id: int | None
) -> Mapping[int, list[ReviewedPose]]:
    """Return the poses of each of some images in a run, in order."""
    found: dict[int, list[ReviewedPose]] = {image_id: [] for image_id in image_ids}
    poses = repository.poses_of_images(session, run_id, image_ids)
    for reviewed in with_verdicts(session, poses, reader_id):
        found[reviewed.pose.image_id].append(reviewed)
    return found


def images_by_id(session: Session, image_ids: Sequence[int]) -> Mapping[int, Image]:
    """Return some images."""
    return repository.images_by_id(session, image_ids)


def with_verdicts(
    session: Session, poses: Sequence[Pose], reader_id: int | None
) -> list[ReviewedPose]:
    """Put poses together with what stands beside them."""
    ids = [pose.id for pose in poses]
    beside = repository.beside(session, ids, reader_id)
    reviewed = [pose_id for pose_id, notes in beside.items() if notes.reviewed]
    reviews = repository.standing_reviews(session, reviewed) if reviewed else {}
    corrected = [pose_id for pose_id, notes in beside.items() if notes.correction_version]
    corrections = correction_repository.counting(session, corrected) if corrected else {}
    mmsis = {pose.mmsi for pose in poses} | {found.mmsi for found in corrections.values()}
    vessels = repository.vessels(session, mmsis)
    return [
        ReviewedPose(
            pose=pose,
            vessel=vessels.get(pose.mmsi),
            reviews=reviews.get(pose.id, ()),
            correction=(correction := corrections.get(pose.id)),
            corrected_vessel=vessels.get(correction.mmsi) if correction else None,
            beside=beside[pose.id],
            reader_id=reader_id,
            told=identities.at_site(session, pose.image.site_id),
        )
        for pose in poses
    ]


def vessel(session: Session, mmsi: int) -> Vessel | None:
    """Return what is known of a vessel."""
    return repository.vessels(session, [mmsi]).get(mmsi)


def reviews_of(session: Session, pose_id: int) -> Sequence[Review]:
    """Return all verdicts on a pose, replaced ones too, oldest first."""
    return repository.reviews_of(session, pose_id)


def verdicts(session: Session, run_id: int) -> Verdicts:
    """Sum up how a run's poses were judged; acceptable is Good or OK (paper, evaluation)."""
    return verdicts_by_run(session, [run_id])[run_id]


def verdicts_by_run(session: Session, run_ids: Collection[int]) -> Mapping[int, Verdicts]:
    """Sum up how the poses of each of some runs were judged, in one query."""
    found = repository.grade_counts(session, run_ids)
    return {run_id: _verdicts(total, counts) for run_id, (total, counts) in found.items()}


def _verdicts(total: int, counts: Mapping[Grade, int]) -> Verdicts:
    graded = sum(counts.values())
    good = counts.get(Grade.GOOD, 0)
    acceptable = good + counts.get(Grade.OK, 0)
    return Verdicts(
        poses=total,
        counts=counts,
        graded=graded,
        good=good / graded if graded else None,
        good_interval=wilson_interval(good, graded),
        acceptable=acceptable / graded if graded else None,
        acceptable_interval=wilson_interval(acceptable, graded),
    )
