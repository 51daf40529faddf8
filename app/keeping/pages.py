"""The administrators' page of jobs."""

from typing import Annotated

from fastapi import APIRouter, Path, Request
from fastapi.responses import RedirectResponse, Response

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, JobsDep, PagingDep, SessionDep
from app.keeping import jobs as control
from app.keeping import repository
from app.templating import page

router = APIRouter(prefix="/admin/jobs")
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
JobId = Annotated[str, Path(max_length=64)]
NOTICES = {
    "cancelled": "The job is cancelled; what it made stays.",
    "queued": "The job is queued again.",
}


@router.get("")
def show_jobs(
    request: Request, session: SessionDep, access: Administrator, paging: PagingDep, done: str = ""
) -> Response:
    """Show all jobs, the newest first."""
    jobs, next_cursor = control.listed(session, access, paging)
    notice = NOTICES.get(done)
    return page(
        request,
        "keeping/jobs.html",
        jobs=jobs,
        findings=repository.findings(session),
        next_cursor=next_cursor,
        flashes=[{"message": notice, "tone": "success"}] if notice else [],
    )


@router.post("/{job_id}/cancel")
def cancel_job(
    job_id: JobId, database: DatabaseDep, jobs: JobsDep, access: Administrator
) -> Response:
    """Cancel a job."""
    control.cancel(database, jobs, access, job_id)
    return RedirectResponse("/admin/jobs?done=cancelled", status_code=303)


@router.post("/{job_id}/retry")
def retry_job(job_id: JobId, session: SessionDep, jobs: JobsDep, access: Administrator) -> Response:
    """Queue a job again."""
    control.retry(session, jobs, access, job_id)
    return RedirectResponse("/admin/jobs?done=queued", status_code=303)
