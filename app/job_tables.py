"""The job engine's own tables, as far as a backup, a monitor or a list needs to see them.

Beside `app.jobs` the only module that knows the engine. What these tables say of jobs that ended,
and of the steps of those under way, is of no use elsewhere: a job that had not ended when a backup
was made begins anew after a restore, and each kind of job goes on from what its rows say is done.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa

ENGINE_SCHEMA = "dbos"
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
    schema=ENGINE_SCHEMA,
)
_input = sa.Table(
    "workflow_input",
    _metadata,
    sa.Column("workflow_uuid", sa.Text, primary_key=True),
    sa.Column("inputs", sa.Text),
    schema=ENGINE_SCHEMA,
)
# What is kept of a job under its id; the datasource's notes would make a job of the same id skip
# the steps that it did before.
_OF_JOBS = (
    "datasource_outputs",
    "operation_outputs",
    "workflow_events_history",
    "workflow_events",
    "workflow_output",
    "workflow_input",
    "workflow_status",
)


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


def count_unended(connection: sa.Connection) -> dict[tuple[str, str], int]:
    """Count the jobs that are queued or under way, by queue and status."""
    statement = (
        sa.select(_status.c.queue_name, _status.c.status, sa.func.count())
        .where(_status.c.status.in_(_UNENDED), _status.c.queue_name.is_not(None))
        .group_by(_status.c.queue_name, _status.c.status)
    )
    return {(queue, status): n for queue, status, n in _here(connection).execute(statement)}


def forget_jobs(connection: sa.Connection) -> None:
    """Forget all jobs, ended or not."""
    for name in _OF_JOBS:
        connection.execute(sa.delete(sa.table(name, schema=_schema(connection))))


def _schema(connection: sa.Connection) -> str | None:
    return None if connection.dialect.name == "sqlite" else ENGINE_SCHEMA


def _here(connection: sa.Connection) -> sa.Connection:
    """Return the connection with the tables where its database has them: SQLite has no schemas."""
    return connection.execution_options(schema_translate_map={ENGINE_SCHEMA: _schema(connection)})
