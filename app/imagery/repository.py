"""The SQL of images."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.db import find
from app.imagery.span import ImageSpan
from app.paging import Paging, fetch_page
from app.tables.clock import ClockOffset
from app.tables.deletion import WITH_DELETED
from app.tables.imagery import Image
from app.tables.runs import Run, RunImage
from app.tables.sites import Camera, Viewport


@dataclass(frozen=True, slots=True)
class ImageFilter:
    """Which images are wanted; empty fields do not filter. The time range is half open."""

    site_ids: frozenset[int] | None = None
    camera_id: int | None = None
    viewport_id: int | None = None
    begin: datetime | None = None
    end: datetime | None = None

    def apply(self, statement: sa.Select[Any]) -> sa.Select[Any]:
        """Narrow a statement on images to those wanted, without the deleted ones."""
        statement = statement.where(Image.deleted_at.is_(None))
        if self.site_ids is not None:
            statement = statement.where(Image.site_id.in_(self.site_ids))
        if self.camera_id is not None:
            statement = statement.where(Image.camera_id == _wide(self.camera_id))
        if self.viewport_id is not None:
            statement = statement.where(Image.viewport_id == _wide(self.viewport_id))
        if self.begin is not None:
            statement = statement.where(Image.captured_at >= self.begin)
        if self.end is not None:
            statement = statement.where(Image.captured_at < self.end)
        return statement


def _wide(identifier: int) -> sa.ColumnElement[int]:
    return sa.literal(identifier, sa.BigInteger())


def image(session: Session, image_id: int) -> Image | None:
    """Return an image that is not deleted."""
    found = find(session, Image, image_id)
    return found if found is not None and found.deleted_at is None else None


def by_content(session: Session, camera_id: int, sha256: str) -> Image | None:
    """Return a camera's image with these bytes, deleted or not."""
    return session.scalar(
        sa.select(Image).where(Image.camera_id == camera_id, Image.sha256 == sha256),
        execution_options=WITH_DELETED,
    )


def insert(session: Session, values: dict[str, Any]) -> int | None:
    """Add an image unless its camera has these bytes; returns its id, or None when it has."""
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    statement = (sqlite if is_sqlite else postgresql).insert(Image).values(**values)
    inserted: int | None = session.scalar(
        statement.on_conflict_do_nothing(index_elements=["camera_id", "sha256"]).returning(Image.id)
    )
    return inserted


def offsets_in_force(session: Session, camera_id: int) -> Sequence[ClockOffset]:
    """Return the offsets of a camera's clock that were not undone, newest first."""
    return session.scalars(
        sa.select(ClockOffset)
        .where(ClockOffset.camera_id == camera_id, ClockOffset.undone_at.is_(None))
        .order_by(ClockOffset.id.desc())
    ).all()


def share_camera(session: Session, camera_id: int) -> None:
    """Keep a camera's viewports as they are until this transaction ends (Postgres)."""
    session.execute(sa.select(Camera.id).where(Camera.id == camera_id).with_for_update(read=True))


def viewport_at(session: Session, camera_id: int, moment: datetime) -> int | None:
    """Return the viewport a camera had at a moment."""
    return session.scalar(
        sa.select(Viewport.id)
        .where(
            Viewport.camera_id == camera_id,
            sa.or_(Viewport.valid_from.is_(None), Viewport.valid_from <= moment),
            sa.or_(Viewport.valid_until.is_(None), Viewport.valid_until > moment),
        )
        .limit(1)
    )


def assign_viewports(session: Session, camera_id: int) -> None:
    """Give all images of a camera the viewport that was valid when they were taken."""
    viewport = (
        sa.select(Viewport.id)
        .where(
            Viewport.camera_id == Image.camera_id,
            Viewport.deleted_at.is_(None),  # inside an update no query leaves it out
            sa.or_(Viewport.valid_from.is_(None), Viewport.valid_from <= Image.captured_at),
            sa.or_(Viewport.valid_until.is_(None), Viewport.valid_until > Image.captured_at),
        )
        .limit(1)
        .scalar_subquery()
    )
    session.execute(
        sa.update(Image)
        .where(Image.camera_id == camera_id)
        .values(viewport_id=viewport)
        .execution_options(synchronize_session=False)
    )


