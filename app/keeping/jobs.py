"""Jobs for administrators: seen, cancelled, tried again.

A job tried again begins anew under its own id: what the engine noted of its steps is forgotten, and
what it is about waits for it as on the first day. What its rows say is done is not done twice.
"""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.db import Database
from app.errors import Conflict, NotFound
from app.exports import service as exports
from app.job_tables import Job, JobStatus, forget_jobs, list_jobs
from app.jobs import JobClient, JobQueue
from app.keeping import job_repository
from app.paging import Paging, encode_cursor
from app.reregistration.service import REREGISTRATION_JOB
from app.runs import service as runs
from app.runs.service import RUN_JOB

LONG_JOBS = frozenset({RUN_JOB, REREGISTRATION_JOB})


def listed(session: Session, access: Access, paging: Paging) -> tuple[Sequence[Job], str | None]:
    """Return a page of the jobs, the newest first, to an administrator of all sites."""
    access.require(Scope.ADMIN, None)
    begin = paging.after or 0
    jobs = list_jobs(session.connection(), paging.limit + 1, begin)
    if len(jobs) <= paging.limit:
        return jobs, None
    return jobs[: paging.limit], encode_cursor(begin + paging.limit)


def get(session: Session, access: Access, job_id: str) -> Job:
    """Return a job to an administrator of all sites. Raises NotFound."""
    access.require(Scope.ADMIN, None)
    found = list_jobs(session.connection(), 1, job_id=job_id)
    if not found:
        raise NotFound("there is no such job")
    return found[0]


def cancel(database: Database, jobs: JobClient, access: Access, job_id: str) -> Job:
    """Stop a job before its next step; an ended one stays as it is. Raises NotFound."""
    with database.reading() as session:
        job = get(session, access, job_id)
    if job.status.has_ended:
        return job
    jobs.cancel(job_id)  # the engine writes on a connection of its own: before any row here
    with database.writing() as session:
        runs.cancel_job(session, job_id)
        exports.cancel_job(session, job_id)
        job_repository.close(session, job_id)
        _note(session, access, "cancel", job)
    with database.reading() as session:
        return get(session, access, job_id)


def retry(session: Session, jobs: JobClient, access: Access, job_id: str) -> Job:
    """Queue a failed or cancelled job again. Raises NotFound, or Conflict for any other."""
    job = get(session, access, job_id)
    if job.status not in {JobStatus.FAILED, JobStatus.CANCELLED}:
        raise Conflict(f"only failed and cancelled jobs can be tried again; it is {job.status}")
    forget_jobs(session.connection(), job_id)
    job_repository.reopen(session, job_id)
    queue = JobQueue(job.queue) if job.queue else _queue_of(job.name)
    jobs.enqueue(session, job.name, *job.arguments, queue=queue, job_id=job_id)
    _note(session, access, "retry", job)
    session.flush()
    return get(session, access, job_id)


def _queue_of(name: str) -> JobQueue:
    return JobQueue.RUNS if name in LONG_JOBS else JobQueue.SHORT


def _note(session: Session, access: Access, action: str, job: Job) -> None:
    site_id = job_repository.site_of(session, job.job_id)
    record(session, access, action, "job", None, site_id, job_id=job.job_id, kind=job.name)
