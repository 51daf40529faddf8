"""SQL of what people said: verdicts, missed vessels and complete images of a selection.

Only poses of the pipeline are evaluated: those that a person made by hand say nothing about it. The
rows are plain columns, because twenty thousand objects would cost more than the figures.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.evaluation.selection import Selection
from app.tables.ais import Vessel
from app.tables.identity import User
from app.tables.imagery import Image
from app.tables.queues import QueueUnit, ReviewQueueItem
from app.tables.registration import Registration
from app.tables.reviews import (
    Grade,
    ImageCompletion,
    MissedReason,
    MissedVessel,
    Review,
    verdict_order,
)
from app.tables.runs import Pose, Run, RunImage


class PoseRow(NamedTuple):
    """A pose of the pipeline: whose it is, and where it stands and heads."""

    id: int
    run_id: int
    mmsi: int
    lat_deg: float
    lon_deg: float
    heading_deg: float


class Verdict(NamedTuple):
    """A standing review of a pose."""

    pose_id: int
    user_id: int | None
    grade: Grade
    guideline_version: int
    inherited_from_id: int | None
    reasons: Sequence[str]


class Station(NamedTuple):
    """Where the camera of a run stands."""

    lat_deg: float
    lon_deg: float


def poses(session: Session, selection: Selection) -> list[PoseRow]:
    """Return the poses of a selection in the order they were made in."""
    statement = (
        sa.select(Pose.id, Pose.run_id, Pose.mmsi, Pose.lat_deg, Pose.lon_deg, Pose.heading_deg)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(*of_poses(selection))
        .order_by(Pose.id)
    )
    return [PoseRow(*row) for row in session.execute(statement)]


def pose_count(session: Session, selection: Selection) -> int:
    """Count the poses of a selection."""
    statement = (
        sa.select(sa.func.count())
        .select_from(Pose)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(*of_poses(selection))
    )
    return session.scalar(statement) or 0


def verdicts(session: Session, selection: Selection, *, complete: bool = False) -> list[Verdict]:
    """Return the standing reviews of a selection's poses; of a pose the one that counts is last.

    `complete`: only of poses in images that a person marked complete for that run.
    """
    statement = (
        sa.select(
            Review.pose_id,
            Review.user_id,
            Review.grade,
            Review.guideline_version,
            Review.inherited_from_id,
            Review.id,
        )
        .join(Pose, Pose.id == Review.pose_id)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(Review.replaced_at.is_(None), *of_poses(selection))
        .order_by(*verdict_order())
    )
    if complete:
        statement = statement.join(ImageCompletion, _completes(Pose))
    # Most verdicts are Good and give no reason: to read only those that may saves a third.
    reasons = {
        row[0]: row[1]
        for row in session.execute(
            statement.where(Review.grade != Grade.GOOD)
            .with_only_columns(Review.id, Review.reasons)
            .order_by(None)
        )
    }
    found = [
        Verdict(row[0], row[1], row[2], row[3], row[4], reasons.get(row[5], ()))
        for row in session.execute(statement)
    ]
    return found[::-1]


def opinions(session: Session, selection: Selection) -> Mapping[int, Mapping[int, Grade]]:
    """Return what people thought of each pose before they knew of each other, by person.

    Only of poses that several people reviewed. A person's last word counts, without reviews that
    were withdrawn, inherited, or given to settle.
    """
    several = (
        sa.select(Review.pose_id)
        .group_by(Review.pose_id)
        .having(sa.func.min(Review.user_id) != sa.func.max(Review.user_id))
    )
    statement = (
        sa.select(Review.pose_id, Review.user_id, Review.grade)
        .join(Pose, Pose.id == Review.pose_id)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(
            Review.pose_id.in_(several),
            Review.withdrawn_at.is_(None),
            Review.inherited_from_id.is_(None),
            Review.settles.is_(False),
            *of_poses(selection),
        )
        .order_by(Review.id)
    )
    found: dict[int, dict[int, Grade]] = {}
    for pose_id, user_id, grade in session.execute(statement):
        if user_id is not None:
            found.setdefault(pose_id, {})[user_id] = grade
    return found


def run_labels(session: Session, run_ids: Collection[int]) -> Mapping[int, str]:
    """Return what some runs are called on screen."""
    rows = session.execute(sa.select(Run.id, Run.name).where(Run.id.in_(run_ids)))
    return {run_id: name or f"Run {run_id}" for run_id, name in rows}


def stations(session: Session, run_ids: Collection[int]) -> Mapping[int, Station]:
    """Return where the cameras of some runs stand, by run."""
    rows = session.execute(
        sa.select(Run.id, Registration.center_lat_deg, Registration.center_lon_deg)
        .join(Registration, Registration.id == Run.registration_id)
        .where(Run.id.in_(run_ids), Registration.center_lat_deg.is_not(None))
    )
    return {row[0]: Station(row[1] or 0.0, row[2] or 0.0) for row in rows}


def ship_types(session: Session, mmsis: Iterable[int]) -> Mapping[int, int | None]:
    """Return the ship types of the vessels that are known."""
    rows = session.execute(
        sa.select(Vessel.mmsi, Vessel.ship_type).where(Vessel.mmsi.in_(set(mmsis)))
    )
    return {row[0]: row[1] for row in rows}


def names(session: Session, user_ids: Collection[int]) -> Mapping[int, str]:
    """Return the names of people."""
    rows = session.execute(sa.select(User.id, User.name, User.email).where(User.id.in_(user_ids)))
    return {user_id: name or email for user_id, name, email in rows}


def complete_images(session: Session, selection: Selection) -> Mapping[int, int]:
    """Count the images marked complete, by run."""
    statement = (
        sa.select(ImageCompletion.run_id, sa.func.count())
        .join(Image, Image.id == ImageCompletion.image_id)
        .join(Run, Run.id == ImageCompletion.run_id)
        .where(*of_images(selection, ImageCompletion.image_id, ImageCompletion.run_id))
        .group_by(ImageCompletion.run_id)
    )
    return {row[0]: row[1] for row in session.execute(statement)}


def poses_in_complete_images(session: Session, selection: Selection) -> int:
    """Count the poses in images that were marked complete."""
    statement = (
        sa.select(sa.func.count())
        .select_from(Pose)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .join(ImageCompletion, _completes(Pose))
        .where(*of_poses(selection))
    )
    return session.scalar(statement) or 0


def missed(session: Session, selection: Selection) -> Mapping[MissedReason, int]:
    """Count the missed vessels of images that were marked complete, by reason."""
    statement = (
        sa.select(MissedVessel.reason, sa.func.count())
        .join(Image, Image.id == MissedVessel.image_id)
        .join(Run, Run.id == MissedVessel.run_id)
        .join(ImageCompletion, _completes(MissedVessel))
        .where(*of_images(selection, MissedVessel.image_id, MissedVessel.run_id))
        .group_by(MissedVessel.reason)
    )
    return {row[0]: row[1] for row in session.execute(statement)}


def images(session: Session, selection: Selection) -> int:
    """Count the images of a selection's runs that are done; an image of two runs counts twice."""
    statement = (
        sa.select(sa.func.count())
        .select_from(RunImage)
        .join(Image, Image.id == RunImage.image_id)
        .join(Run, Run.id == RunImage.run_id)
        .where(
            RunImage.done_at.is_not(None),
            *of_images(selection, RunImage.image_id, RunImage.run_id),
        )
    )
    return session.scalar(statement) or 0


