"""REST of watched folders, dropped photographs and standing runs."""

from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, heed_if_match
from app.dependencies import (
    DatabaseDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)
from app.imagery import actions as imagery
from app.imagery.schemas import ImageOut
from app.imagery.service import Upload
from app.live import actions, folders, standing
from app.live.schemas import DropTokenOut, FolderIn, FolderOut, StandingIn, StandingOut
from app.sites import actions as sites

router = APIRouter(tags=["live"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Ingester = Annotated[Access, allowed(Scope.INGEST)]
Administrator = Annotated[Access, allowed(Scope.ADMIN)]


@router.post("/cameras/{camera_id:int}/drop", status_code=201, responses={200: {"model": ImageOut}})
def drop_image(
    camera_id: int,
    access: Ingester,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    response: Response,
    data: Annotated[bytes, Body(media_type="application/octet-stream")] = b"",
    name: Annotated[str, Query(max_length=255, description="The file's name")] = "",
) -> ImageOut:
    """Drop a photograph as the bare body: 201; the same bytes again: 200 and the same id."""
    upload = Upload(data, name or None)
    image, created = imagery.upload_image(database, storage, settings, access, camera_id, upload)
    response.status_code = 201 if created else 200
    return ImageOut.of(image)


@router.post("/cameras/{camera_id:int}/drop-tokens", status_code=201)
def make_drop_token(
    camera_id: int,
    session: SessionDep,
    access: Ingester,
    days: Annotated[
        int | None,
        Query(
            ge=1,
            le=3650,
            description="How long it lives; left out: a year, or as the token that makes it",
        ),
    ] = None,
) -> DropTokenOut:
    """Make a token that does nothing but drop photographs of this camera; shown this once."""
    camera = sites.camera_for(session, access, Scope.INGEST, camera_id)
    token, text = actions.make_drop_token(session, access, camera, days)
    return DropTokenOut(token=text, camera_id=camera.id, expires_at=token.expires_at)


@router.get("/cameras/{camera_id:int}/watched-folders")
def list_folders(camera_id: int, session: SessionDep, access: Reader) -> Page[FolderOut]:
    """List the folders that are watched for a camera."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    rows = folders.of_camera(session, camera.id)
    return Page(items=[FolderOut.of(row, dict(folders.counts(session, row.id))) for row in rows])


@router.post("/cameras/{camera_id:int}/watched-folders", status_code=201)
def add_folder(
    camera_id: int, data: FolderIn, session: SessionDep, access: Administrator
) -> FolderOut:
    """Watch a folder; for administrators of all sites, because it reads the server's files."""
    return FolderOut.of(actions.add_folder(session, access, camera_id, data), {})


@router.post("/watched-folders/{folder_id:int}/pause", dependencies=[VERSIONED])
def pause_folder(
    folder_id: int, request: Request, session: SessionDep, access: Ingester
) -> FolderOut:
    """Watch a folder no longer for a while."""
    heed_if_match(request, actions.folder_for(session, access, folder_id).version)
    row = actions.pause_folder(session, access, folder_id, paused=True)
    return FolderOut.of(row, dict(folders.counts(session, row.id)))


@router.post("/watched-folders/{folder_id:int}/resume", dependencies=[VERSIONED])
def resume_folder(
    folder_id: int, request: Request, session: SessionDep, access: Ingester
) -> FolderOut:
    """Watch a folder again."""
    heed_if_match(request, actions.folder_for(session, access, folder_id).version)
    row = actions.pause_folder(session, access, folder_id, paused=False)
    return FolderOut.of(row, dict(folders.counts(session, row.id)))


@router.delete("/watched-folders/{folder_id:int}", status_code=204, dependencies=[VERSIONED])
def remove_folder(folder_id: int, request: Request, session: SessionDep, access: Ingester) -> None:
    """Watch a folder no longer; its images stay, and it can be restored for 30 days."""
    heed_if_match(request, actions.folder_for(session, access, folder_id).version)
    actions.remove_folder(session, access, folder_id)


@router.get("/standing-runs")
def list_standing_runs(session: SessionDep, access: Reader, paging: PagingDep) -> Page[StandingOut]:
    """List the standing runs of the sites one may read."""
    rows, cursor = standing.listed(session, access.site_ids(Scope.READ), paging)
    return Page(items=[StandingOut.of(row) for row in rows], next_cursor=cursor)


@router.post("/standing-runs", status_code=201)
def add_standing_run(data: StandingIn, session: SessionDep, access: Ingester) -> StandingOut:
    """Have a viewport's images detected and fused as they come."""
    return StandingOut.of(actions.add_standing(session, access, data))


@router.post("/standing-runs/{standing_id:int}/pause", dependencies=[VERSIONED])
def pause_standing_run(
    standing_id: int, request: Request, session: SessionDep, access: Ingester
) -> StandingOut:
    """Leave new images alone for a while."""
    heed_if_match(request, actions.standing_for(session, access, standing_id).version)
    return StandingOut.of(actions.pause_standing(session, access, standing_id, paused=True))


@router.post("/standing-runs/{standing_id:int}/resume", dependencies=[VERSIONED])
def resume_standing_run(
    standing_id: int, request: Request, session: SessionDep, access: Ingester
) -> StandingOut:
    """Go on, with what came meanwhile."""
    heed_if_match(request, actions.standing_for(session, access, standing_id).version)
    return StandingOut.of(actions.pause_standing(session, access, standing_id, paused=False))


@router.delete("/standing-runs/{standing_id:int}", status_code=204, dependencies=[VERSIONED])
def remove_standing_run(
    standing_id: int, request: Request, session: SessionDep, access: Ingester
) -> None:
    """End a standing run; its run and poses stay, and it can be restored for 30 days."""
    heed_if_match(request, actions.standing_for(session, access, standing_id).version)
    actions.remove_standing(session, access, standing_id)
