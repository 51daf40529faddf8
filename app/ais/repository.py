"""Reading AIS rows part by part, for lists and pages: files, positions, statics, vessels."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.report_repository import Readable, during, visible, within
from app.db import find
from app.paging import Paging, fetch_page
from app.tables.ais import AisFile, AisPosition, AisStatic, Vessel


def files(
    session: Session, readable: Readable, paging: Paging, *, site_id: int | None = None
) -> tuple[Sequence[AisFile], str | None]:
    """Return a part of the list of files, oldest first."""
    statement = sa.select(AisFile).where(visible(AisFile.site_id, readable))
    if site_id is not None:
        statement = statement.where(AisFile.site_id == site_id)
    return fetch_page(session, statement, AisFile.id, paging)


def newest_files(session: Session, readable: Readable, count: int) -> Sequence[AisFile]:
    """Return the files imported last, newest first."""
    statement = sa.select(AisFile).where(visible(AisFile.site_id, readable))
    return session.scalars(statement.order_by(AisFile.id.desc()).limit(count)).all()


def file(session: Session, readable: Readable, file_id: int) -> AisFile | None:
    """Return a file that the caller may read."""
    found = find(session, AisFile, file_id)
    if found is None or not found.is_whole:
        return None
    return found if readable is None or found.site_id in {None, *readable} else None


def file_of_content(session: Session, sha256: str, site_id: int | None) -> AisFile | None:
    """Return the file with these bytes, imported for exactly this site (None: for all)."""
    statement = sa.select(AisFile).where(
        AisFile.is_whole,
        AisFile.sha256 == sha256,
        sa.func.coalesce(AisFile.site_id, 0) == (site_id or 0),
    )
    return session.scalar(statement)


def positions(
    session: Session,
    readable: Readable,
    paging: Paging,
    *,
    mmsi: int | None,
    start: datetime | None,
    end: datetime | None,
    area: Area | None,
) -> tuple[Sequence[AisPosition], str | None]:
    """Return a part of the list of positions that fulfil all given conditions."""
    statement = sa.select(AisPosition).where(
        visible(AisPosition.site_id, readable), *within(start, end, area)
    )
    if mmsi is not None:
        statement = statement.where(AisPosition.mmsi == mmsi)
    return fetch_page(session, statement, AisPosition.id, paging)


def latest_positions(
    session: Session,
    readable: Readable,
    mmsi: int,
    *,
    start: datetime | None,
    end: datetime | None,
    count: int,
) -> Sequence[AisPosition]:
    """Return a vessel's last positions in a time window, newest first."""
    statement = (
        sa.select(AisPosition)
        .where(
            AisPosition.mmsi == mmsi,
            visible(AisPosition.site_id, readable),
            *during(start, end),
        )
        .order_by(AisPosition.fix_time.desc(), AisPosition.id.desc())
        .limit(count)
    )
    return session.scalars(statement).all()


def latest_statics(
    session: Session, readable: Readable, mmsi: int, count: int
) -> Sequence[AisStatic]:
    """Return a vessel's last static reports, newest first."""
    statement = sa.select(AisStatic).where(
        AisStatic.mmsi == mmsi, visible(AisStatic.site_id, readable)
    )
    return session.scalars(
        statement.order_by(AisStatic.received_at.desc(), AisStatic.id.desc()).limit(count)
    ).all()


def vessels(
    session: Session, readable: Readable, paging: Paging, search: str
) -> tuple[Sequence[Vessel], str | None]:
    """Return a part of the list of vessels that have a report the caller may read."""
    statement = sa.select(Vessel).where(_heard(readable))
    if search:
        pattern = f"%{_escaped(search)}%"
        statement = statement.where(
            sa.or_(
                Vessel.name.ilike(pattern, escape="\\"),
                Vessel.callsign.ilike(pattern, escape="\\"),
                sa.cast(Vessel.mmsi, sa.String).like(f"{_escaped(search)}%", escape="\\"),
            )
        )
    return fetch_page(session, statement, Vessel.mmsi, paging)


def all_vessels(session: Session, readable: Readable) -> Sequence[Vessel]:
    """Return all vessels that have a report the caller may read."""
    return session.scalars(sa.select(Vessel).where(_heard(readable))).all()


def vessel(session: Session, readable: Readable, mmsi: int) -> Vessel | None:
    """Return a vessel that has a report the caller may read."""
    return session.scalar(sa.select(Vessel).where(Vessel.mmsi == mmsi, _heard(readable)))


def _heard(readable: Readable) -> sa.ColumnElement[bool]:
    return sa.or_(
        sa.exists().where(AisPosition.mmsi == Vessel.mmsi, visible(AisPosition.site_id, readable)),
        sa.exists().where(AisStatic.mmsi == Vessel.mmsi, visible(AisStatic.site_id, readable)),
    )


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")
