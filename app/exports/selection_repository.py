"""SQL of what an export selects: first only ids, of which a million fit into a few megabytes.

All else is read by primary key afterwards, so that no filter makes a plan that sorts or scans the
wide rows. Core tables are asked, not mapped classes: what is deleted is left out here by name.
"""

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.exports.driver_rows import driver_parts
from app.exports.filters import UNGRADED, ExportFilters
from app.exports.id_lists import among
from app.exports.verdict_repository import counted_grade, pose_state, standing_review
from app.tables.imagery import Image
from app.tables.reviews import Correction, Review
from app.tables.runs import Pose, RemovedPose, Run

ROWS_AT_ONCE = 20_000
IDS_AT_ONCE = 5000
# A transaction that was under way then may have ended after what it wrote was dated.
OVERLAP = timedelta(minutes=1)
_BEGINNING = datetime(1970, 1, 1, tzinfo=UTC)
_poses, _runs, _images = (each.__table__.c for each in (Pose, Run, Image))
_reviews, _corrections = Review.__table__.c, Correction.__table__.c
_removed = RemovedPose.__table__.c
_PRESENT = (_images.deleted_at.is_(None), _runs.deleted_at.is_(None))
Ids = npt.NDArray[np.int64]


def _with_run_and_image(poses: sa.FromClause) -> sa.Join:
    return sa.join(
        sa.join(poses, Run.__table__, _runs.id == poses.c.run_id),
        Image.__table__,
        _images.id == poses.c.image_id,
    )


_JOINED = _with_run_and_image(Pose.__table__)
_REMOVED_JOINED = _with_run_and_image(RemovedPose.__table__)


@dataclass(frozen=True, slots=True)
class Chosen:
    """The selected poses by id: with photograph, run and vessel, row by row."""

    pose_ids: Ids
    image_ids: Ids
    run_ids: Ids
    mmsis: Ids


class PoseSelection:
    """The poses that an export's filters select, of the sites it may take them from."""

    def __init__(
        self, filters: ExportFilters, site_ids: Sequence[int] | None, mmsi: int | None
    ) -> None:
        self._filters = filters
        self._site_ids = site_ids
        self._changed_ids: Ids | None = None
        self._conditions = [
            *_PRESENT,
            *_scope(filters, site_ids, Pose.__table__),
            *_conditions(filters, mmsi),
        ]

    def chosen(self, session: Session, at_most: int | None = None) -> Chosen:
        """Read which poses are selected, or the first of them."""
        values = array("q")
        for statement in self._statements(session):
            wanted = None if at_most is None else at_most - len(values) // 4
            for some in driver_parts(session, statement.limit(wanted), ROWS_AT_ONCE):
                values.extend(chain.from_iterable(some))
        columns = np.frombuffer(values, np.int64).reshape(-1, 4).T
        return Chosen(*map(np.ascontiguousarray, columns))

    def _statements(self, session: Session) -> Iterator[sa.Select[Any]]:
        """Give the queries of ids, in order: of what changed, or one of all."""
        statement = (
            sa.select(_poses.id, _poses.image_id, _poses.run_id, _poses.mmsi)
            .select_from(_JOINED)
            .where(*self._conditions)
            .order_by(_poses.id)
        )
        if self._filters.updated_since is None:
            yield statement
            return
        for some in self._changed(session):
            yield statement.where(among(_poses.id, some))

    def _changed(self, session: Session) -> Iterator[list[int]]:
        """Give the ids of the poses that changed, in order, so many at a time."""
        if self._filters.updated_since is None:
            return
        if self._changed_ids is None:
            self._changed_ids = changed_since(session, self._filters.updated_since)
        for start in range(0, len(self._changed_ids), IDS_AT_ONCE):
            yield self._changed_ids[start : start + IDS_AT_ONCE].tolist()

    def gone(self, session: Session, chosen: Chosen) -> Iterator[int]:
        """Give the ids that changed and are not selected (any more), in order."""
        moment = self._filters.updated_since
        if moment is None:
            return
        scope = list(_scope(self._filters, self._site_ids, Pose.__table__))
        hidden = sa.select(_poses.id).select_from(_JOINED).where(*scope)
        ids = array("q")
        for some in self._changed(session):
            ids.extend(session.scalars(hidden.where(among(_poses.id, some))))
        removed = (
            sa.select(_removed.pose_id)
            .select_from(_REMOVED_JOINED)
            .where(
                _removed.removed_at >= _with_overlap(moment),
                *_scope(self._filters, self._site_ids, RemovedPose.__table__),
            )
        )
        ids.extend(session.scalars(removed))
        yield from np.setdiff1d(np.frombuffer(ids, np.int64), chosen.pose_ids).tolist()


