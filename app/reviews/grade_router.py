"""REST of verdicts: giving them, adding reasons, taking them back."""

from typing import Annotated

from fastapi import APIRouter, Header, Response

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import HEADER, IdempotentRoute
from app.dependencies import SessionDep
from app.paging import Page
from app.reviews import grading, run_images, service
from app.reviews.grading import Verdict
from app.reviews.schemas import (
    Decision,
    DecisionOut,
    PoseVerdicts,
    RestIn,
    ReviewIn,
    ReviewOut,
    WithdrawnOut,
    WordsIn,
)

router = APIRouter(route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
Key = Annotated[str | None, Header(alias=HEADER, include_in_schema=False)]


@router.get("/poses/{pose_id}/reviews")
def list_reviews(pose_id: int, session: SessionDep, access: Reader) -> Page[ReviewOut]:
    """List all verdicts on a pose, replaced and withdrawn ones too."""
    access.require(Scope.READ, service.site_of_pose(session, pose_id))
    return Page(items=[ReviewOut.of(review) for review in service.reviews_of(session, pose_id)])


@router.post("/poses/{pose_id}/reviews", status_code=201)
def grade_pose(
    pose_id: int,
    body: ReviewIn,
    session: SessionDep,
    access: Reviewer,
    response: Response,
    key: Key = None,
) -> ReviewOut:
    """Grade a pose; grading again replaces one's own verdict.

    Where another person's verdict stands already this is a second opinion, which the answer says.
    """
    access.require(Scope.REVIEW, service.site_of_pose(session, pose_id))
    verdict = Verdict(
        grade=body.grade,
        reasons=body.reasons,
        comment=body.comment,
        seconds=body.seconds,
        decision=body.decision or key,
        settle=body.settle,
    )
    review = grading.grade_pose(session, pose_id, access.user_id, verdict)
    response.headers["Location"] = f"/api/v1/poses/{pose_id}/reviews"
    return ReviewOut.of(review, user=access.name or access.email)


@router.post("/images/{image_id}/reviews", status_code=201)
def grade_rest_of_image(
    image_id: int, body: RestIn, session: SessionDep, access: Reviewer, key: Key = None
) -> DecisionOut:
    """Grade what is left of an image as Good, all in one stroke."""
    run = run_images.run_over(session, access, Scope.REVIEW, body.run_id, image_id)
    verdict = Verdict(grade=body.grade, seconds=body.seconds, decision=body.decision or key)
    decision, reviews, skipped = grading.grade_rest(
        session, run.id, image_id, access.user_id, verdict, body.pose_ids
    )
    name = access.name or access.email
    return DecisionOut(
        decision=decision,
        reviews=[ReviewOut.of(review, user=name) for review in reviews],
        skipped=skipped,
    )


@router.patch("/decisions/{decision_name}")
def amend_decision(
    decision_name: Decision, body: WordsIn, session: SessionDep, access: Reviewer
) -> DecisionOut:
    """Put reasons or a comment on one's own decision, whatever was decided since."""
    reviews = grading.add_words(
        session,
        access.user_id,
        decision_name,
        reasons=body.reasons,
        comment=body.comment,
        sets_comment="comment" in body.model_fields_set,
    )
    return DecisionOut(decision=decision_name, reviews=[ReviewOut.of(review) for review in reviews])


@router.delete("/decisions/{decision_name}")
def withdraw_decision(
    decision_name: Decision, session: SessionDep, access: Reviewer
) -> WithdrawnOut:
    """Take one's own decision back; what one had said before stands again. Twice is as once."""
    pose_ids, was_standing = grading.withdraw(session, access.user_id, decision_name)
    if was_standing:
        record(session, access, "withdraw", "review", None, decision=decision_name, poses=pose_ids)
    found = service.poses_by_id(session, pose_ids, access.user_id)
    return WithdrawnOut(
        decision=decision_name,
        poses=[PoseVerdicts.of(found[pose_id]) for pose_id in pose_ids if pose_id in found],
    )
