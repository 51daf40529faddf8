"""SQL of poses and the verdicts on them."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, contains_eager, joinedload

from app.db import find
from app.ids import LARGEST_WIDE_ID
from app.paging import Paging, fetch_page
from app.tables.ais import Vessel
from app.tables.imagery import Image
from app.tables.notes import Bookmark, Comment
from app.tables.reviews import Correction, Grade, Review, verdict_order
from app.tables.runs import Pose, Run

UNGRADED = "ungraded"
STANDING = Review.replaced_at.is_(None)
# Asked at every request about a pose, so they are put together once.
_SITE_OF_POSE = (
    sa.select(Run.site_id)
    .join(Pose, Pose.run_id == Run.id)
    .join(Image, Image.id == Pose.image_id)
    .where(Pose.id == sa.bindparam("pose_id"), Image.deleted_at.is_(None))
)
_POSES_BY_ID = (
    sa.select(Pose)
    .options(joinedload(Pose.image))
    .where(Pose.id.in_(sa.bindparam("ids", expanding=True)))
)
_STANDING_REVIEWS = (
    sa.select(Review)
    .where(Review.pose_id.in_(sa.bindparam("ids", expanding=True)), STANDING)
    .order_by(*verdict_order())
)
_VESSELS = sa.select(Vessel).where(Vessel.mmsi.in_(sa.bindparam("mmsis", expanding=True)))
_BESIDE = sa.select(
    Pose.id,
    sa.exists().where(Review.pose_id == Pose.id, STANDING),
    sa.select(sa.func.count()).where(Comment.pose_id == Pose.id).scalar_subquery(),
    sa.exists().where(Bookmark.pose_id == Pose.id, Bookmark.user_id == sa.bindparam("reader_id")),
    sa.select(sa.func.max(Correction.version))
    .where(Correction.pose_id == Pose.id)
    .scalar_subquery(),
).where(Pose.id.in_(sa.bindparam("ids", expanding=True)))


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseFilters:
    """What poses are wanted; None means any. `reader_id` is whose bookmarks count."""

    run_id: int | None = None
    image_id: int | None = None
    mmsi: int | None = None
    grade: str | None = None
    state: str | None = None
    reviewer_id: int | None = None
    reader_id: int | None = None
    bookmarked: bool | None = None
    corrected: bool | None = None
    person_made: bool | None = None
    flag: str | None = None


@dataclass(frozen=True, slots=True)
class Beside:
    """What stands beside a pose for one reader."""

    reviewed: bool
    comments: int
    bookmarked: bool
    correction_version: int


def pose(session: Session, pose_id: int) -> Pose | None:
    """Return a pose with its image, run, match, detection and vessel state."""
    return find(session, Pose, pose_id, joinedload(Pose.image))


def poses_by_id(session: Session, pose_ids: Sequence[int]) -> Sequence[Pose]:
    """Return some poses with their images, matches, detections and vessel states."""
    return session.scalars(_POSES_BY_ID, {"ids": pose_ids}).all()


def poses_of_images(session: Session, run_id: int, image_ids: Sequence[int]) -> Sequence[Pose]:
    """Return the poses of some images in a run, in order."""
    return session.scalars(
        sa.select(Pose)
        .options(joinedload(Pose.image))
        .where(Pose.run_id == run_id, Pose.image_id.in_(image_ids))
        .order_by(Pose.id)
    ).all()


def images_by_id(session: Session, image_ids: Sequence[int]) -> Mapping[int, Image]:
    """Return some images."""
    rows = session.scalars(sa.select(Image).where(Image.id.in_(image_ids)))
    return {image.id: image for image in rows}


def site_of_pose(session: Session, pose_id: int) -> int | None:
    """Return the site a pose belongs to; None for the poses of a deleted image."""
    if not 0 < pose_id <= LARGEST_WIDE_ID:
        return None
    return session.scalar(_SITE_OF_POSE, {"pose_id": pose_id})


def poses(
    session: Session, site_ids: Iterable[int] | None, paging: Paging, wanted: PoseFilters
) -> tuple[Sequence[Pose], str | None]:
    """Return a page of poses of some sites (None: all), in the order they were made in.

    So the poses of one image stand together within a run. Those of deleted images are left out.
    """
    statement = (
        sa.select(Pose)
        .join(Pose.image)
        .options(contains_eager(Pose.image))
        .where(Image.deleted_at.is_(None), *_conditions(wanted))
    )
    if site_ids is not None:
        statement = statement.join(Run, Run.id == Pose.run_id).where(Run.site_id.in_(site_ids))
    return fetch_page(session, statement, Pose.id, paging)


def _conditions(wanted: PoseFilters) -> list[sa.ColumnElement[bool]]:
    equal: list[tuple[sa.orm.InstrumentedAttribute[Any], object]] = [
        (Pose.run_id, wanted.run_id),
        (Pose.image_id, wanted.image_id),
        (Pose.mmsi, wanted.mmsi),
        (Pose.person_made, wanted.person_made),
    ]
    conditions = [column == value for column, value in equal if value is not None]
    if wanted.grade == UNGRADED:
        conditions.append(~_standing())
    elif wanted.grade is not None:
        conditions.append(standing_grade() == Grade(wanted.grade))
    if wanted.state is not None:
        conditions.append(pose_state(wanted.state))
    if wanted.reviewer_id is not None:
        conditions.append(_standing(Review.user_id == wanted.reviewer_id))
    if wanted.bookmarked is not None:
        mine = sa.exists().where(Bookmark.pose_id == Pose.id, Bookmark.user_id == wanted.reader_id)
        conditions.append(mine if wanted.bookmarked else ~mine)
    if wanted.corrected is not None:
        conditions.append(is_corrected() if wanted.corrected else ~is_corrected())
    if wanted.flag is not None:
        quoted = f'"{wanted.flag}"'
        conditions.append(sa.cast(Pose.flags, sa.Text).contains(quoted, autoescape=True))
    return conditions


def _standing(*conditions: sa.ColumnElement[bool]) -> sa.Exists:
    """Whether a pose in a query has a standing review of which some conditions hold."""
    return sa.exists().where(Review.pose_id == Pose.id, STANDING, *conditions)


def pose_state(state: str) -> sa.ColumnElement[bool]:
    """Whether the reviewing of a pose in a query stands at a state; KeyError for an unknown one.

    A disagreement is one that nobody settled.
    """
    other = sa.orm.aliased(Review)
    differ = _standing(
        sa.exists().where(
            other.pose_id == Review.pose_id,
            other.replaced_at.is_(None),
            other.grade != Review.grade,
        )
    )
    settled = _standing(Review.settles.is_(True))
    return {
        UNGRADED: ~_standing(),
        "graded": _standing(),
        "second_opinion": _standing(Review.second_opinion.is_(True)),
        "disagreement": differ & ~settled,
        "settled": settled,
    }[state]


def is_corrected() -> sa.ColumnElement[bool]:
    """Whether a pose in a query has a correction that counts."""
    newer = sa.orm.aliased(Correction)
    return sa.exists().where(
        Correction.pose_id == Pose.id,
        Correction.deleted_at.is_(None),
        ~sa.exists().where(newer.pose_id == Correction.pose_id, newer.version > Correction.version),
    )


def standing_grade() -> sa.ScalarSelect[Grade]:
    """Return the grade that stands for a pose in a query: that of its verdict."""
    return (
        sa.select(Review.grade)
        .where(Review.pose_id == Pose.id, STANDING)
        .order_by(*verdict_order())
        .limit(1)
        .correlate(Pose)
        .scalar_subquery()
    )


def standing_reviews(session: Session, pose_ids: Sequence[int]) -> Mapping[int, Sequence[Review]]:
    """Return the standing reviews of each pose that has any, the one that counts first."""
    rows = session.scalars(_STANDING_REVIEWS, {"ids": pose_ids})
    found: dict[int, list[Review]] = {}
    for review in rows:
        found.setdefault(review.pose_id, []).append(review)
    return found


def beside(
    session: Session, pose_ids: Sequence[int], reader_id: int | None
) -> Mapping[int, Beside]:
    """Return what stands beside each pose for a reader."""
    rows = session.execute(_BESIDE, {"ids": pose_ids, "reader_id": reader_id})
    return {row[0]: Beside(bool(row[1]), row[2], bool(row[3]), row[4] or 0) for row in rows}


def reviews_of(session: Session, pose_id: int) -> Sequence[Review]:
    """Return all reviews of a pose, replaced ones too, oldest first."""
    return session.scalars(
        sa.select(Review).where(Review.pose_id == pose_id).order_by(Review.id)
    ).all()


def vessels(session: Session, mmsis: Iterable[int]) -> Mapping[int, Vessel]:
    """Return what is known of some vessels."""
    rows = session.scalars(_VESSELS, {"mmsis": list(set(mmsis))})
    return {vessel.mmsi: vessel for vessel in rows}


def grade_counts(
    session: Session, run_ids: Collection[int]
) -> Mapping[int, tuple[int, Mapping[Grade, int]]]:
    """Return, for each run, how many poses it has and how many of them stand at each grade.

    The poses of deleted images do not count.
    """
    grade = standing_grade().label("grade")
    graded = (
        sa.select(Pose.run_id, grade)
        .join(Image, Image.id == Pose.image_id)
        .where(Pose.run_id.in_(run_ids), Image.deleted_at.is_(None))
        .subquery()
    )
    rows = session.execute(
        sa.select(graded.c.run_id, graded.c.grade, sa.func.count()).group_by(
            graded.c.run_id, graded.c.grade
        )
    )
    totals = dict.fromkeys(run_ids, 0)
    by_grade: dict[int, dict[Grade, int]] = {run_id: {} for run_id in run_ids}
    for run_id, standing, count in rows:
        totals[run_id] += count
        if standing is not None:
            by_grade[run_id][standing] = count
    return {run_id: (totals[run_id], by_grade[run_id]) for run_id in run_ids}
