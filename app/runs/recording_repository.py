"""SQL of what runs owe to AIS recordings: whose images lie in the time of one."""

from collections.abc import Collection, Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.ais import AisFile
from app.tables.imagery import Image
from app.tables.runs import Run, RunImage

AROUND = timedelta(seconds=190)  # so far from an image a report may count
_files = AisFile.__table__.c  # of the table, as the deleted are hidden in the class


class Recorded(NamedTuple):
    """The site (None: all) and the time of a recording; `deleted_at` None: it is there."""

    site_id: int | None
    first_at: datetime
    last_at: datetime
    deleted_at: datetime | None


def recorded(session: Session, file_id: int) -> Recorded | None:
    """Return where and when a recording is from; None where it holds no report."""
    return next(iter(_recorded(session, _files.id == file_id)), None)


def deleted(session: Session) -> Sequence[Recorded]:
    """Return the recordings that are deleted, of which there are few or none."""
    return _recorded(session, _files.deleted_at.is_not(None))


def _recorded(session: Session, *conditions: sa.ColumnElement[bool]) -> Sequence[Recorded]:
    statement = sa.select(_files.site_id, _files.first_at, _files.last_at, _files.deleted_at).where(
        _files.first_at.is_not(None), *conditions
    )
    return [Recorded(*row) for row in session.execute(statement)]


def runs_in_time_of(
    session: Session, recording: Recorded, run_ids: Collection[int] | None = None
) -> set[int]:
    """Return which of some runs (None: all) placed vessels in the time of a recording.

    Runs that began after it was deleted did without it.
    """
    statement = (
        sa.select(RunImage.run_id)
        .join(Run, Run.id == RunImage.run_id)
        .join(Image, Image.id == RunImage.image_id)
        .where(
            RunImage.done_at.is_not(None),
            Image.captured_at.between(recording.first_at - AROUND, recording.last_at + AROUND),
        )
        .distinct()
    )
    if recording.site_id is not None:
        statement = statement.where(Run.site_id == recording.site_id)
    if recording.deleted_at is not None:
        statement = statement.where(Run.created_at < recording.deleted_at)
    if run_ids is not None:
        statement = statement.where(Run.id.in_(run_ids))
    return set(session.scalars(statement))
