"""REST of poses and reviews."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.dependencies import PagingDep, SessionDep
from app.ids import Mmsi, RowId
from app.paging import Page
from app.reviews import service
from app.reviews.schemas import PoseOut, ReviewIn, ReviewOut

router = APIRouter(tags=["poses and reviews"], route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
GradeFilter = Literal["good", "ok", "bad", "wrong", "ungraded"]


@router.get("/poses")
def list_poses(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    run_id: RowId | None = None,
    image_id: RowId | None = None,
    mmsi: Mmsi | None = None,
    grade: Annotated[GradeFilter | None, Query(description="The newest verdict")] = None,
) -> Page[PoseOut]:
    """List poses with their newest verdicts."""
    poses, cursor = service.list_poses(
        session,
        access.site_ids(Scope.READ),
        paging,
        run_id=run_id,
        image_id=image_id,
        mmsi=mmsi,
        grade=grade,
    )
    return Page(items=[PoseOut.of(pose) for pose in poses], next_cursor=cursor)


@router.get("/poses/{pose_id}")
def get_pose(pose_id: int, session: SessionDep, access: Reader) -> PoseOut:
    """Return a pose with what it was made of."""
    access.require(Scope.READ, service.site_of_pose(session, pose_id))
    return PoseOut.of(service.get_pose(session, pose_id))


@router.get("/poses/{pose_id}/reviews")
def list_reviews(pose_id: int, session: SessionDep, access: Reader) -> Page[ReviewOut]:
    """List all verdicts on a pose, replaced ones too."""
    access.require(Scope.READ, service.site_of_pose(session, pose_id))
    return Page(items=[ReviewOut.of(review) for review in service.reviews_of(session, pose_id)])


@router.post("/poses/{pose_id}/reviews", status_code=201)
def grade_pose(
    pose_id: int,
    body: ReviewIn,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> ReviewOut:
    """Grade a pose; grading again replaces one's own verdict."""
    access.require(Scope.REVIEW, service.site_of_pose(session, pose_id))
    review = service.grade_pose(
        session,
        pose_id,
        access.user_id,
        grade=body.grade,
        reasons=body.reasons,
        comment=body.comment,
        seconds=body.seconds,
    )
    response.headers["Location"] = f"/api/v1/poses/{pose_id}/reviews"
    return ReviewOut.of(review, user=access.name or access.email)
