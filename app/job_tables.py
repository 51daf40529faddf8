"""The job engine's own tables, as far as a backup, a monitor or a list needs to see them.

Beside `app.jobs` the only module that knows the engine. What these tables say of jobs that ended,
and of the steps of those under way, is of no use elsewhere: a job that had not ended when a backup
was made begins anew after a restore, and each kind of job goes on from what its rows say is done.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any

import sqlalchemy as sa

ENGINE_SCHEMA = "dbos"
LONGEST_REASON = 500
_UNENDED = ("ENQUEUED", "PENDING", "DELAYED")
_metadata = sa.MetaData()
_status = sa.Table(
    "workflow_status",
    _metadata,
    sa.Column("workflow_uuid", sa.Text, primary_key=True),
    sa.Column("name", sa.Text),
    sa.Column("status", sa.Text),
    sa.Column("queue_name", sa.Text),
    sa.Column("inputs", sa.Text),
    sa.Column("created_at", sa.BigInteger),
    sa.Column("started_at_epoch_ms", sa.BigInteger),
    sa.Column("completed_at", sa.BigInteger),
    sa.Column("executor_id", sa.Text),
    schema=ENGINE_SCHEMA,
)
_input = sa.Table(
    "workflow_input",
    _metadata,
    sa.Column("workflow_uuid", sa.Text, primary_key=True),
    sa.Column("inputs", sa.Text),
    schema=ENGINE_SCHEMA,
)
_output = sa.Table(
    "workflow_output",
    _metadata,
    sa.Column("workflow_uuid", sa.Text, primary_key=True),
    sa.Column("error", sa.Text),
    schema=ENGINE_SCHEMA,
)
# What is kept of a job under its id; the datasource's notes would make a job of the same id skip
# the steps that it did before.
_OF_JOBS = (
    ("datasource_outputs", "workflow_id"),
    ("operation_outputs", "workflow_uuid"),
    ("workflow_events_history", "workflow_uuid"),
    ("workflow_events", "workflow_uuid"),
    ("workflow_output", "workflow_uuid"),
    ("workflow_input", "workflow_uuid"),
    ("workflow_status", "workflow_uuid"),
)


class JobStatus(StrEnum):
    """Where a job stands."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def has_ended(self) -> bool:
        """Whether nothing more comes of it by itself."""
        return self not in {JobStatus.QUEUED, JobStatus.RUNNING}


_STATUSES = {
    "ENQUEUED": JobStatus.QUEUED,
    "DELAYED": JobStatus.QUEUED,
    "PENDING": JobStatus.RUNNING,
    "SUCCESS": JobStatus.SUCCEEDED,
    "CANCELLED": JobStatus.CANCELLED,
}


@dataclass(frozen=True, slots=True)
class Job:
    """A job, ended or not, with the worker that has or had it."""

    job_id: str
    name: str
    queue: str | None  # the engine forgets it when a job is cancelled
    arguments: Sequence[Any]
    status: JobStatus
    worker: str | None
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    error: str | None


@dataclass(frozen=True, slots=True)
class UnendedJob:
    """A job that is queued or under way, as it was enqueued."""

    job_id: str
    name: str
    queue: str
    arguments: Sequence[Any]


def unended_jobs(connection: sa.Connection) -> list[UnendedJob]:
    """Return the jobs that are queued or under way, oldest first."""
    inputs = sa.func.coalesce(_input.c.inputs, _status.c.inputs)
    statement = (
        sa.select(_status.c.workflow_uuid, _status.c.name, _status.c.queue_name, inputs)
        .outerjoin(_input, _input.c.workflow_uuid == _status.c.workflow_uuid)
        .where(_status.c.status.in_(_UNENDED), _status.c.queue_name.is_not(None))
        .order_by(_status.c.created_at, _status.c.workflow_uuid)
    )
    return [
        UnendedJob(job_id, name, queue, json.loads(given)["positionalArgs"])
        for job_id, name, queue, given in _here(connection).execute(statement)
    ]


def list_jobs(
    connection: sa.Connection, limit: int, offset: int = 0, job_id: str | None = None
) -> list[Job]:
    """Return jobs, the newest first; only the one with an id where that is given."""
    inputs = sa.func.coalesce(_input.c.inputs, _status.c.inputs).label("given")
    statement = (
        sa.select(_status, inputs, _output.c.error)
        .outerjoin(_input, _input.c.workflow_uuid == _status.c.workflow_uuid)
        .outerjoin(_output, _output.c.workflow_uuid == _status.c.workflow_uuid)
        .order_by(_status.c.created_at.desc(), _status.c.workflow_uuid)
        .limit(limit)
        .offset(offset)
    )
    if job_id is not None:
        statement = statement.where(_status.c.workflow_uuid == job_id)
    return [
        Job(
            job_id=row.workflow_uuid,
            name=row.name,
            queue=row.queue_name,
            arguments=json.loads(row.given)["positionalArgs"],
            status=_STATUSES.get(row.status, JobStatus.FAILED),
            worker=row.executor_id,
            created_at=_moment(row.created_at),
            started_at=row.started_at_epoch_ms and _moment(row.started_at_epoch_ms),
            ended_at=row.completed_at and _moment(row.completed_at),
            error=_reason(row.error),
        )
        for row in _here(connection).execute(statement)
    ]


def _reason(error: str | None) -> str | None:
    """Return the first line of what a job failed with."""
    if not error:
        return None
    told = json.loads(error)
    message = str(told.get("message", "") if isinstance(told, dict) else told).strip()
    return message.splitlines()[0][:LONGEST_REASON] if message else None


def _moment(epoch_ms: int) -> datetime:
    return datetime.fromtimestamp(epoch_ms / 1000, UTC)


def count_unended(connection: sa.Connection) -> dict[tuple[str, str], int]:
    """Count the jobs that are queued or under way, by queue and status."""
    statement = (
        sa.select(_status.c.queue_name, _status.c.status, sa.func.count())
        .where(_status.c.status.in_(_UNENDED), _status.c.queue_name.is_not(None))
        .group_by(_status.c.queue_name, _status.c.status)
    )
    return {(queue, status): n for queue, status, n in _here(connection).execute(statement)}


def forget_jobs(connection: sa.Connection, job_id: str | None = None) -> None:
    """Forget all jobs, ended or not, or the one with an id."""
    for name, column in _OF_JOBS:
        table = sa.table(name, sa.column(column), schema=_schema(connection))
        statement = sa.delete(table)
        if job_id is not None:
            statement = statement.where(table.c[column] == job_id)
        connection.execute(statement)


def _schema(connection: sa.Connection) -> str | None:
    return None if connection.dialect.name == "sqlite" else ENGINE_SCHEMA


def _here(connection: sa.Connection) -> sa.Connection:
    """Return the connection with the tables where its database has them: SQLite has no schemas."""
    return connection.execution_options(schema_translate_map={ENGINE_SCHEMA: _schema(connection)})
