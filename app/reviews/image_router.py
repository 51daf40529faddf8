"""REST of a run's images: missed vessels, completeness, and what was heard and detected there."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, heed_if_match, set_etag
from app.dependencies import PagingDep, SessionDep
from app.identities import service as identities
from app.ids import RowId
from app.paging import Page
from app.reviews import run_images
from app.reviews.image_repository import ImageFilters
from app.reviews.image_schemas import (
    CompletionOut,
    DetectionOut,
    MissedIn,
    MissedOut,
    MissedPatch,
    OfRunIn,
    RunImageOut,
    VesselAtImage,
)
from app.reviews.run_images import Box
from app.runs import service as runs
from app.tables.reviews import MissedVessel

router = APIRouter(route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]


@router.get("/runs/{run_id}/images")
def list_run_images(
    run_id: int,
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    complete: Annotated[bool | None, Query(description="Said to be complete")] = None,
    has_poses: Annotated[bool | None, Query(description="With at least one pose")] = None,
    has_missed: Annotated[bool | None, Query(description="With a missed vessel")] = None,
) -> Page[RunImageOut]:
    """List the images of a run in the order of time, with and without poses."""
    run = runs.get_run(session, run_id)
    access.require(Scope.READ, run.site_id)
    wanted = ImageFilters(complete=complete, has_poses=has_poses, has_missed=has_missed)
    found, cursor = run_images.listed(session, run.id, wanted, paging)
    return Page(items=[RunImageOut.of(image) for image in found], next_cursor=cursor)


@router.post(
    "/images/{image_id}/complete",
    status_code=201,
    responses={200: {"description": "It was complete already"}},
)
def complete_image(
    image_id: int, body: OfRunIn, session: SessionDep, access: Reviewer, response: Response
) -> CompletionOut:
    """Say that every visible vessel of an image is accounted for; all its poses must be graded."""
    run = run_images.run_over(session, access, Scope.REVIEW, body.run_id, image_id)
    completion, is_new = run_images.complete(session, run, image_id, access.user_id)
    if is_new:
        record(session, access, "complete", "image", image_id, site_id=run.site_id, run_id=run.id)
    else:
        response.status_code = 200
    return CompletionOut.of(completion)


@router.delete("/images/{image_id}/complete", status_code=204)
def reopen_image(image_id: int, run_id: RowId, session: SessionDep, access: Reviewer) -> None:
    """Take back that an image is complete."""
    run = run_images.run_over(session, access, Scope.REVIEW, run_id, image_id)
    if run_images.reopen(session, run, image_id, access.user_id):
        record(session, access, "reopen", "image", image_id, site_id=run.site_id, run_id=run.id)


@router.get("/images/{image_id}/missed-vessels")
def list_missed(
    image_id: int,
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    run_id: RowId | None = None,
) -> Page[MissedOut]:
    """List the vessels that were missed in an image."""
    access.require(Scope.READ, run_images.site_of_image(session, image_id))
    found, cursor = run_images.missed_of_image(session, run_id, image_id, paging)
    return Page(items=[MissedOut.of(missed) for missed in found], next_cursor=cursor)


@router.post("/images/{image_id}/missed-vessels", status_code=201)
def add_missed(
    image_id: int, body: MissedIn, session: SessionDep, access: Reviewer, response: Response
) -> MissedOut:
    """Mark a visible vessel that has no pose."""
    run = run_images.run_over(session, access, Scope.REVIEW, body.run_id, image_id)
    box = Box(body.x1_px, body.y1_px, body.x2_px, body.y2_px)
    missed = run_images.add_missed(
        session, run, image_id, access.user_id, box, body.reason, body.comment
    )
    set_etag(response, missed.version)
    response.headers["Location"] = f"/api/v1/missed-vessels/{missed.id}"
    return MissedOut.of(missed, user=access.name or access.email)


@router.get("/missed-vessels/{missed_id}")
def get_missed(
    missed_id: int,
    session: SessionDep,
    access: Reader,
    response: Response,
) -> MissedOut:
    """Return a missed vessel."""
    missed = _missed(session, access, Scope.READ, missed_id)
    set_etag(response, missed.version)
    return MissedOut.of(missed)


@router.patch("/missed-vessels/{missed_id}", dependencies=[VERSIONED])
def change_missed(
    missed_id: int,
    body: MissedPatch,
    request: Request,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> MissedOut:
    """Change a missed vessel; say in `If-Match` which version."""
    missed = _missed(session, access, Scope.REVIEW, missed_id)
    check_if_match(request, missed.version)
    run_images.change_missed(session, missed, body.changes())
    record(
        session,
        access,
        "update",
        "missed vessel",
        missed.id,
        site_id=run_images.site_of_image(session, missed.image_id),
        **body.model_dump(mode="json", exclude_unset=True),
    )
    set_etag(response, missed.version)
    return MissedOut.of(missed)


@router.delete("/missed-vessels/{missed_id}", status_code=204, dependencies=[VERSIONED])
def delete_missed(missed_id: int, request: Request, session: SessionDep, access: Reviewer) -> None:
    """Unmark a missed vessel; it can be restored for 30 days."""
    missed = _missed(session, access, Scope.REVIEW, missed_id)
    heed_if_match(request, missed.version)
    record(
        session,
        access,
        "delete",
        "missed vessel",
        missed.id,
        site_id=run_images.site_of_image(session, missed.image_id),
        image_id=missed.image_id,
        reason=missed.reason.value,
    )
    run_images.delete_missed(session, missed, access.user_id)


@router.get("/images/{image_id}/vessels")
def list_vessels_at_image(
    image_id: int, run_id: RowId, session: SessionDep, access: Reader
) -> Page[VesselAtImage]:
    """List the vessels that were heard around an image in a run, with what became of them."""
    run = run_images.run_over(session, access, Scope.READ, run_id, image_id)
    found = run_images.vessels(session, run.id, image_id)
    told = identities.at_site(session, run.site_id)
    return Page(items=[VesselAtImage.of(*row, told) for row in found])


@router.get("/images/{image_id}/detections")
def list_detections(
    image_id: int, run_id: RowId, session: SessionDep, access: Reader
) -> Page[DetectionOut]:
    """List what was detected in an image of a run, with the pose made of each box."""
    run = run_images.run_over(session, access, Scope.READ, run_id, image_id)
    found = run_images.detections(session, run.id, image_id)
    return Page(items=[DetectionOut.of(*row) for row in found])


def _missed(session: Session, access: Access, scope: Scope, missed_id: int) -> MissedVessel:
    missed = run_images.get_missed(session, missed_id)
    access.require(scope, run_images.site_of_image(session, missed.image_id))
    return missed
