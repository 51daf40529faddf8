"""REST of jobs, for administrators of all sites."""

from typing import Annotated

from fastapi import APIRouter, Path

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.dependencies import DatabaseDep, JobsDep, Page, PagingDep, SessionDep
from app.keeping import jobs as control
from app.keeping.schemas import JobOut

router = APIRouter(route_class=IdempotentRoute, tags=["jobs"])
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
JobId = Annotated[str, Path(max_length=64)]


@router.get("/jobs")
def list_jobs(session: SessionDep, access: Administrator, paging: PagingDep) -> Page[JobOut]:
    """List jobs, the newest first."""
    found, next_cursor = control.listed(session, access, paging)
    return Page(items=[JobOut.of(job) for job in found], next_cursor=next_cursor)


@router.get("/jobs/{job_id}")
def get_job(job_id: JobId, session: SessionDep, access: Administrator) -> JobOut:
    """Show a job."""
    return JobOut.of(control.get(session, access, job_id))


@router.post("/jobs/{job_id}/cancel")
def cancel_job(
    job_id: JobId, database: DatabaseDep, jobs: JobsDep, access: Administrator
) -> JobOut:
    """Stop a job before its next step; what it made stays. An ended job stays as it is."""
    return JobOut.of(control.cancel(database, jobs, access, job_id))


@router.post("/jobs/{job_id}/retry")
def retry_job(job_id: JobId, session: SessionDep, jobs: JobsDep, access: Administrator) -> JobOut:
    """Queue a failed or cancelled job again; what its rows say is done is not done twice."""
    return JobOut.of(control.retry(session, jobs, access, job_id))
