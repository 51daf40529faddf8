"""Pages of ground truth: what there is by site, files in and out, and drawing in a photograph."""

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response, UploadFile
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, Paging, PagingDep, SessionDep, SettingsDep, StorageDep
from app.errors import AppError
from app.forms import ENTRY_ERRORS, Submitted
from app.groundtruth import actions, service
from app.groundtruth.coco_file import LEFT_OUT, read_coco
from app.groundtruth.importing import ImportChoices
from app.groundtruth.repository import ImageFilters
from app.ids import RowId
from app.imagery import service as imagery
from app.sites import service as sites
from app.tables.groundtruth import VesselClass
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
Operator = Annotated[Access, allowed(Scope.INGEST)]
MOST_SITES = 200
CLASS_NAMES = {
    VesselClass.SHIP: "Ship",
    VesselClass.SHIP_LEAVING_FRAME: "Leaving the frame",
    VesselClass.SHIP_MOORED: "Moored",
    VesselClass.SHIP_PARTIAL: "Partial",
    VesselClass.SUBVESSEL: "Part of a convoy",
}
CHOICES = [(one.value, one.value) for one in VesselClass] + [(LEFT_OUT, "no vessel: leave it out")]


@router.get("/ground-truth")
def show_ground_truth(request: Request, session: SessionDep, access: Reader) -> Response:
    """Show what people drew, by site, and the files that were imported."""
    return _index(request, session, access)


@router.post("/ground-truth/look")
def look_at_file(
    request: Request,
    database: DatabaseDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    site_id: Annotated[RowId, Form()],
) -> Response:
    """Keep an uploaded file and show what is in it, to say what its categories are."""
    try:
        sent = actions.receive(file, settings)
        looked = actions.look_at(database, access, site_id, sent)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            return _index(request, session, access, error=error)
    storage.put(sent.data)
    return page(
        request,
        "groundtruth/import.html",
        crumbs=[{"label": "Ground truth", "href": "/ground-truth"}, {"label": sent.name}],
        name=sent.name,
        sha256=sent.sha256,
        site_id=site_id,
        looked=looked,
        choices=CHOICES,
        message="",
    )


@router.post("/ground-truth/import")
def import_file(
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    storage: StorageDep,
    access: Operator,
    submitted: Submitted,
    site_id: Annotated[RowId, Form()],
    sha256: Annotated[str, Form(pattern="^[0-9a-f]{64}$")],
    name: Annotated[str, Form(max_length=255)] = "boxes.json",
) -> Response:
    """Import a file that was looked at."""
    try:
        data = storage.read(sha256)
        sent = actions.Sent(name, sha256, data, read_coco(data))
        said = {
            field.removeprefix("class_"): value
            for field, value in submitted.items()
            if field.startswith("class_") and value
        }
        choices = ImportChoices(name, said, "complete" in submitted, "link" in submitted)
        actions.import_file(session, access, site_id, sent, choices)
    except ENTRY_ERRORS as error:
        session.rollback()
        with database.reading() as reading:
            return _index(request, reading, access, error=error)
    return RedirectResponse("/ground-truth", status_code=303)


@router.post("/ground-truth/links")
def link_photographs(
    session: SessionDep, access: Reviewer, site_id: Annotated[RowId, Form()]
) -> Response:
    """Link absent photographs of a site with those that came."""
    actions.link(session, access, site_id)
    return RedirectResponse("/ground-truth", status_code=303)


@router.post("/ground-truth/files/{ground_truth_file_id:int}/delete")
def remove_file(ground_truth_file_id: int, session: SessionDep, access: Operator) -> Response:
    """Remove an imported file with its boxes."""
    actions.remove_file(session, access, ground_truth_file_id)
    return RedirectResponse("/deletions", status_code=303)


@router.get("/sites/{site_id:int}/ground-truth")
def list_images(
    request: Request, site_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Response:
    """Show the photographs of a site that people drew in, absent ones too."""
    site = sites.get_site(session, site_id)
    access.require(Scope.READ, site.id)
    wanted = ImageFilters(access.site_ids(Scope.READ), site_id=site.id)
    images, cursor = service.list_images(session, wanted, paging)
    here = f"/sites/{site.id}/ground-truth"
    return page(
        request,
        "groundtruth/images.html",
        crumbs=[
            {"label": "Ground truth", "href": "/ground-truth"},
            {"label": site.name},
        ],
        site=site,
        images=images,
        counts=service.count_boxes(session, images),
        totals=service.totals_by_site(session, [site.id]).get(site.id, service.Totals()),
        next_href=f"{here}?cursor={cursor}" if cursor else "",
        first_href=here if paging.after is not None else "",
        may_draw=access.may(Scope.REVIEW, site.id),
    )


@router.get("/images/{image_id:int}/boxes")
def draw(request: Request, image_id: int, session: SessionDep, access: Reviewer) -> Response:
    """Show a photograph to draw boxes in."""
    photo = imagery.get_image(session, image_id)
    access.require(Scope.REVIEW, photo.site_id)
    return page(
        request,
        "groundtruth/draw.html",
        crumbs=[
            {"label": "Ground truth", "href": "/ground-truth"},
            {"label": photo.camera.name, "href": f"/cameras/{photo.camera_id}"},
            {"label": "Boxes"},
        ],
        image=photo,
        classes=[(one.value, name) for one, name in CLASS_NAMES.items()],
    )


def _index(
    request: Request, session: Session, access: Access, *, error: AppError | None = None
) -> Response:
    readable = access.site_ids(Scope.READ)
    everything = Paging(limit=MOST_SITES, after=None)
    shown, _ = sites.list_sites(session, readable, everything)
    files, _ = service.list_files(session, readable, everything)
    names = {site.id: site.name for site in shown}
    came = {site.id: len(service.absent_that_came(session, site.id)) for site in shown}
    return page(
        request,
        "groundtruth/index.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "Ground truth"}],
        sites=shown,
        totals=service.totals_by_site(session, [site.id for site in shown]),
        came=came,
        first_photograph={site.id: service.first_photograph(session, site.id) for site in shown},
        files=files,
        file_totals=service.totals_by_file(session, [file.id for file in files]),
        nothing=service.Totals(),
        site_names=names,
        import_sites=[(site.id, site.name) for site in shown if access.may(Scope.INGEST, site.id)],
        may_review=access.may_anywhere(Scope.REVIEW),
        may_export=access.may_anywhere(Scope.EXPORT),
        flashes=[{"message": error.detail, "tone": "error"}] if error else [],
    )
