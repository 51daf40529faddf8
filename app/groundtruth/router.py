"""REST of ground truth in two dimensions: boxes, the photographs they are of, COCO in and out."""

import json
from typing import Annotated

from fastapi import APIRouter, Form, Query, Request, Response, UploadFile
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, set_etag
from app.dependencies import DatabaseDep, Page, PagingDep, SessionDep, SettingsDep
from app.errors import Invalid
from app.groundtruth import actions, exporting, service
from app.groundtruth.importing import ImportChoices
from app.groundtruth.repository import BoxFilters, ImageFilters
from app.groundtruth.schemas import (
    BoxIn,
    BoxOut,
    BoxPatch,
    GroundTruthFileOut,
    GroundTruthImageOut,
    ImageIn,
    ImagePatch,
    ImportedOut,
    LinkedOut,
    LinkIn,
    LookedOut,
    SceneImage,
    SceneOut,
)
from app.ids import RowId
from app.imagery import service as imagery
from app.imagery.schemas import file_url, preview_url
from app.sites import service as sites
from app.tables.groundtruth import GroundTruthImage, VesselClass

router = APIRouter(tags=["ground truth"], prefix="/ground-truth", route_class=IdempotentRoute)
PREVIEW_PX = 1280
Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
Operator = Annotated[Access, allowed(Scope.INGEST)]
Exporter = Annotated[Access, allowed(Scope.EXPORT)]


@router.get("/boxes")
def list_ground_truth_boxes(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    site_id: RowId | None = None,
    image_id: Annotated[RowId | None, Query(description="Of this photograph")] = None,
    ground_truth_image_id: RowId | None = None,
    file_id: Annotated[RowId | None, Query(description="Of this imported file")] = None,
    vessel_class: VesselClass | None = None,
) -> Page[BoxOut]:
    """List the boxes that people drew or imported, oldest first."""
    wanted = BoxFilters(
        access.site_ids(Scope.READ), site_id, image_id, ground_truth_image_id, file_id, vessel_class
    )
    found, cursor = service.list_boxes(session, wanted, paging)
    return Page(items=[BoxOut.of(box) for box in found], next_cursor=cursor)


@router.post("/boxes", status_code=201)
def add_box(body: BoxIn, session: SessionDep, access: Reviewer, response: Response) -> BoxOut:
    """Draw a box in a photograph, or in a ground truth image that is absent here."""
    if body.image_id is not None:
        access.require(Scope.REVIEW, imagery.get_image(session, body.image_id).site_id)
        image, _ = service.image_of_photograph(session, body.image_id)
    else:
        image = actions.image_for(session, access, Scope.REVIEW, body.ground_truth_image_id or 0)
    place = body.model_dump(include={"x1_px", "y1_px", "x2_px", "y2_px"})
    box = actions.add_box(session, access, image, place, body.vessel_class, is_crowd=body.is_crowd)
    set_etag(response, box.version)
    response.headers["Location"] = f"/api/v1/ground-truth/boxes/{box.id}"
    return BoxOut.of(box)


@router.get("/boxes/{box_id:int}")
def get_box(box_id: int, session: SessionDep, access: Reader, response: Response) -> BoxOut:
    """Return a box."""
    box = actions.box_for(session, access, Scope.READ, box_id)
    set_etag(response, box.version)
    return BoxOut.of(box)


