"""Pages of cameras and their photographs."""

from datetime import datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import RedirectResponse
from pydantic import BaseModel

from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep
from app.errors import Invalid
from app.forms import Form, parse, rejected
from app.imagery import actions, service
from app.imagery.coverage import chart
from app.imagery.repository import ImageFilter
from app.imagery.schemas import file_url, preview_url
from app.paging import Paging
from app.registration import service as registration
from app.registration.overview import NO_IMAGES, lines_of
from app.registration.timeline import draw as draw_timeline
from app.reregistration import service as reregistration
from app.sites import actions as sites
from app.sites.fields import in_zone
from app.tables.imagery import Image
from app.tables.sites import Camera
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Ingester = Annotated[Access, allowed(Scope.INGEST)]
IMAGES_SHOWN = 60
THUMBNAIL_PX = 320
EVERY_VIEWPORT = Paging(limit=1000, after=None)
SITES = {"label": "Sites", "href": "/sites"}


class _Filter(BaseModel):
    begin: datetime | None = None
    end: datetime | None = None


@router.get("/cameras/{camera_id:int}")
def show_camera(
    request: Request,
    camera_id: int,
    session: SessionDep,
    access: Reader,
    after: Annotated[int | None, Query(ge=1, lt=2**31)] = None,
) -> Response:
    """Show a camera: coverage, images, viewports, and the upload."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    entered = {name: request.query_params.get(name, "") for name in ("begin", "end")}
    form = Form(entered)
    try:
        wanted = _wanted(camera, entered)
    except Invalid as error:
        wanted, form = ImageFilter(camera_id=camera.id), rejected(entered, error)
    images = service.images_by_time(session, wanted, after, IMAGES_SHOWN + 1)
    viewports, _ = registration.list_viewports(
        session, access.site_ids(Scope.READ), EVERY_VIEWPORT, camera_id=camera.id
    )
    lines = lines_of(session, viewports)
    spans = service.spans_of_cameras(session, [camera.id])
    total = service.count_images(session, ImageFilter(camera_id=camera.id))
    here = f"/cameras/{camera.id}"
    kept = {name: value for name, value in entered.items() if value}
    shown = images[:IMAGES_SHOWN]
    more = {"after": str(shown[-1].id)} if len(images) > IMAGES_SHOWN else None
    return page(
        request,
        "imagery/camera.html",
        crumbs=[*_crumbs(camera)[:-1], {"label": camera.name}],
        camera=camera,
        site=camera.site,
        images=[(image, preview_url(image, THUMBNAIL_PX)) for image in shown],
        total=total,
        matching=service.count_images(session, wanted),
        coverage=chart(service.hourly_counts(session, camera.id)),
        lines=lines,
        timeline=draw_timeline(lines, spans.get(camera.id, NO_IMAGES)),
        unassigned=total - sum(line.images.count for line in lines),
        movements=reregistration.movements(session, [viewport.id for viewport in viewports]),
        waiting=reregistration.waiting(session, camera.id),
        form=form,
        is_filtered=bool(kept),
        next_href=f"{here}?{urlencode(kept | more)}" if more else "",
        first_href=f"{here}?{urlencode(kept)}" if after else "",
        may_register=access.may(Scope.REGISTER, camera.site_id),
        may_ingest=access.may(Scope.INGEST, camera.site_id),
    )


def _wanted(camera: Camera, entered: dict[str, str]) -> ImageFilter:
    """Read the time filter; moments without a zone are in UTC, as the page shows them."""
    asked = parse(_Filter, entered)
    return ImageFilter(
        camera_id=camera.id,
        begin=None if asked.begin is None else in_zone(asked.begin, "UTC", "begin"),
        end=None if asked.end is None else in_zone(asked.end, "UTC", "end"),
    )


@router.get("/images/{image_id:int}")
def show_image(request: Request, image_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a photograph as large as the screen allows, with its facts."""
    image = actions.image_for(session, access, Scope.READ, image_id)
    earlier, later = service.neighbours(session, image)
    return page(
        request,
        "imagery/image.html",
        crumbs=[*_crumbs(image.camera), {"label": image.file_name}],
        image=image,
        site=image.camera.site,
        file_url=file_url(image),
        preview_url=_large(image),
        earlier=earlier,
        later=later,
        may_delete=access.may(Scope.INGEST, image.site_id),
        may_draw=access.may(Scope.REVIEW, image.site_id),
    )


@router.post("/images/{image_id:int}/delete")
def delete_image(image_id: int, session: SessionDep, access: Ingester) -> Response:
    """Hide a photograph and go back to its camera."""
    image = actions.image_for(session, access, Scope.INGEST, image_id)
    actions.delete_image(session, access, image)
    return RedirectResponse(f"/cameras/{image.camera_id}", status_code=303)


def _large(image: Image) -> str:
    return preview_url(image, 1920)


def _crumbs(camera: Camera) -> list[dict[str, str]]:
    return [
        SITES,
        {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
        {"label": camera.name, "href": f"/cameras/{camera.id}"},
    ]
