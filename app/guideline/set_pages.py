"""Pages of calibration sets: make one, go through one, see how it went."""

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.dependencies import Paging, SessionDep
from app.errors import AppError, Conflict, Invalid
from app.guideline import practice
from app.guideline.drawing import draw_pose
from app.guideline.practice import Judged
from app.guideline.router import Operator, Reviewer, find_set
from app.identities.shown import title_of
from app.reviews import service as reviews
from app.runs import service as runs
from app.tables.reviews import Grade
from app.templating import page

router = APIRouter()

ALL = Paging(limit=1000, after=None)


@router.get("/calibration-sets")
def list_sets(request: Request, session: SessionDep, access: Reviewer) -> Response:
    """List the calibration sets, with one's own results."""
    return _list(request, session, access)


@router.post("/calibration-sets")
def create_set(
    request: Request,
    session: SessionDep,
    access: Operator,
    run_id: Annotated[int, Form()],
    name: Annotated[str, Form(min_length=1, max_length=200)],
    source: Annotated[str, Form()] = "truth",
    size: Annotated[int, Form(ge=1, le=practice.MOST_POSES)] = 20,
    seed: Annotated[int, Form(ge=0, le=2**31 - 1)] = 1,
) -> Response:
    """Make a set from a run, judged by the truth or by one's own verdicts, and show it."""
    run = runs.get_run(session, run_id)
    access.require(Scope.INGEST, run.site_id)
    draw = practice.create_from_truth if source == "truth" else practice.create_from_own
    try:
        found = draw(session, run, name.strip(), size, seed, access.user_id)
    except (Conflict, Invalid) as error:
        return _list(request, session, access, error=error)
    record(session, access, "create", "calibration_set", found.id, site_id=run.site_id)
    return RedirectResponse(f"/calibration-sets/{found.id}", status_code=303)


def _list(
    request: Request, session: Session, access: Access, error: AppError | None = None
) -> Response:
    sets, _ = practice.list_sets(session, access.site_ids(Scope.REVIEW), None, ALL)
    counts = practice.counts(session, sets)
    may_make = access.may_anywhere(Scope.INGEST)
    newest = runs.newest_runs(session, access.site_ids(Scope.INGEST)) if may_make else []
    return page(
        request,
        "guideline/sets.html",
        status_code=error.status if error else 200,
        crumbs=[{"label": "Guideline", "href": "/guideline"}, {"label": "Calibration sets"}],
        sets=[
            (
                found,
                runs.label(found.run),
                counts.get(found.id, 0),
                practice.result(session, found.id, access.user_id),
            )
            for found in sets
        ],
        runs=[
            (run.id, f"{runs.label(run)} ({progress.poses} poses)")
            for run, progress in newest
            if progress.poses
        ],
        may_make=may_make,
        error=error.detail if error else "",
    )


@router.get("/calibration-sets/{set_id}")
def show_set(request: Request, set_id: int, session: SessionDep, access: Reviewer) -> Response:
    """Show how one's latest attempt went; to operators also the judgements, to mend them."""
    found = find_set(session, access, set_id, Scope.REVIEW)
    return page(
        request,
        "guideline/set.html",
        crumbs=[
            {"label": "Guideline", "href": "/guideline"},
            {"label": "Calibration sets", "href": "/calibration-sets"},
            {"label": found.name},
        ],
        found=found,
        run_label=runs.label(found.run),
        result=practice.result(session, set_id, access.user_id),
        may_change=access.may(Scope.INGEST, found.run.site_id),
        grades=[(grade.value, name) for grade, name in _GRADE_NAMES.items()],
    )


_GRADE_NAMES = {
    Grade.GOOD: "Good",
    Grade.OK: "OK",
    Grade.BAD: "Bad",
    Grade.WRONG: "Wrong match",
}


@router.get("/calibration-sets/{set_id}/practice")
def show_practice(
    request: Request, set_id: int, session: SessionDep, access: Reviewer, told: int | None = None
) -> Response:
    """Show the next pose to grade, or, with `told`, the judgement of the one just graded."""
    found = find_set(session, access, set_id, Scope.REVIEW)
    result = practice.result(session, set_id, access.user_id)
    answered = [pose for pose in result.poses if pose.answer is not None]
    just = next((pose for pose in answered if pose.judged.pose_id == told), None)
    current = just or next((pose for pose in result.poses if pose.answer is None), None)
    if current is None:
        return RedirectResponse(f"/calibration-sets/{set_id}", status_code=303)
    shown = reviews.get_pose(session, current.judged.pose_id)
    name = shown.told.name(shown.vessel.name) if shown.vessel else None
    return page(
        request,
        "guideline/practice.html",
        crumbs=[
            {"label": "Calibration sets", "href": "/calibration-sets"},
            {"label": found.name, "href": f"/calibration-sets/{set_id}"},
            {"label": "Practice"},
        ],
        found=found,
        result=result,
        current=current,
        told=just is not None,
        drawing=draw_pose(shown.pose, title_of(shown.told.vessel(shown.pose.mmsi), name)),
        pose=shown.pose,
    )


@router.post("/calibration-sets/{set_id}/practice")
def answer(
    set_id: int,
    session: SessionDep,
    access: Reviewer,
    pose_id: Annotated[int, Form()] = 0,
    grade: Annotated[str, Form()] = "",
) -> Response:
    """Take a grade for practice and show what was judged."""
    found = find_set(session, access, set_id, Scope.REVIEW)
    practice.answer(session, found, access.user_id, pose_id, _grade(grade), (), None)
    return RedirectResponse(f"/calibration-sets/{set_id}/practice?told={pose_id}", status_code=303)


def _grade(code: str) -> Grade:
    """Read a grade of a form; asked only once the set is known to be the caller's."""
    try:
        return Grade(code)
    except ValueError as error:
        raise Invalid.field("grade", "choose one from the list") from error


@router.post("/calibration-sets/{set_id}/restart")
def restart(set_id: int, session: SessionDep, access: Reviewer) -> Response:
    """Begin a new attempt."""
    find_set(session, access, set_id, Scope.REVIEW)
    practice.restart(session, set_id, access.user_id)
    return RedirectResponse(f"/calibration-sets/{set_id}/practice", status_code=303)


@router.post("/calibration-sets/{set_id}/poses/{pose_id}")
def judge_pose(
    set_id: int,
    pose_id: int,
    session: SessionDep,
    access: Operator,
    grade: Annotated[str, Form()] = "",
    note: Annotated[str, Form(max_length=2000)] = "",
) -> Response:
    """Judge a pose of the set anew; the grade `remove` takes it out."""
    found = find_set(session, access, set_id, Scope.INGEST)
    if grade == "remove":
        practice.remove_pose(session, set_id, pose_id)
    else:
        judged = Judged(pose_id, _grade(grade), (), note.strip())
        practice.put_pose(session, found, practice.with_present_reasons(session, set_id, judged))
    record(
        session, access, "judge", "calibration_set", set_id, site_id=found.run.site_id, pose=pose_id
    )
    return RedirectResponse(f"/calibration-sets/{set_id}#judgements", status_code=303)


@router.post("/calibration-sets/{set_id}/delete")
def delete_set(set_id: int, session: SessionDep, access: Operator) -> Response:
    """Remove a set with all attempts at it."""
    found = find_set(session, access, set_id, Scope.INGEST)
    record(session, access, "delete", "calibration_set", set_id, site_id=found.run.site_id)
    practice.delete_set(session, found, access.user_id)
    return RedirectResponse("/deletions", status_code=303)