def mark_runs(session: Session, camera_id: int) -> None:
    """Say of each run of a camera whether times or viewports of its images were changed since."""
    changed = sa.exists().where(
        RunImage.run_id == Run.id,
        Image.id == RunImage.image_id,
        sa.or_(
            Image.captured_at != RunImage.captured_at,
            Image.viewport_id.is_distinct_from(Run.viewport_id),
        ),
    )
    of_camera = sa.select(Viewport.id).where(Viewport.camera_id == camera_id)
    session.execute(
        sa.update(Run)
        .where(Run.viewport_id.in_(of_camera))
        .values(has_changed_images=changed)
        .execution_options(synchronize_session=False)
    )


def images(
    session: Session, wanted: ImageFilter, paging: Paging
) -> tuple[Sequence[Image], str | None]:
    """Return a page of images in the order they came in."""
    return fetch_page(session, wanted.apply(sa.select(Image)), Image.id, paging)


def images_by_time(
    session: Session, wanted: ImageFilter, after: Image | None, limit: int
) -> Sequence[Image]:
    """Return up to `limit` images in order of their time, those after an image."""
    statement = wanted.apply(sa.select(Image))
    if after is not None:
        statement = statement.where(
            sa.tuple_(Image.captured_at, Image.id)
            > sa.tuple_(sa.literal(after.captured_at, Image.captured_at.type), sa.literal(after.id))
        )
    return session.scalars(statement.order_by(Image.captured_at, Image.id).limit(limit)).all()


def count(session: Session, wanted: ImageFilter) -> int:
    """Count images."""
    return session.scalar(wanted.apply(sa.select(sa.func.count()).select_from(Image))) or 0


def spans(
    session: Session, group: sa.orm.InstrumentedAttribute[Any], ids: Iterable[int]
) -> dict[int, ImageSpan]:
    """Count the images of cameras or viewports (`group` is a column of Image), with their span."""
    statement = (
        sa.select(
            group, sa.func.count(), sa.func.min(Image.captured_at), sa.func.max(Image.captured_at)
        )
        .where(group.in_(list(ids)), Image.deleted_at.is_(None))
        .group_by(group)
    )
    return {row[0]: ImageSpan(row[1], row[2], row[3]) for row in session.execute(statement)}


def neighbour(session: Session, image: Image, *, later: bool) -> int | None:
    """Return the image of the same camera taken just before or after one."""
    here = sa.tuple_(sa.literal(image.captured_at, Image.captured_at.type), sa.literal(image.id))
    place = sa.tuple_(Image.captured_at, Image.id)
    order = (Image.captured_at, Image.id)
    found: int | None = session.scalar(
        ImageFilter(camera_id=image.camera_id)
        .apply(sa.select(Image.id))
        .where(place > here if later else place < here)
        .order_by(*(order if later else (column.desc() for column in order)))
        .limit(1)
    )
    return found


def hourly_counts(session: Session, camera_id: int) -> Sequence[tuple[str, int]]:
    """Count a camera's images by hour in UTC: (`YYYY-MM-DD HH`, count), in order."""
    if session.get_bind().dialect.name == "sqlite":
        hour = sa.func.strftime("%Y-%m-%d %H", Image.captured_at)
    else:
        utc = sa.func.timezone("UTC", Image.captured_at)
        hour = sa.func.to_char(utc, "YYYY-MM-DD HH24")
    statement = ImageFilter(camera_id=camera_id).apply(sa.select(hour, sa.func.count(Image.id)))
    return [(row[0], row[1]) for row in session.execute(statement.group_by(hour).order_by(hour))]
