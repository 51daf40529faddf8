"""REST of calibration sets: make them, and go through them."""

from typing import Annotated

from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.dependencies import Page, PagingDep, SessionDep
from app.errors import looked_up_by
from app.guideline import practice
from app.guideline.practice import Judged
from app.guideline.schemas import (
    AnswerOut,
    CalibrationSetIn,
    CalibrationSetOut,
    JudgementIn,
    PracticeIn,
    PracticeOut,
    ResultOut,
    practice_pose,
)
from app.ids import RowId
from app.reviews import service as reviews
from app.reviews.pose_schemas import PoseOut
from app.runs import service as runs
from app.tables.practice import CalibrationSet

router = APIRouter(
    tags=["calibration sets"], prefix="/calibration-sets", route_class=IdempotentRoute
)

Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


def find_set(session: Session, access: Access, set_id: int, scope: Scope) -> CalibrationSet:
    """Return a set that the caller may use so. Raises NotFound, Forbidden."""
    found = practice.get_set(session, set_id)
    access.require(scope, found.run.site_id)
    return found


@router.get("")
def list_calibration_sets(
    session: SessionDep, access: Reviewer, paging: PagingDep, run_id: RowId | None = None
) -> Page[CalibrationSetOut]:
    """List the calibration sets of the sites where one reviews."""
    sets, cursor = practice.list_sets(session, access.site_ids(Scope.REVIEW), run_id, paging)
    counts = practice.counts(session, sets)
    return Page(
        items=[
            CalibrationSetOut.of(
                found,
                counts.get(found.id, 0),
                practice.result(session, found.id, access.user_id),
            )
            for found in sets
        ],
        next_cursor=cursor,
    )


@router.post("", status_code=201)
def create_calibration_set(
    body: CalibrationSetIn, session: SessionDep, access: Operator, response: Response
) -> CalibrationSetOut:
    """Make a set from judged poses, from a simulated site's truth, or from one's own reviews."""
    with looked_up_by("run_id"):
        run = runs.get_run(session, body.run_id)
        access.require(Scope.INGEST, run.site_id)
    if body.poses:
        judged = [pose.judged() for pose in body.poses]
        found = practice.create_set(session, run, body.name, judged, access.user_id)
    else:
        draw = practice.create_from_truth if body.from_truth else practice.create_from_own
        found = draw(session, run, body.name, body.size, body.seed, access.user_id)
    record(session, access, "create", "calibration_set", found.id, site_id=run.site_id)
    response.headers["Location"] = f"/api/v1/calibration-sets/{found.id}"
    return _shown(session, access, found)


@router.get("/{set_id}")
def get_calibration_set(set_id: int, session: SessionDep, access: Reviewer) -> CalibrationSetOut:
    """Return a calibration set; its judgements are told pose by pose, once one has answered."""
    return _shown(session, access, find_set(session, access, set_id, Scope.REVIEW))


def _shown(session: Session, access: Access, found: CalibrationSet) -> CalibrationSetOut:
    result = practice.result(session, found.id, access.user_id)
    return CalibrationSetOut.of(found, len(result.poses), result)


@router.delete("/{set_id}", status_code=204)
def delete_calibration_set(set_id: int, session: SessionDep, access: Operator) -> None:
    """Delete a calibration set with all attempts at it; it can be restored for 30 days."""
    found = find_set(session, access, set_id, Scope.INGEST)
    record(session, access, "delete", "calibration_set", set_id, site_id=found.run.site_id)
    practice.delete_set(session, found, access.user_id)


@router.put("/{set_id}/poses/{pose_id}")
def judge_pose(
    set_id: int, pose_id: int, body: JudgementIn, session: SessionDep, access: Operator
) -> JudgementIn:
    """Put a pose of the set's run into the set with its grade, or judge it anew."""
    found = find_set(session, access, set_id, Scope.INGEST)
    row = practice.put_pose(session, found, Judged(pose_id, body.grade, body.reasons, body.note))
    record(
        session, access, "judge", "calibration_set", set_id, site_id=found.run.site_id, pose=pose_id
    )
    return JudgementIn(grade=row.grade, reasons=row.reasons, note=row.note)


@router.delete("/{set_id}/poses/{pose_id}", status_code=204)
def remove_pose(set_id: int, pose_id: int, session: SessionDep, access: Operator) -> None:
    """Take a pose out of the set; the audit log keeps how it was judged."""
    found = find_set(session, access, set_id, Scope.INGEST)
    judged = practice.remove_pose(session, set_id, pose_id)
    record(
        session,
        access,
        "remove",
        "calibration_set",
        set_id,
        site_id=found.run.site_id,
        pose=pose_id,
        grade=judged.grade.value,
        reasons=list(judged.reasons),
        note=judged.note,
    )


@router.get("/{set_id}/poses")
def list_judged_poses(set_id: int, session: SessionDep, access: Reviewer) -> Page[PoseOut]:
    """List all poses of the set for practising: without verdicts, but for one's own answers."""
    found = find_set(session, access, set_id, Scope.REVIEW)
    compared = practice.result(session, set_id, access.user_id).poses
    poses = reviews.poses_by_id(session, [pose.judged.pose_id for pose in compared], access.user_id)
    return Page(
        items=[
            practice_pose(poses[pose.judged.pose_id], pose.answer, found.guideline_version)
            for pose in compared
        ]
    )


@router.post("/{set_id}/grades", status_code=201, responses={200: {"model": PracticeOut}})
def grade_practice_pose(
    set_id: int, body: PracticeIn, session: SessionDep, access: Reviewer, response: Response
) -> PracticeOut:
    """Grade a judged pose for practice and learn the judgement; the first answer counts (200)."""
    found = find_set(session, access, set_id, Scope.REVIEW)
    compared, given, is_new = practice.answer(
        session, found, access.user_id, body.pose_id, body.grade, body.reasons, body.seconds
    )
    if not is_new:
        response.status_code = 200
    result = practice.result(session, set_id, access.user_id)
    told = AnswerOut.of(compared, given)
    return PracticeOut(**told.model_dump(), answered=result.answered, total=len(result.poses))


@router.get("/{set_id}/result")
def get_practice_result(set_id: int, session: SessionDep, access: Reviewer) -> ResultOut:
    """Tell how one's latest attempt went."""
    find_set(session, access, set_id, Scope.REVIEW)
    return ResultOut.of(practice.result(session, set_id, access.user_id))


@router.post("/{set_id}/restart", status_code=201)
def restart_practice(set_id: int, session: SessionDep, access: Reviewer) -> ResultOut:
    """Begin a new attempt; earlier ones are kept."""
    find_set(session, access, set_id, Scope.REVIEW)
    return ResultOut.of(practice.restart(session, set_id, access.user_id))
