"""SQL of a run's images: what was judged in them, what was missed, which are complete."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.ais import Vessel
from app.tables.detection import Detection
from app.tables.imagery import Image
from app.tables.reviews import ImageCompletion, MissedVessel, Review
from app.tables.runs import Match, Pose, Run, RunImage, VesselStateRow

_GRADED = sa.exists().where(Review.pose_id == Pose.id, Review.replaced_at.is_(None))


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFilters:
    """Which images of a run are wanted; None means any."""

    complete: bool | None = None
    has_poses: bool | None = None
    has_missed: bool | None = None


def image(session: Session, image_id: int) -> Image | None:
    """Return a present image."""
    found = find(session, Image, image_id)
    return None if found is None or found.deleted_at is not None else found


def run_over(session: Session, run_id: int, image_id: int) -> Run | None:
    """Return a run if it is over an image."""
    return session.scalar(
        sa.select(Run)
        .join(RunImage, RunImage.run_id == Run.id)
        .where(Run.id == run_id, RunImage.image_id == image_id)
    )


def images_of_run(
    session: Session, run_id: int, wanted: ImageFilters, paging: Paging
) -> tuple[Sequence[RunImage], str | None]:
    """Return a page of a run's present images in the order of their time."""
    statement = (
        sa.select(RunImage)
        .join(Image, Image.id == RunImage.image_id)
        .where(RunImage.run_id == run_id, Image.deleted_at.is_(None))
    )
    here = {table: table.run_id == run_id for table in (ImageCompletion, Pose, MissedVessel)}
    for table, is_wanted in (
        (ImageCompletion, wanted.complete),
        (Pose, wanted.has_poses),
        (MissedVessel, wanted.has_missed),
    ):
        if is_wanted is not None:
            there = sa.exists().where(table.image_id == RunImage.image_id, here[table])
            statement = statement.where(there if is_wanted else ~there)
    return fetch_page(session, statement, RunImage.position, paging)


def images(session: Session, image_ids: Sequence[int]) -> Mapping[int, Image]:
    """Return some images."""
    rows = session.scalars(sa.select(Image).where(Image.id.in_(image_ids)))
    return {found.id: found for found in rows}


def pose_counts(
    session: Session, run_id: int, image_ids: Sequence[int]
) -> Mapping[int, tuple[int, int]]:
    """Return how many poses each image has in a run, and how many of them are graded."""
    rows = session.execute(
        sa.select(Pose.image_id, sa.func.count(), sa.func.count(sa.case((_GRADED, 1))))
        .where(Pose.run_id == run_id, Pose.image_id.in_(image_ids))
        .group_by(Pose.image_id)
    )
    return {row[0]: (row[1], row[2]) for row in rows}


def missed_counts(session: Session, run_id: int, image_ids: Sequence[int]) -> Mapping[int, int]:
    """Return how many vessels were missed in each image of a run."""
    rows = session.execute(
        sa.select(MissedVessel.image_id, sa.func.count())
        .where(MissedVessel.run_id == run_id, MissedVessel.image_id.in_(image_ids))
        .group_by(MissedVessel.image_id)
    )
    return {row[0]: row[1] for row in rows}


def completions(
    session: Session, run_id: int, image_ids: Sequence[int]
) -> Mapping[int, ImageCompletion]:
    """Return by whom and when each complete image of a run was completed."""
    rows = session.scalars(
        sa.select(ImageCompletion).where(
            ImageCompletion.run_id == run_id, ImageCompletion.image_id.in_(image_ids)
        )
    )
    return {found.image_id: found for found in rows}


def lock_image(session: Session, image_id: int) -> None:
    """Let nobody else complete or reopen an image until the transaction ends."""
    if session.get_bind().dialect.name != "sqlite":
        session.execute(
            sa.select(Image.id).where(Image.id == image_id).with_for_update(key_share=True)
        )


def ungraded(session: Session, run_id: int, image_id: int) -> Sequence[int]:
    """Return the poses of an image in a run that nobody has graded."""
    return session.scalars(
        sa.select(Pose.id)
        .where(Pose.run_id == run_id, Pose.image_id == image_id, ~_GRADED)
        .order_by(Pose.id)
    ).all()


def complete(session: Session, run_id: int, image_id: int, user_id: int, at: datetime) -> bool:
    """Store that an image of a run is complete; False when it was already."""
    insert = (sqlite if session.get_bind().dialect.name == "sqlite" else postgresql).insert
    stored = session.scalar(
        insert(ImageCompletion)
        .values(run_id=run_id, image_id=image_id, user_id=user_id, created_at=at)
        .on_conflict_do_nothing()
        .returning(ImageCompletion.id)
    )
    return stored is not None


def reopen(session: Session, run_id: int, image_id: int) -> bool:
    """Store that an image of a run is not complete; False when it was not."""
    deleted = session.scalar(
        sa.delete(ImageCompletion)
        .where(ImageCompletion.run_id == run_id, ImageCompletion.image_id == image_id)
        .returning(ImageCompletion.id)
    )
    return deleted is not None


def missed(session: Session, missed_id: int) -> MissedVessel | None:
    """Return a missed vessel."""
    return find(session, MissedVessel, missed_id)


def missed_of_image(
    session: Session, run_id: int | None, image_id: int, paging: Paging
) -> tuple[Sequence[MissedVessel], str | None]:
    """Return a page of the vessels missed in an image, in one run or in all."""
    statement = sa.select(MissedVessel).where(MissedVessel.image_id == image_id)
    if run_id is not None:
        statement = statement.where(MissedVessel.run_id == run_id)
    return fetch_page(session, statement, MissedVessel.id, paging)


def states_of_image(
    session: Session, run_id: int, image_id: int
) -> Sequence[tuple[VesselStateRow, Vessel | None, int | None]]:
    """Return the vessel states of an image in a run, with the vessel and the pose of each."""
    rows = session.execute(
        sa.select(VesselStateRow, Vessel, Pose.id)
        .outerjoin(Vessel, Vessel.mmsi == VesselStateRow.mmsi)
        .outerjoin(Match, Match.vessel_state_id == VesselStateRow.id)
        .outerjoin(Pose, Pose.match_id == Match.id)
        .where(VesselStateRow.run_id == run_id, VesselStateRow.image_id == image_id)
        .order_by(VesselStateRow.id)
    )
    return [(row[0], row[1], row[2]) for row in rows]


def detections_of_image(
    session: Session, run_id: int, image_id: int
) -> Sequence[tuple[Detection, int | None]]:
    """Return what was detected in an image of a run, with the pose of each."""
    rows = session.execute(
        sa.select(Detection, Pose.id)
        .join(RunImage, RunImage.detection_set_id == Detection.detection_set_id)
        .outerjoin(Match, (Match.detection_id == Detection.id) & (Match.run_id == run_id))
        .outerjoin(Pose, Pose.match_id == Match.id)
        .where(RunImage.run_id == run_id, RunImage.image_id == image_id)
        .order_by(Detection.id)
    )
    return [(row[0], row[1]) for row in rows]
