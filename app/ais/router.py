"""REST of AIS: recordings in, with what became of every line; the vessels stand beside."""

from typing import Annotated

from fastapi import APIRouter, Query, Response, UploadFile

from app.ais import actions, preview_router, service, vessel_router
from app.ais.form_fields import MappingText, SiteOfFile
from app.ais.schemas import AisFileOut
from app.auth.access import Access, Scope, allowed
from app.dependencies import (
    DatabaseDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)
from app.identities import service as identities

LARGEST_ID = 2**31 - 1
router = APIRouter(prefix="/ais", tags=["AIS"])
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.post(
    "/files",
    status_code=201,
    responses={200: {"model": AisFileOut, "description": "The same bytes were here already"}},
)
def import_ais_file(
    database: DatabaseDep,
    session: SessionDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    response: Response,
    site_id: SiteOfFile = None,
    mapping: MappingText = "",
) -> AisFileOut:
    """Import a recording: AIVDM sentences in all usual wrappings, lines of JSON, or a table.

    It may be plain, gzip or zip; the content tells the format. A plain table has the columns
    `mmsi,time,lat,lon,sog,cog`, then optionally `heading,rot,to_bow,to_stern,to_port,to_starboard,
    name,ship_type`; others are read by their header, or by `mapping` as a preview proposes it. A
    zip holds one recording or several and is one file, its accounting their sum; what else it holds
    is left out and told, and if one is refused, all are. A table whose dates may all have the day
    or the month first is refused until `mapping` says which. The same bytes again answer 200 with
    the same id and change nothing.
    """
    imported = actions.import_upload(
        database, storage, settings, access, file, site_id, actions.mapping_of(mapping)
    )
    if not imported.created:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/ais/files/{imported.file.id}"
    return AisFileOut.of(imported.file, identities.at_site(session, imported.file.site_id))


@router.get("/files")
def list_ais_files(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    site_id: Annotated[int | None, Query(ge=1, le=LARGEST_ID)] = None,
) -> Page[AisFileOut]:
    """List the recordings of the sites one may read, and the shared ones, oldest first."""
    files, cursor = service.list_files(
        session, access.site_ids(Scope.READ), paging, site_id=site_id
    )
    return Page(
        items=[AisFileOut.of(file, identities.at_site(session, file.site_id)) for file in files],
        next_cursor=cursor,
    )


@router.get("/files/{file_id:int}")
def get_ais_file(file_id: int, session: SessionDep, access: Reader) -> AisFileOut:
    """Show a recording with what became of every line."""
    file = service.get_file(session, access.site_ids(Scope.READ), file_id)
    return AisFileOut.of(file, identities.at_site(session, file.site_id))


@router.delete("/files/{file_id:int}", status_code=204)
def delete_ais_file(file_id: int, session: SessionDep, access: Operator) -> None:
    """Delete a recording with its reports; it can be restored for 30 days.

    Its positions are in no list, on no map and in no new run from then on. Poses that were made of
    them stay; `GET /deletions/preview` tells beforehand how many runs go stale.
    """
    file = actions.file_for(session, access, Scope.INGEST, file_id)
    actions.delete_file(session, access, file)


router.include_router(vessel_router.router)
router.include_router(preview_router.router)
