"""REST of images."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Form, Query, Request, Response, UploadFile

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.delivery import immutable_headers, is_known, not_modified, send_stream, wanted_part
from app.dependencies import (
    DatabaseDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)
from app.imagery import actions, service
from app.imagery.names import content_disposition
from app.imagery.preview import WIDTHS_PX, snapped_width
from app.imagery.repository import ImageFilter
from app.imagery.schemas import ImageOut
from app.imagery.service import Upload
from app.sites.fields import in_zone

router = APIRouter(tags=["images"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Ingester = Annotated[Access, allowed(Scope.INGEST)]
CaptureTime = Annotated[
    datetime | None,
    Form(description="ISO 8601; without a zone it is in the camera's. Else EXIF, else file name"),
]
BYTES: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/jpeg": {}, "image/png": {}, "image/webp": {}}}
}


@router.post("/images", status_code=201, responses={200: {"model": ImageOut}})
def upload_image(
    file: UploadFile,
    camera_id: Annotated[int, Form()],
    access: Ingester,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    response: Response,
    captured_at: CaptureTime = None,
) -> ImageOut:
    """Upload a photograph: 201; the same bytes again on the same camera: 200 and the same id."""
    data = file.file.read(settings.max_upload_bytes + 1)
    upload = Upload(data, file.filename, captured_at)
    image, created = actions.upload_image(database, storage, settings, access, camera_id, upload)
    response.status_code = 201 if created else 200
    response.headers["Location"] = f"/api/v1/images/{image.id}"
    return ImageOut.of(image)


@router.get("/images")
def list_images(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    camera_id: int | None = None,
    viewport_id: int | None = None,
    begin: Annotated[datetime | None, Query(alias="from", description="UTC without a zone")] = None,
    end: Annotated[datetime | None, Query(alias="to", description="Not included")] = None,
) -> Page[ImageOut]:
    """List images the caller may read, in the order they came in."""
    wanted = ImageFilter(
        site_ids=access.site_ids(Scope.READ),
        camera_id=camera_id,
        viewport_id=viewport_id,
        begin=_utc(begin, "from"),
        end=_utc(end, "to"),
    )
    images, next_cursor = service.list_images(session, wanted, paging)
    return Page(items=[ImageOut.of(image) for image in images], next_cursor=next_cursor)


@router.get("/images/{image_id:int}")
def get_image(image_id: int, session: SessionDep, access: Reader) -> ImageOut:
    """Show an image's facts."""
    return ImageOut.of(actions.image_for(session, access, Scope.READ, image_id))


@router.delete("/images/{image_id:int}", status_code=204)
def delete_image(image_id: int, session: SessionDep, access: Ingester) -> None:
    """Delete an image; for 30 days restoring it or uploading the same bytes brings it back."""
    image = actions.image_for(session, access, Scope.INGEST, image_id)
    actions.delete_image(session, access, image)


@router.get("/images/{image_id:int}/file", response_class=Response, responses=BYTES)
def get_image_file(
    image_id: int, request: Request, session: SessionDep, storage: StorageDep, access: Reader
) -> Response:
    """Send the photograph's own bytes; one Range at a time."""
    image = actions.image_for(session, access, Scope.READ, image_id)
    headers = immutable_headers(f'"{image.sha256}"', content_disposition(image.file_name))
    if is_known(request, headers["ETag"]):
        return not_modified(headers)
    part = wanted_part(request, image.size_bytes, headers["ETag"])
    stream = service.open_file(storage, image)
    return send_stream(stream, part, image.size_bytes, image.media_type, headers)


@router.get("/images/{image_id:int}/preview", response_class=Response, responses=BYTES)
def get_image_preview(
    image_id: int,
    request: Request,
    session: SessionDep,
    storage: StorageDep,
    access: Reader,
    width: Annotated[int, Query(ge=1, description=f"Rounded up to one of {WIDTHS_PX}")] = 1280,
) -> Response:
    """Send a smaller JPEG of the photograph."""
    image = actions.image_for(session, access, Scope.READ, image_id)
    width_px = snapped_width(width)
    name = f"{image.file_name.rpartition('.')[0] or image.file_name}-{width_px}.jpg"
    headers = immutable_headers(f'"{image.sha256}-{width_px}"', content_disposition(name))
    if is_known(request, headers["ETag"]):
        return not_modified(headers)
    data = service.preview(storage, image, width_px)
    return Response(data, media_type="image/jpeg", headers=headers)


def _utc(moment: datetime | None, field: str) -> datetime | None:
    return None if moment is None else in_zone(moment, "UTC", field)
