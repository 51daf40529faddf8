"""REST of what vessels sent: positions, vessels and tracks, each as the caller may know them.

A vessel is addressed by its MMSI, or by its pseudonym where the caller does not see identities;
addresses and answers of such a caller hold no MMSI. Without `site_id` the answers are about all
sites that show the caller identities; if there is none, about the first that shows pseudonyms.
"""

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query
from sqlalchemy.orm import Session

from app.ais import service
from app.ais.area import Area
from app.ais.doubts import doubts_of
from app.ais.moments import From, To
from app.ais.vessel_list import listed
from app.ais.vessel_schemas import PositionOut, TrackOut, VesselDetailOut, VesselOut
from app.auth.access import Access, Scope, allowed
from app.dependencies import Page, PagingDep, SessionDep
from app.identities import service as identities
from app.identities.service import View
from app.ids import RowId, VesselRef

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
SeenFrom = Annotated[
    RowId | None, Query(description="Only what was heard for this site or for all sites")
]


def _position_filter(
    start: From = None,
    end: To = None,
    bbox: Annotated[
        str | None,
        Query(
            max_length=120,
            description="min_lon,min_lat,max_lon,max_lat; min_lon > max_lon crosses 180 degrees",
            examples=["9.9,53.5,10.1,53.6"],
        ),
    ] = None,
) -> tuple[datetime | None, datetime | None, Area | None]:
    return start, end, Area.parse(bbox) if bbox else None


def _seen(session: Session, access: Access, site_id: int | None) -> View:
    if site_id is not None:
        access.require(Scope.READ, site_id)
    return identities.view(session, site_id)


@router.get("/positions")
def list_positions(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    wanted: Annotated[
        tuple[datetime | None, datetime | None, Area | None], Depends(_position_filter)
    ],
    mmsi: Annotated[VesselRef | None, Query(description="Or the vessel's pseudonym")] = None,
    site_id: SeenFrom = None,
) -> Page[PositionOut]:
    """List positions that fulfil all conditions, in the order they were stored."""
    view = _seen(session, access, site_id)
    number = None
    if mmsi is not None:
        found, number = identities.found(session, mmsi)
        view = view if site_id is not None and not view.identities.hidden else found
    start, end, area = wanted
    positions, cursor = service.list_positions(
        session,
        view.readable,
        paging,
        service.PositionFilter(mmsi=number, start=start, end=end, area=area),
    )
    doubts = doubts_of(session, view.readable, [position.id for position in positions])
    items = [PositionOut.of(position, view.identities, doubts) for position in positions]
    return Page(items=items, next_cursor=cursor)


@router.get("/vessels")
def list_vessels(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    q: Annotated[
        str,
        Query(
            max_length=100,
            description="Part of a name or call sign, start of an MMSI or a pseudonym",
        ),
    ] = "",
    site_id: SeenFrom = None,
) -> Page[VesselOut]:
    """List vessels by MMSI or pseudonym, as last heard of."""
    view = _seen(session, access, site_id)
    vessels, cursor = listed(session, view, paging, q)
    return Page(items=[VesselOut.of(item, view.identities) for item in vessels], next_cursor=cursor)


@router.get("/vessels/{mmsi}", dependencies=[allowed(Scope.READ)])
def get_vessel(mmsi: str, session: SessionDep) -> VesselDetailOut:
    """Show a vessel with its latest static and position report."""
    view, number = identities.found(session, mmsi)
    vessel = service.get_vessel(session, view.readable, number)
    statics = service.latest_statics(session, view.readable, number, 1)
    positions = service.latest_positions(session, view.readable, number, 1)
    return VesselDetailOut.with_latest(
        vessel,
        statics[0] if statics else None,
        positions[0] if positions else None,
        view.identities,
        doubts_of(session, view.readable, [position.id for position in positions]),
    )


@router.get("/vessels/{mmsi}/track", dependencies=[allowed(Scope.READ)])
def get_track(mmsi: str, session: SessionDep, start: From = None, end: To = None) -> TrackOut:
    """Return where a vessel was, as GeoJSON: a line for each piece without a silence of 10 min."""
    view, number = identities.found(session, mmsi)
    return TrackOut.of(service.track(session, view.readable, number, start, end), view.identities)
