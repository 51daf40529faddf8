"""SQL of calibration sets: judged poses, attempts at them and what was answered."""

from collections.abc import Iterable, Mapping, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session, contains_eager, joinedload

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.ais import Vessel
from app.tables.groundtruth import VesselTruth
from app.tables.imagery import Image
from app.tables.practice import CalibrationSet, JudgedPose, PracticeAttempt, PracticeGrade
from app.tables.reviews import Review
from app.tables.runs import Pose, Run


def get(session: Session, set_id: int) -> CalibrationSet | None:
    """Return a set with its run."""
    return find(session, CalibrationSet, set_id, joinedload(CalibrationSet.run))


def listed(
    session: Session, site_ids: Iterable[int] | None, run_id: int | None, paging: Paging
) -> tuple[Sequence[CalibrationSet], str | None]:
    """Return a page of the sets of some sites (None: all)."""
    statement = (
        sa.select(CalibrationSet)
        .join(CalibrationSet.run)
        .options(contains_eager(CalibrationSet.run))
    )
    if site_ids is not None:
        statement = statement.where(Run.site_id.in_(site_ids))
    if run_id is not None:
        statement = statement.where(CalibrationSet.run_id == run_id)
    return fetch_page(session, statement, CalibrationSet.id, paging)


def judged(session: Session, set_id: int) -> Sequence[JudgedPose]:
    """Return the judged poses of a set in its order, without those of deleted images."""
    return session.scalars(
        sa.select(JudgedPose)
        .join(Pose, Pose.id == JudgedPose.pose_id)
        .join(Image, Image.id == Pose.image_id)
        .where(JudgedPose.set_id == set_id, Image.deleted_at.is_(None))
        .order_by(JudgedPose.position, JudgedPose.id)
    ).all()


def counts(session: Session, set_ids: Iterable[int]) -> Mapping[int, int]:
    """Count the judged poses of some sets."""
    rows = session.execute(
        sa.select(JudgedPose.set_id, sa.func.count())
        .where(JudgedPose.set_id.in_(list(set_ids)))
        .group_by(JudgedPose.set_id)
    )
    return {row[0]: row[1] for row in rows}


def poses_of_run(session: Session, run_id: int, pose_ids: Iterable[int]) -> set[int]:
    """Return which of some poses belong to a run."""
    rows = session.scalars(
        sa.select(Pose.id).where(Pose.run_id == run_id, Pose.id.in_(list(pose_ids)))
    )
    return set(rows)


def candidates(session: Session, run_id: int) -> Sequence[Pose]:
    """Return the pipeline's poses of a run whose images have a known truth."""
    known = sa.exists().where(VesselTruth.image_id == Pose.image_id)
    return session.scalars(
        sa.select(Pose)
        .join(Image, Image.id == Pose.image_id)
        .where(
            Pose.run_id == run_id,
            Pose.person_made.is_(False),
            Image.deleted_at.is_(None),
            known,
        )
        .order_by(Pose.id)
    ).all()


def reviews_of(session: Session, run_id: int, user_id: int) -> Sequence[Review]:
    """Return a person's own standing reviews of a run's poses by the pipeline."""
    return session.scalars(
        sa.select(Review)
        .join(Pose, Pose.id == Review.pose_id)
        .join(Image, Image.id == Pose.image_id)
        .where(
            Pose.run_id == run_id,
            Pose.person_made.is_(False),
            Image.deleted_at.is_(None),
            Review.user_id == user_id,
            Review.replaced_at.is_(None),
        )
        .order_by(Review.pose_id)
    ).all()


def truths(session: Session, image_ids: Iterable[int]) -> Mapping[int, list[VesselTruth]]:
    """Return the true vessels of some images, by image."""
    found: dict[int, list[VesselTruth]] = {}
    for truth in session.scalars(
        sa.select(VesselTruth)
        .where(VesselTruth.image_id.in_(list(image_ids)))
        .order_by(VesselTruth.id)
    ):
        found.setdefault(truth.image_id, []).append(truth)
    return found


def vessels(session: Session, mmsis: Iterable[int]) -> Mapping[int, Vessel]:
    """Return what is known of some vessels."""
    rows = session.scalars(sa.select(Vessel).where(Vessel.mmsi.in_(set(mmsis))))
    return {vessel.mmsi: vessel for vessel in rows}


def judgement(session: Session, set_id: int, pose_id: int) -> JudgedPose | None:
    """Return a set's judgement of a pose."""
    return session.scalars(
        sa.select(JudgedPose).where(JudgedPose.set_id == set_id, JudgedPose.pose_id == pose_id)
    ).first()


def attempt(session: Session, set_id: int, user_id: int) -> PracticeAttempt | None:
    """Return a person's latest attempt at a set."""
    return session.scalars(
        sa.select(PracticeAttempt)
        .where(PracticeAttempt.set_id == set_id, PracticeAttempt.user_id == user_id)
        .order_by(PracticeAttempt.number.desc())
        .limit(1)
    ).first()


def answers(session: Session, attempt_id: int) -> Mapping[int, PracticeGrade]:
    """Return what was answered in an attempt, by pose."""
    rows = session.scalars(
        sa.select(PracticeGrade)
        .where(PracticeGrade.attempt_id == attempt_id)
        .order_by(PracticeGrade.id)
    )
    return {row.pose_id: row for row in rows}


def lock(session: Session, set_id: int) -> None:
    """Let one writer at a time change a set or answer it. SQLite has only one anyway."""
    session.execute(
        sa.select(CalibrationSet.id)
        .where(CalibrationSet.id == set_id)
        .with_for_update(key_share=True)
    )
