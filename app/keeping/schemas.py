"""What REST says about jobs."""

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel, Field

from app.job_tables import Job, JobStatus


class JobOut(BaseModel):
    """A job: what it does, where it stands, and which worker has or had it."""

    id: str = Field(examples=["run-0192f3"])
    name: str = Field(examples=["run"])
    queue: str | None = Field(examples=["runs"])
    arguments: list[Any] = Field(examples=[[7]])
    status: JobStatus
    worker: str | None
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    error: str | None = Field(description="Why it failed, in one line")

    @classmethod
    def of(cls, job: Job) -> Self:
        """Return what REST says about a job."""
        return cls(
            id=job.job_id,
            name=job.name,
            queue=job.queue,
            arguments=list(job.arguments),
            status=job.status,
            worker=job.worker,
            created_at=job.created_at,
            started_at=job.started_at,
            ended_at=job.ended_at,
            error=job.error,
        )
