"""REST of poses and of what people say of them, put together from its parts."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import set_etag
from app.dependencies import PagingDep, SessionDep
from app.errors import Invalid
from app.identities import service as identities
from app.ids import RowId, VesselRef
from app.paging import Page
from app.reviews import (
    correction_router,
    grade_router,
    image_router,
    note_router,
    queue_router,
    service,
)
from app.reviews.pose_schemas import PoseOut
from app.reviews.repository import PoseFilters

router = APIRouter(tags=["poses and reviews"], route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
GradeFilter = Literal["good", "ok", "bad", "wrong", "ungraded"]
StateFilter = Literal["ungraded", "graded", "disagreement", "second_opinion", "settled"]


@router.get("/poses")
def list_poses(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    run_id: RowId | None = None,
    image_id: RowId | None = None,
    mmsi: Annotated[
        VesselRef | None, Query(description="Or the vessel's pseudonym at the site")
    ] = None,
    grade: Annotated[GradeFilter | None, Query(description="The verdict that counts")] = None,
    state: StateFilter | None = None,
    reviewer: Annotated[
        str | None, Query(max_length=20, description="A person's id who graded, or `me`")
    ] = None,
    bookmarked: Annotated[bool | None, Query(description="By the caller")] = None,
    corrected: Annotated[bool | None, Query(description="By a person")] = None,
    person_made: Annotated[bool | None, Query(description="Or generated")] = None,
    flag: Annotated[str | None, Query(max_length=32, pattern=r"^[a-z_]+$")] = None,
) -> Page[PoseOut]:
    """List poses with what people say of them."""
    readable, vessel = identities.searched(session, mmsi)
    wanted = PoseFilters(
        run_id=run_id,
        image_id=image_id,
        mmsi=vessel,
        grade=grade,
        state=state,
        reviewer_id=_reviewer(reviewer, access),
        reader_id=access.user_id,
        bookmarked=bookmarked,
        corrected=corrected,
        person_made=person_made,
        flag=flag,
    )
    poses, cursor = service.list_poses(session, readable, paging, wanted)
    return Page(items=[PoseOut.of(pose) for pose in poses], next_cursor=cursor)


def _reviewer(text: str | None, access: Access) -> int | None:
    if text is None:
        return None
    if text == "me":
        return access.user_id
    if not (text.isascii() and text.isdigit()) or len(text) > 9:
        raise Invalid.field("reviewer", "must be the id of a person, or `me`")
    return int(text)


@router.get("/poses/{pose_id}")
def get_pose(pose_id: int, session: SessionDep, access: Reader, response: Response) -> PoseOut:
    """Return a pose with what it was made of; its ETag is the version of its correction."""
    access.require(Scope.READ, service.site_of_pose(session, pose_id))
    reviewed = service.get_pose(session, pose_id, access.user_id)
    set_etag(response, reviewed.beside.correction_version)
    return PoseOut.of(reviewed)


for part in (grade_router, queue_router, image_router, correction_router, note_router):
    router.include_router(part.router)