def graded_poses(session: Session, selection: Selection) -> int:
    """Count the poses with at least one standing review."""
    standing = sa.exists().where(Review.pose_id == Pose.id, Review.replaced_at.is_(None))
    statement = (
        sa.select(sa.func.count())
        .select_from(Pose)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(standing, *of_poses(selection))
    )
    return session.scalar(statement) or 0


def grading_times(
    session: Session, selection: Selection, since: datetime
) -> Sequence[tuple[datetime, int | None]]:
    """Return when people graded poses, and who, from a moment on; undone grades do not count."""
    statement = (
        sa.select(Review.created_at, Review.user_id)
        .join(Pose, Pose.id == Review.pose_id)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(
            Review.created_at >= since,
            Review.withdrawn_at.is_(None),
            Review.inherited_from_id.is_(None),
            *of_poses(selection),
        )
        .order_by(Review.created_at)
    )
    return [(row[0], row[1]) for row in session.execute(statement)]


def grades_by_person(session: Session, selection: Selection, user_id: int) -> int:
    """Count the poses of a selection that a person has graded."""
    statement = (
        sa.select(sa.func.count())
        .select_from(Review)
        .join(Pose, Pose.id == Review.pose_id)
        .join(Image, Image.id == Pose.image_id)
        .join(Run, Run.id == Pose.run_id)
        .where(Review.user_id == user_id, Review.replaced_at.is_(None), *of_poses(selection))
    )
    return session.scalar(statement) or 0


def of_poses(selection: Selection) -> list[sa.ColumnElement[bool]]:
    """Narrow a query over poses, their images and runs to a selection."""
    narrowed = of_images(selection, Pose.image_id, Pose.run_id)
    narrowed.append(Pose.person_made.is_(False))
    queue = selection.queue
    if queue is not None and queue.unit is QueueUnit.POSE:
        narrowed.append(
            Pose.id.in_(
                sa.select(ReviewQueueItem.pose_id).where(ReviewQueueItem.queue_id == queue.id)
            )
        )
    return narrowed


def of_images(
    selection: Selection,
    image_id: sa.orm.InstrumentedAttribute[int],
    run_id: sa.orm.InstrumentedAttribute[int],
) -> list[sa.ColumnElement[bool]]:
    """Narrow a query over images and runs to a selection, whatever it counts in them."""
    asked, queue = selection.asked, selection.queue
    narrowed: list[sa.ColumnElement[bool]] = [Image.deleted_at.is_(None)]
    if selection.site_ids is not None:
        narrowed.append(Run.site_id.in_(selection.site_ids))
    if asked.run_id is not None:
        narrowed.append(run_id == asked.run_id)
    if asked.site_id is not None:
        narrowed.append(Run.site_id == asked.site_id)
    if asked.camera_id is not None:
        narrowed.append(Image.camera_id == asked.camera_id)
    if asked.viewport_id is not None:
        narrowed.append(Run.viewport_id == asked.viewport_id)
    if asked.since is not None:
        narrowed.append(Image.captured_at >= asked.since)
    if asked.until is not None:
        narrowed.append(Image.captured_at < asked.until)
    if queue is not None:
        items = sa.select(ReviewQueueItem.image_id).where(ReviewQueueItem.queue_id == queue.id)
        narrowed += [run_id == queue.run_id, image_id.in_(items)]
    return narrowed


def _completes(rows: type[Pose | MissedVessel]) -> sa.ColumnElement[bool]:
    return sa.and_(ImageCompletion.image_id == rows.image_id, ImageCompletion.run_id == rows.run_id)
