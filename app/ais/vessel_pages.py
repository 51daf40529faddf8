"""The page of a vessel: where it was, what it said of itself, and on which images it is."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.ais import service, vessel_repository
from app.ais.drawing import HEIGHT_PX, WIDTH_PX, draw
from app.ais.moments import Moment
from app.ais.moving_fixes import UNKNOWN, MovingFixes
from app.ais.ship_types import ship_type_name
from app.ais.statics_history import changes
from app.ais.track_doubts import doubts_of
from app.ais.vessel_schemas import VesselOut
from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.domain.ais import FixTimeSource
from app.domain.ais_bulk import SOURCES
from app.domain.plausibility import Doubt
from app.identities import service as identities
from app.identities.shown import title_of
from app.paging import Paging, decode_cursor
from app.reviews import service as reviews
from app.reviews.pose_schemas import PoseImage
from app.tables.ais import AisPosition
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
REPORTS_SHOWN = 50
STATICS_READ = 5_000
APPEARANCES_SHOWN = 12


@router.get("/ais/vessels/{mmsi}")
def show_vessel(
    mmsi: str,
    request: Request,
    session: SessionDep,
    access: Reader,
    before: Annotated[Moment | None, Query(description="Reports before this moment")] = None,
    poses: Annotated[str | None, Query(max_length=64)] = None,
) -> Response:
    """Show a vessel by its MMSI, or by its pseudonym where the caller sees only that."""
    view, number = identities.found(session, mmsi)
    told, readable = view.identities, view.readable
    vessel = VesselOut.of(service.get_vessel(session, readable, number), told)
    track = service.track(session, readable, number, None, None)
    statics = vessel_repository.statics(session, readable, number, STATICS_READ)
    newest_first = vessel_repository.positions_before(
        session, readable, number, before, REPORTS_SHOWN + 1
    )
    shown = newest_first[:REPORTS_SHOWN]
    paging = Paging(limit=APPEARANCES_SHOWN, after=decode_cursor(poses) if poses else None)
    found, next_poses = reviews.appearances(session, readable, paging, number, access.user_id)
    title = title_of(vessel.mmsi, vessel.name)
    return page(
        request,
        "ais/vessel.html",
        crumbs=[{"label": "AIS", "href": "/ais"}, {"label": title}],
        title=title,
        vessel=vessel,
        pseudonyms=told.hidden,
        ship_type=ship_type_name(vessel.ship_type),
        hull=next((said for said in reversed(statics) if said.to_bow_m is not None), None),
        changes=changes(statics, told),
        counts=vessel_repository.counts(session, readable, number),
        positions=shown,
        older=shown[-1].fix_time.isoformat() if len(newest_first) > REPORTS_SHOWN else None,
        before=before,
        doubts=_doubts(number, [position for piece in track.pieces for position in piece]),
        track=track,
        drawing=draw(track),
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        appearances=[(seen, PoseImage.of(seen.pose.image)) for seen in found],
        more_poses=next_poses,
        reviewable=access.site_ids(Scope.REVIEW),
        site_of_map=_one_site(readable, shown),
    )


def _doubts(mmsi: int, positions: Sequence[AisPosition]) -> list[Doubt]:
    if not positions:
        return []
    start: datetime = positions[0].fix_time
    rows = [
        (
            mmsi,
            (position.fix_time - start).total_seconds(),
            position.lat_deg,
            position.lon_deg,
            UNKNOWN if position.sog_kn is None else position.sog_kn,
            UNKNOWN,
            UNKNOWN,
            SOURCES.index(FixTimeSource(position.fix_time_source)),
            0,
        )
        for position in positions
    ]
    return doubts_of(MovingFixes.of(rows, 0.0), start).get(mmsi, [])


def _one_site(readable: frozenset[int] | None, positions: Sequence[AisPosition]) -> int | None:
    """Return a site on whose map the vessel can be seen, if one is known."""
    own = next((row.site_id for row in positions if row.site_id is not None), None)
    return own if own is not None else next(iter(readable or ()), None)
