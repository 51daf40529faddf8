"""SQL of AIS coverage: the days with images, a day's images, and what was heard around them."""

from collections.abc import Iterable, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.map_repository import AT_ONCE, seconds_since_1970
from app.ais.report_repository import Readable, visible, within
from app.tables.ais import AisFile, AisPosition
from app.tables.feeds import AisFeed
from app.tables.imagery import Image
from app.tables.sites import Camera

Heard = tuple[float, int, float, float, int | None, int | None, bool | None]
Pictured = tuple[int, datetime, str, int | None]


def image_days(session: Session, site_id: int, count: int) -> Sequence[tuple[str, int]]:
    """Return the last days (UTC) with images and how many each has, newest first."""
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    day = (
        sa.func.strftime("%Y-%m-%d", Image.captured_at)
        if is_sqlite
        else sa.func.to_char(sa.func.timezone("UTC", Image.captured_at), "YYYY-MM-DD")
    )
    rows = session.execute(
        sa.select(day.label("day"), sa.func.count(Image.id))
        .where(Image.site_id == site_id, Image.deleted_at.is_(None))
        .group_by("day")
        .order_by(sa.desc("day"))
        .limit(count)
    )
    return [(row[0], row[1]) for row in rows]


def images(
    session: Session, site_id: int, start: datetime, end: datetime, most: int
) -> Sequence[Pictured]:
    """Return a site's images of a stretch of time, oldest first: id, moment, camera, viewport."""
    rows = session.execute(
        sa.select(Image.id, Image.captured_at, Camera.name, Image.viewport_id)
        .join(Camera, Camera.id == Image.camera_id)
        .where(
            Image.site_id == site_id,
            Image.deleted_at.is_(None),
            Image.captured_at >= start,
            Image.captured_at < end,
        )
        .order_by(Image.captured_at, Image.id)
        .limit(most)
    )
    return rows.all()


def heard(
    session: Session, readable: Readable, start: datetime, end: datetime, area: Area
) -> Iterable[Heard]:
    """Return positions, oldest first: seconds since 1970, MMSI, place, file, feed, clock."""
    statement = (
        sa.select(
            seconds_since_1970(session),
            AisPosition.mmsi,
            AisPosition.lat_deg,
            AisPosition.lon_deg,
            AisPosition.file_id,
            AisPosition.feed_id,
            AisPosition.clock_suspect,
        )
        .where(visible(AisPosition.site_id, readable), *within(start, end, area))
        .order_by(AisPosition.fix_time)
    )
    return session.execute(statement.execution_options(yield_per=AT_ONCE))


def is_anything_heard(session: Session, readable: Readable, start: datetime, end: datetime) -> bool:
    """Whether there is any position in a stretch of time."""
    statement = sa.select(AisPosition.id).where(
        visible(AisPosition.site_id, readable), *within(start, end, None)
    )
    return session.scalar(statement.limit(1)) is not None


def files(session: Session, file_ids: Iterable[int]) -> Sequence[AisFile]:
    """Return some recordings."""
    return session.scalars(sa.select(AisFile).where(AisFile.id.in_(list(file_ids)))).all()


def feeds(session: Session, feed_ids: Iterable[int]) -> Sequence[AisFeed]:
    """Return some feeds."""
    return session.scalars(sa.select(AisFeed).where(AisFeed.id.in_(list(feed_ids)))).all()
