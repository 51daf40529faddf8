"""REST of AIS: recordings in; positions, vessels and tracks out."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Form, Query, Response, UploadFile
from pydantic import AfterValidator

from app.ais import actions, service
from app.ais.area import Area
from app.ais.schemas import AisFileOut, PositionOut, TrackOut, VesselDetailOut, VesselOut
from app.auth.access import Access, Scope, allowed
from app.dependencies import (
    DatabaseDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)

LARGEST_ID = 2**31 - 1
router = APIRouter(prefix="/ais", tags=["AIS"])
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


def _in_utc(moment: datetime) -> datetime:
    try:
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).astimezone(UTC)
    except OverflowError as error:
        raise ValueError("give a moment between the years 1 and 9999 in UTC") from error


Moment = Annotated[datetime, AfterValidator(_in_utc)]
From = Annotated[Moment | None, Query(alias="from", description="ISO 8601; UTC without a zone")]
To = Annotated[Moment | None, Query(alias="to", description="ISO 8601; UTC without a zone")]
Mmsi = Annotated[int | None, Query(ge=0, le=service.LARGEST_MMSI)]


SiteOfFile = Annotated[
    int | None, Form(description="Left out: for all sites, or for the only one you may")
]
MappingText = Annotated[
    str,
    Form(
        max_length=10_000,
        description="How to read a table, as JSON: what a preview proposed, or changed",
    ),
]


@router.post(
    "/files",
    status_code=201,
    responses={200: {"model": AisFileOut, "description": "The same bytes were here already"}},
)
def import_file(
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    response: Response,
    site_id: SiteOfFile = None,
    mapping: MappingText = "",
) -> AisFileOut:
    """Import a recording: AIVDM sentences in all usual wrappings, or a table; plain, gzip or zip.

    The content tells the format. A table has the columns `mmsi,time,lat,lon,sog,cog`, then
    optionally `heading,rot,to_bow,to_stern,to_port,to_starboard,name,ship_type`. A zip holds one
    recording or several and is one file, its accounting their sum; if one is refused, all are. The
    same bytes again answer 200 with the same id and change nothing.
    """
    imported = actions.import_upload(
        database, storage, settings, access, file, site_id, actions.mapping_of(mapping)
    )
    if not imported.created:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/ais/files/{imported.file.id}"
    return AisFileOut.of(imported.file)


@router.get("/files")
def list_files(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    site_id: Annotated[int | None, Query(ge=1, le=LARGEST_ID)] = None,
) -> Page[AisFileOut]:
    """List the recordings of the sites one may read, and the shared ones, oldest first."""
    files, cursor = service.list_files(
        session, access.site_ids(Scope.READ), paging, site_id=site_id
    )
    return Page(items=[AisFileOut.of(file) for file in files], next_cursor=cursor)


@router.get("/files/{file_id:int}")
def get_file(file_id: int, session: SessionDep, access: Reader) -> AisFileOut:
    """Show a recording with what became of every line."""
    return AisFileOut.of(service.get_file(session, access.site_ids(Scope.READ), file_id))


def _position_filter(
    mmsi: Mmsi = None,
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
) -> service.PositionFilter:
    area = Area.parse(bbox) if bbox else None
    return service.PositionFilter(mmsi=mmsi, start=start, end=end, area=area)


@router.get("/positions")
def list_positions(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    wanted: Annotated[service.PositionFilter, Depends(_position_filter)],
) -> Page[PositionOut]:
    """List positions that fulfil all conditions, in the order they were stored."""
    positions, cursor = service.list_positions(session, access.site_ids(Scope.READ), paging, wanted)
    items = [PositionOut.model_validate(position) for position in positions]
    return Page(items=items, next_cursor=cursor)


@router.get("/vessels")
def list_vessels(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    q: Annotated[
        str, Query(max_length=100, description="Part of a name or call sign, start of an MMSI")
    ] = "",
) -> Page[VesselOut]:
    """List vessels by MMSI, as last heard of."""
    vessels, cursor = service.list_vessels(session, access.site_ids(Scope.READ), paging, q)
    return Page(items=[VesselOut.model_validate(item) for item in vessels], next_cursor=cursor)


@router.get("/vessels/{mmsi:int}")
def get_vessel(mmsi: int, session: SessionDep, access: Reader) -> VesselDetailOut:
    """Show a vessel with its latest static and position report."""
    readable = access.site_ids(Scope.READ)
    vessel = service.get_vessel(session, readable, mmsi)
    statics = service.latest_statics(session, readable, mmsi, 1)
    positions = service.latest_positions(session, readable, mmsi, 1)
    return VesselDetailOut.with_latest(
        vessel, statics[0] if statics else None, positions[0] if positions else None
    )


@router.get("/vessels/{mmsi:int}/track")
def get_track(
    mmsi: int, session: SessionDep, access: Reader, start: From = None, end: To = None
) -> TrackOut:
    """Return where a vessel was, as GeoJSON: a line for each piece without a silence of 10 min."""
    return TrackOut.of(service.track(session, access.site_ids(Scope.READ), mmsi, start, end))
