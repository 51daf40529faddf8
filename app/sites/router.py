"""REST of sites and cameras."""

from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, set_etag
from app.dependencies import Page, PagingDep, SessionDep
from app.sites import actions, service
from app.sites.schemas import CameraIn, CameraOut, CameraPatch, SiteIn, SiteOut, SitePatch

router = APIRouter(route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
Administrator = Annotated[Access, allowed(Scope.ADMIN)]


@router.post("/sites", status_code=201, tags=["sites"])
def create_site(
    data: SiteIn, session: SessionDep, access: Registrar, response: Response
) -> SiteOut:
    """Make a site; needs the scope `register` on all sites."""
    site = actions.create_site(session, access, data)
    set_etag(response, site.version)
    response.headers["Location"] = f"/api/v1/sites/{site.id}"
    return SiteOut.of(site)


@router.get("/sites", tags=["sites"])
def list_sites(session: SessionDep, access: Reader, paging: PagingDep) -> Page[SiteOut]:
    """List the sites the caller may read, oldest first."""
    sites, next_cursor = service.list_sites(session, access.site_ids(Scope.READ), paging)
    return Page(items=[SiteOut.of(site) for site in sites], next_cursor=next_cursor)


@router.get("/sites/{site_id:int}", tags=["sites"])
def get_site(site_id: int, session: SessionDep, access: Reader, response: Response) -> SiteOut:
    """Show a site; its ETag is what an edit sends as If-Match."""
    site = actions.site_for(session, access, Scope.READ, site_id)
    set_etag(response, site.version)
    return SiteOut.of(site)


@router.patch("/sites/{site_id:int}", tags=["sites"], dependencies=[VERSIONED])
def update_site(
    site_id: int,
    data: SitePatch,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
) -> SiteOut:
    """Change a site; fields left out stay."""
    site = actions.site_for(session, access, Scope.REGISTER, site_id)
    check_if_match(request, site.version)
    actions.update_site(session, access, site, data)
    set_etag(response, site.version)
    return SiteOut.of(site)


@router.delete("/sites/{site_id:int}", status_code=204, tags=["sites"], dependencies=[VERSIONED])
def delete_site(site_id: int, request: Request, session: SessionDep, access: Administrator) -> None:
    """Delete a site with its cameras, images and runs; it can be restored for 30 days."""
    site = actions.site_for(session, access, Scope.ADMIN, site_id)
    if "if-match" in request.headers:
        check_if_match(request, site.version)
    actions.delete_site(session, access, site)


@router.post("/cameras", status_code=201, tags=["cameras"])
def create_camera(
    data: CameraIn, session: SessionDep, access: Registrar, response: Response
) -> CameraOut:
    """Make a camera; intrinsics as K or as fx_px, fy_px, cx_px, cy_px."""
    camera = actions.create_camera(session, access, data)
    set_etag(response, camera.version)
    response.headers["Location"] = f"/api/v1/cameras/{camera.id}"
    return CameraOut.of(camera)


@router.get("/cameras", tags=["cameras"])
def list_cameras(
    session: SessionDep, access: Reader, paging: PagingDep, site_id: int | None = None
) -> Page[CameraOut]:
    """List the cameras of the sites the caller may read, or of one of them."""
    cameras, next_cursor = service.list_cameras(
        session, access.site_ids(Scope.READ), site_id, paging
    )
    return Page(items=[CameraOut.of(camera) for camera in cameras], next_cursor=next_cursor)


@router.get("/cameras/{camera_id:int}", tags=["cameras"])
def get_camera(
    camera_id: int, session: SessionDep, access: Reader, response: Response
) -> CameraOut:
    """Show a camera; its ETag is what an edit sends as If-Match."""
    camera = actions.camera_for(session, access, Scope.READ, camera_id)
    set_etag(response, camera.version)
    return CameraOut.of(camera)


@router.patch("/cameras/{camera_id:int}", tags=["cameras"], dependencies=[VERSIONED])
def update_camera(
    camera_id: int,
    data: CameraPatch,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
) -> CameraOut:
    """Change a camera; solved registrations keep the intrinsics they were solved with."""
    camera = actions.camera_for(session, access, Scope.REGISTER, camera_id)
    check_if_match(request, camera.version)
    actions.update_camera(session, access, camera, data)
    set_etag(response, camera.version)
    return CameraOut.of(camera)


@router.delete(
    "/cameras/{camera_id:int}", status_code=204, tags=["cameras"], dependencies=[VERSIONED]
)
def delete_camera(camera_id: int, request: Request, session: SessionDep, access: Registrar) -> None:
    """Delete a camera with its images and runs; it can be restored for 30 days."""
    camera = actions.camera_for(session, access, Scope.REGISTER, camera_id)
    if "if-match" in request.headers:
        check_if_match(request, camera.version)
    actions.delete_camera(session, access, camera)
