"""SQL of where a selection comes from: its grades, its times, the recordings behind it."""

from collections import Counter
from collections.abc import Sequence
from datetime import datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.exports.id_lists import among
from app.exports.selection_repository import Ids
from app.exports.verdict_repository import counted_grade, counted_reviews
from app.exports.writers.stored_values import review_records
from app.tables.ais import AisFile
from app.tables.imagery import Image
from app.tables.reviews import ImageCompletion, MissedVessel
from app.tables.runs import Pose

IDS_AT_ONCE = 5000
AROUND = timedelta(hours=1)  # reports before the first photograph are used for it


def grades(session: Session, pose_ids: Ids, verdict: str) -> Counter[str | None]:
    """Count poses by the grade that counts; None stands for poses without one."""
    pose_id = Pose.__table__.c.id
    found: Counter[str | None] = Counter()
    for start in range(0, len(pose_ids), IDS_AT_ONCE):
        some = pose_ids[start : start + IDS_AT_ONCE].tolist()
        grade = sa.cast(counted_grade(pose_id, verdict), sa.Text).label("grade")
        of_each = sa.select(grade).where(among(pose_id, some)).subquery()
        rows = session.execute(
            sa.select(of_each.c.grade, sa.func.count()).group_by(of_each.c.grade)
        )
        for name, count in rows:
            found[name] += count
    return found


def bytes_of_images(session: Session, image_ids: Sequence[int]) -> int:
    """Return how large photographs are together."""
    images = Image.__table__.c
    return sum(
        session.scalar(
            sa.select(sa.func.coalesce(sa.func.sum(images.size_bytes), 0)).where(
                among(images.id, image_ids[start : start + IDS_AT_ONCE])
            )
        )
        or 0
        for start in range(0, len(image_ids), IDS_AT_ONCE)
    )


def times(session: Session, image_ids: Sequence[int]) -> tuple[datetime, datetime]:
    """Return when the first and the last of some photographs were taken."""
    images = Image.__table__.c
    ids = sorted(set(image_ids))
    found: list[datetime] = []
    for start in range(0, len(ids), IDS_AT_ONCE):
        row = session.execute(
            sa.select(sa.func.min(images.captured_at), sa.func.max(images.captured_at)).where(
                among(images.id, ids[start : start + IDS_AT_ONCE])
            )
        ).one()
        found += row
    return min(found), max(found)


def recordings(
    session: Session, site_ids: Sequence[int], first: datetime, last: datetime
) -> Sequence[AisFile]:
    """Return the recordings of sites, or shared by all, that overlap a time, by id."""
    return session.scalars(
        sa.select(AisFile)
        .where(
            sa.or_(AisFile.site_id.is_(None), AisFile.site_id.in_(site_ids)),
            sa.or_(AisFile.last_at.is_(None), AisFile.last_at >= first - AROUND),
            sa.or_(AisFile.first_at.is_(None), AisFile.first_at <= last),
            AisFile.is_whole,
        )
        .order_by(AisFile.id)
    ).all()


def complete_verdicts(
    session: Session, run_ids: Sequence[int], at_most: int | None = None
) -> Counter[tuple[str, tuple[str, ...]]]:
    """Count the pipeline's graded poses on complete photographs, by grade and reasons.

    With `at_most` the first of them.
    """
    completions = ImageCompletion.__table__.c
    poses = Pose.__table__.c
    ids = session.scalars(
        sa.select(poses.id)
        .join(
            ImageCompletion.__table__,
            sa.and_(completions.run_id == poses.run_id, completions.image_id == poses.image_id),
        )
        .join(Image.__table__, Image.__table__.c.id == poses.image_id)
        .where(
            poses.run_id.in_(run_ids),
            poses.person_made.is_(False),
            Image.__table__.c.deleted_at.is_(None),
        )
        .order_by(poses.id)
        .limit(at_most)
    ).all()
    found: Counter[tuple[str, tuple[str, ...]]] = Counter()
    for start in range(0, len(ids), IDS_AT_ONCE):
        reviews = review_records(
            counted_reviews(session, ids[start : start + IDS_AT_ONCE], "standing")
        )
        found.update((review.grade, tuple(review.reasons)) for review in reviews.values())
    return found


def missed(session: Session, run_ids: Sequence[int]) -> dict[str, int]:
    """Count the vessels without a pose on complete photographs, by reason."""
    rows = session.execute(
        sa.select(sa.cast(MissedVessel.reason, sa.Text), sa.func.count(MissedVessel.id))
        .join(
            ImageCompletion,
            sa.and_(
                ImageCompletion.run_id == MissedVessel.run_id,
                ImageCompletion.image_id == MissedVessel.image_id,
            ),
        )
        .join(Image, Image.id == MissedVessel.image_id)
        .where(MissedVessel.run_id.in_(run_ids), Image.deleted_at.is_(None))
        .group_by(sa.cast(MissedVessel.reason, sa.Text))
    )
    return {row[0]: row[1] for row in rows}


def complete_images(session: Session, run_ids: Sequence[int]) -> int:
    """Count the photographs that people marked complete."""
    return (
        session.scalar(
            sa.select(sa.func.count())
            .select_from(ImageCompletion)
            .join(Image, Image.id == ImageCompletion.image_id)
            .where(ImageCompletion.run_id.in_(run_ids), Image.deleted_at.is_(None))
        )
        or 0
    )