def changed_since(session: Session, moment: datetime) -> Ids:
    """Return the poses that were made, judged, corrected or hidden since a moment, in order.

    A pose's line is made of nothing else that changes: box, match and registration stay.

    Each of the parts is an index's range, so that it costs what changed and not what there is.
    Runs are looked up before: joined to their poses, databases rather read all poses.
    """
    since = _with_overlap(moment)
    runs = session.scalars(sa.select(_runs.id).where(_runs.changed_at >= since)).all()
    of_review, of_correction = _reviews.pose_id.label("id"), _corrections.pose_id.label("id")
    of_pose = _poses.id.label("id")
    parts = [
        sa.select(of_pose).where(_poses.created_at >= since),
        sa.select(of_pose).where(_poses.changed_at >= since),
        sa.select(of_review).where(_reviews.created_at >= since),
        sa.select(of_review).where(_reviews.replaced_at >= since),
        sa.select(of_review).where(_reviews.words_at >= since),
        sa.select(of_correction).where(_corrections.created_at >= since),
        sa.select(of_correction).where(_corrections.deleted_at >= since),
        sa.select(of_pose)
        .join(Image.__table__, _images.id == _poses.image_id)
        .where(_images.changed_at >= since),
    ]
    if runs:
        parts.append(sa.select(of_pose).where(among(_poses.run_id, sorted(runs))))
    found = array("q")
    for some in driver_parts(session, sa.union_all(*parts), ROWS_AT_ONCE):
        found.extend(chain.from_iterable(some))
    return np.unique(np.frombuffer(found, np.int64))


def _with_overlap(moment: datetime) -> datetime:
    return max(moment, _BEGINNING) - OVERLAP


def _scope(
    filters: ExportFilters, site_ids: Sequence[int] | None, poses: sa.FromClause
) -> Iterator[sa.ColumnElement[bool]]:
    """Give the conditions that hold for a pose for ever, so also for one that is gone."""
    if site_ids is not None:
        yield _runs.site_id.in_(list(site_ids))
    for column, value in (
        (poses.c.run_id, filters.run_id),
        (_runs.site_id, filters.site_id),
        (_images.camera_id, filters.camera_id),
        (_runs.viewport_id, filters.viewport_id),
        (poses.c.image_id, filters.image_id),
        (poses.c.person_made, filters.person_made),
    ):
        if value is not None:
            yield column == value


def _conditions(filters: ExportFilters, mmsi: int | None) -> Iterator[sa.ColumnElement[bool]]:
    if mmsi is not None:
        yield _of_vessel(mmsi, corrected=filters.poses == "corrected")
    if filters.since is not None:
        yield _images.captured_at >= filters.since
    if filters.until is not None:
        yield _images.captured_at < filters.until
    if filters.grade:
        yield _graded(filters.grade, filters.verdict or "standing")
    if filters.state is not None:
        yield pose_state(_poses.id, filters.state)
    if filters.reviewer is not None:
        yield standing_review(_poses.id, _reviews.user_id == filters.reviewer)
    if filters.flag is not None:
        yield sa.cast(_poses.flags, sa.Text).contains(f'"{filters.flag}"', autoescape=True)
    if filters.corrected is not None:
        yield _is_corrected() if filters.corrected else ~_is_corrected()
    yield from _ranged(filters)


def _ranged(filters: ExportFilters) -> Iterator[sa.ColumnElement[bool]]:
    distance_m2 = sum(
        _poses.centroid_in_cam_m[axis].as_float() * _poses.centroid_in_cam_m[axis].as_float()
        for axis in range(3)
    )
    if filters.range_min_m is not None:
        yield distance_m2 >= filters.range_min_m**2
    if filters.range_max_m is not None:
        yield distance_m2 <= filters.range_max_m**2


def _graded(grades: Sequence[str], verdict: str) -> sa.ColumnElement[bool]:
    wanted = [grade for grade in grades if grade != UNGRADED]
    grade = counted_grade(_poses.id, verdict)
    conditions = [grade.in_(wanted)] if wanted else []
    if UNGRADED in grades:
        conditions.append(grade.is_(None))
    return sa.or_(*conditions)


def _of_vessel(mmsi: int, *, corrected: bool) -> sa.ColumnElement[bool]:
    """Whether a pose is of a vessel; with corrections, whether it is written as of that one."""
    if not corrected:
        return _poses.mmsi == mmsi
    newest = (
        sa.select(_corrections.mmsi)
        .where(_corrections.pose_id == _poses.id, _newest_and_kept())
        .scalar_subquery()
    )
    return sa.func.coalesce(newest, _poses.mmsi) == mmsi


def _is_corrected() -> sa.Exists:
    return sa.exists().where(_corrections.pose_id == _poses.id, _newest_and_kept())


def _newest_and_kept() -> sa.ColumnElement[bool]:
    newer = Correction.__table__.alias()
    later = sa.exists().where(
        newer.c.pose_id == _corrections.pose_id, newer.c.version > _corrections.version
    )
    return _corrections.deleted_at.is_(None) & ~later
