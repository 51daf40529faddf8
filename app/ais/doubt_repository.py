"""Reading what a position is judged by: its vessel's reports around it, and where it was heard."""

from collections.abc import Collection, Iterable, Sequence
from datetime import datetime
from functools import lru_cache
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from app.ais.report_repository import Readable, visible
from app.domain.plausibility import NEIGHBOURS
from app.tables.ais import AisFile, AisPosition
from app.tables.sites import Site

FIX_COLUMNS = (
    AisPosition.id,
    AisPosition.mmsi,
    AisPosition.fix_time,
    AisPosition.lat_deg,
    AisPosition.lon_deg,
    AisPosition.sog_kn,
    AisPosition.fix_time_source,
    AisPosition.clock_suspect,
)
_IDS: sa.BindParameter[list[int]] = sa.bindparam("ids", expanding=True)
_FIXES = sa.select(*FIX_COLUMNS).where(AisPosition.id.in_(_IDS))
_Other = aliased(AisPosition)
# Of tables, as nothing hides the rows of an alias by itself.
_files = AisFile.__table__.c
_HIDDEN = sa.union_all(
    sa.select(_files.id).where(~_files.is_whole),
    sa.select(_files.id).where(_files.deleted_at.is_not(None)),
)


def neighbour_rows(
    session: Session, readable: Readable, ids: Sequence[int]
) -> Sequence[tuple[Any, ...]]:
    """Return id, ids of the neighbours (oldest first, empty at a track's ends), lat, lon of site.

    Each neighbour is one step in the index of vessels' times, however long their tracks are.
    """
    return [tuple(row) for row in session.execute(_neighbours(readable), {"ids": ids})]


def track_rows(
    session: Session, readable: Readable, vessels: Collection[int], start: datetime, end: datetime
) -> Iterable[tuple[Any, ...]]:
    """Return `FIX_COLUMNS`, lat and lon of site of what vessels reported in a while, oldest first.

    Of all places: what is far away tells most.
    """
    asked = {"vessels": list(vessels), "start": start, "end": end}
    return (tuple(row) for row in session.execute(_tracks(readable), asked))


@lru_cache(maxsize=256)  # as below
def _tracks(readable: Readable) -> sa.Executable:
    return (
        sa.select(*FIX_COLUMNS, Site.origin_lat_deg, Site.origin_lon_deg)
        .outerjoin(Site, Site.id == AisPosition.site_id)
        .where(
            AisPosition.mmsi.in_(sa.bindparam("vessels", expanding=True)),
            AisPosition.fix_time.between(sa.bindparam("start"), sa.bindparam("end")),
            visible(AisPosition.site_id, readable),
        )
        .order_by(AisPosition.fix_time, AisPosition.id)
    )


def fix_rows(session: Session, ids: Sequence[int]) -> Sequence[tuple[Any, ...]]:
    """Return `FIX_COLUMNS` of positions."""
    return [tuple(row) for row in session.execute(_FIXES, {"ids": ids})]


@lru_cache(maxsize=256)  # making it takes longer than executing it
def _neighbours(readable: Readable) -> sa.Executable:
    before = [_neighbour(readable, steps, earlier=True) for steps in range(NEIGHBOURS)]
    after = [_neighbour(readable, steps, earlier=False) for steps in range(NEIGHBOURS)]
    return (
        sa.select(AisPosition.id, *before[::-1], *after, Site.origin_lat_deg, Site.origin_lon_deg)
        .outerjoin(Site, Site.id == AisPosition.site_id)
        .where(AisPosition.id.in_(_IDS))
    )


def _neighbour(readable: Readable, steps: int, *, earlier: bool) -> sa.ScalarSelect[int]:
    """Return the id of the vessel's report so many steps before or after the outer one."""
    time, outer = _Other.fix_time, AisPosition.fix_time
    return (
        sa.select(_Other.id)
        .where(
            _Other.mmsi == AisPosition.mmsi,
            time < outer if earlier else time > outer,
            visible(_Other.site_id, readable),
            # `visible` asks for whole files of the outer position only.
            sa.func.coalesce(_Other.file_id, 0).not_in(_HIDDEN.scalar_subquery()),
        )
        .order_by(time.desc() if earlier else time)
        .limit(1)
        .offset(steps)
        .correlate(AisPosition)
        .scalar_subquery()
    )