@router.patch("/boxes/{box_id:int}", dependencies=[VERSIONED])
def change_box(
    box_id: int,
    body: BoxPatch,
    request: Request,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> BoxOut:
    """Move a box or give it another class; say in `If-Match` which version."""
    box = actions.box_for(session, access, Scope.REVIEW, box_id)
    check_if_match(request, box.version)
    actions.change_box(session, access, box, body.changes())
    set_etag(response, box.version)
    return BoxOut.of(box)


@router.delete("/boxes/{box_id:int}", status_code=204, dependencies=[VERSIONED])
def delete_box(box_id: int, request: Request, session: SessionDep, access: Reviewer) -> None:
    """Take a box away; say in `If-Match` which version. It can be brought back."""
    box = actions.box_for(session, access, Scope.REVIEW, box_id)
    check_if_match(request, box.version)
    actions.delete_box(session, access, box)


@router.post("/boxes/{box_id:int}/restore")
def restore_box(box_id: int, session: SessionDep, access: Reviewer, response: Response) -> BoxOut:
    """Bring a deleted box back."""
    box = actions.box_for(session, access, Scope.REVIEW, box_id, deleted=True)
    actions.restore_box(session, access, box)
    set_etag(response, box.version)
    return BoxOut.of(box)


@router.get("/images")
def list_ground_truth_images(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    site_id: RowId | None = None,
    image_id: Annotated[RowId | None, Query(description="Of this photograph")] = None,
    file_id: Annotated[RowId | None, Query(description="Of this imported file")] = None,
    complete: Annotated[bool | None, Query(description="Every vessel has its box")] = None,
    here: Annotated[bool | None, Query(description="Its photograph is here")] = None,
) -> Page[GroundTruthImageOut]:
    """List the photographs that people drew in, absent ones too, oldest first."""
    wanted = ImageFilters(access.site_ids(Scope.READ), site_id, image_id, file_id, complete, here)
    found, cursor = service.list_images(session, wanted, paging)
    boxes = service.count_boxes(session, found)
    return Page(
        items=[GroundTruthImageOut.of(image, boxes.get(image.id, 0)) for image in found],
        next_cursor=cursor,
    )


@router.post(
    "/images",
    status_code=201,
    responses={200: {"model": GroundTruthImageOut, "description": "Somebody drew in it before"}},
)
def add_ground_truth_image(
    body: ImageIn, session: SessionDep, access: Reviewer, response: Response
) -> GroundTruthImageOut:
    """Make a photograph ground truth, with boxes or without: nothing to see is a truth, too."""
    access.require(Scope.REVIEW, imagery.get_image(session, body.image_id).site_id)
    image, is_new = service.image_of_photograph(session, body.image_id)
    if body.is_complete:
        actions.set_complete(session, access, image, complete=True)
    if not is_new:
        response.status_code = 200
    return _image_out(session, image, response)


@router.get("/images/{ground_truth_image_id:int}")
def get_ground_truth_image(
    ground_truth_image_id: int, session: SessionDep, access: Reader, response: Response
) -> GroundTruthImageOut:
    """Return a photograph that people drew in."""
    image = actions.image_for(session, access, Scope.READ, ground_truth_image_id)
    return _image_out(session, image, response)


@router.patch("/images/{ground_truth_image_id:int}", dependencies=[VERSIONED])
def change_ground_truth_image(
    ground_truth_image_id: int,
    body: ImagePatch,
    request: Request,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> GroundTruthImageOut:
    """Say whether every vessel has its box; say in `If-Match` which version was looked at."""
    image = actions.image_for(session, access, Scope.REVIEW, ground_truth_image_id)
    check_if_match(request, image.version)
    if body.is_complete is not None:
        actions.set_complete(session, access, image, complete=body.is_complete)
    return _image_out(session, image, response)


def _image_out(
    session: Session, image: GroundTruthImage, response: Response
) -> GroundTruthImageOut:
    set_etag(response, image.version)
    return GroundTruthImageOut.of(image, len(service.boxes_of(session, image)))


@router.get("/photographs/{image_id:int}")
def get_scene(image_id: int, session: SessionDep, access: Reader) -> SceneOut:
    """Return a photograph of the store with its boxes, and its neighbours in time."""
    photo = imagery.get_image(session, image_id)
    access.require(Scope.READ, photo.site_id)
    image = service.drawn_in(session, photo.id)
    boxes = [] if image is None else service.boxes_of(session, image)
    earlier, later = imagery.neighbours(session, photo)
    return SceneOut(
        image=SceneImage(
            id=photo.id,
            file_name=photo.file_name,
            captured_at=photo.captured_at,
            width_px=photo.width_px,
            height_px=photo.height_px,
            file_url=file_url(photo),
            preview_url=preview_url(photo, PREVIEW_PX),
        ),
        ground_truth=None if image is None else GroundTruthImageOut.of(image, len(boxes)),
        boxes=[BoxOut.of(box) for box in boxes],
        earlier_id=earlier,
        later_id=later,
        next_open_id=service.next_open(session, photo),
    )


@router.get("/files")
def list_ground_truth_files(
    session: SessionDep, access: Reader, paging: PagingDep
) -> Page[GroundTruthFileOut]:
    """List the COCO files that were imported, oldest first."""
    found, cursor = service.list_files(session, access.site_ids(Scope.READ), paging)
    totals = service.totals_by_file(session, [file.id for file in found])
    items = [GroundTruthFileOut.of(file, totals.get(file.id, service.Totals())) for file in found]
    return Page(items=items, next_cursor=cursor)


@router.post(
    "/files",
    status_code=201,
    responses={200: {"model": ImportedOut, "description": "The same file was here already"}},
)
def import_ground_truth_file(
    session: SessionDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    site_id: Annotated[RowId, Form(description="The site of its photographs")],
    response: Response,
    said: Annotated[
        str,
        Form(
            alias="map",
            description="JSON: which class a category is, by its name or id; `none` leaves it out",
            examples=['{"boat": "ship"}'],
        ),
    ] = "",
    complete: Annotated[bool, Form(description="Every vessel in its images has a box")] = True,  # noqa: FBT002  a form field
    link: Annotated[bool, Form(description="Link photographs of the same name and size")] = True,  # noqa: FBT002  a form field
) -> ImportedOut:
    """Import a COCO file of boxes, also of photographs that are not here.

    Categories with the names of the five classes are those; of any other with boxes, `map` must
    say what it is. What the file holds goes out again as it came: `GET /ground-truth/coco`.
    """
    sent = actions.receive(file, settings)
    choices = ImportChoices(sent.name, actions.said_of(said), complete, link)
    imported = actions.import_file(session, access, site_id, sent, choices)
    if not imported.created:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/ground-truth/files/{imported.file.id}"
    return ImportedOut.of(imported)


@router.post("/files/preview")
def preview_ground_truth_file(
    database: DatabaseDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    site_id: Annotated[RowId, Form(description="The site of its photographs")],
) -> LookedOut:
    """Tell what a COCO file holds, without storing anything."""
    sent = actions.receive(file, settings)
    return LookedOut.of(actions.look_at(database, access, site_id, sent))


@router.get("/files/{ground_truth_file_id:int}")
def get_ground_truth_file(
    ground_truth_file_id: int, session: SessionDep, access: Reader
) -> GroundTruthFileOut:
    """Return an imported file."""
    file = actions.file_for(session, access, Scope.READ, ground_truth_file_id)
    totals = service.totals_by_file(session, [file.id])
    return GroundTruthFileOut.of(file, totals.get(file.id, service.Totals()))


@router.delete("/files/{ground_truth_file_id:int}", status_code=204)
def delete_ground_truth_file(
    ground_truth_file_id: int, session: SessionDep, access: Operator
) -> None:
    """Delete an imported file with its images and all their boxes, later ones included.

    It can be restored for 30 days.
    """
    actions.remove_file(session, access, ground_truth_file_id)


@router.post("/links")
def link_photographs(body: LinkIn, session: SessionDep, access: Reviewer) -> LinkedOut:
    """Link absent photographs of a site with those of the same name and size that came since."""
    return LinkedOut(linked=actions.link(session, access, body.site_id))


@router.get(
    "/coco",
    response_class=Response,
    responses={200: {"description": "A COCO file", "content": {"application/json": {}}}},
)
def export_ground_truth(
    session: SessionDep,
    access: Exporter,
    site_id: Annotated[RowId | None, Query(description="All boxes of this site")] = None,
    file_id: Annotated[RowId | None, Query(description="Those of one imported file")] = None,
) -> Response:
    """Export boxes as a COCO file: what was imported as it came, changed and new boxes with it.

    Name the site, or one imported file.
    """
    return coco_response(session, access, site_id, file_id)


def coco_response(
    session: Session, access: Access, site_id: int | None, file_id: int | None
) -> Response:
    """Return a site's boxes, or those of one file, as a COCO file. Raises Invalid, NotFound."""
    if file_id is not None:
        site_id = actions.file_for(session, access, Scope.EXPORT, file_id).site_id
    elif site_id is None:
        raise Invalid.field("site_id", "name the site whose boxes are wanted, or a file_id")
    access.require(Scope.EXPORT, sites.get_site(session, site_id).id)
    document = exporting.document_of(session, site_id, file_id)
    name = f"ground-truth-site-{site_id}" + (f"-file-{file_id}" if file_id is not None else "")
    return Response(
        json.dumps(document, allow_nan=False),
        media_type="application/json",
        headers={"Content-Disposition": f'attachment; filename="{name}.json"'},
    )
