"""SQL of what jobs are about: the rows that wait for a job say so in a `status` of their own.

Runs, exports, calibrations and the like all name their job in `workflow_id`. So a job can be
cancelled or tried again without knowing what kind it is.
"""

from collections.abc import Iterator

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import Base, now

QUEUED, CANCELLED, FAILED = "queued", "cancelled", "failed"


def reopen(session: Session, job_id: str) -> None:
    """Let what a job is about wait for it again."""
    for table in _tables_of_jobs():
        values: dict[str, object] = {"status": QUEUED, "error": None, "finished_at": None}
        _set(session, table, job_id, values)


def close(session: Session, job_id: str) -> None:
    """Say that what a job is about comes to nothing, unless it has ended already."""
    for table in _tables_of_jobs():
        allowed = getattr(table.c.status.type, "enums", ())
        status = CANCELLED if CANCELLED in allowed else FAILED
        error = None if status == CANCELLED else "cancelled by an administrator"
        values: dict[str, object] = {"status": status, "error": error, "finished_at": now()}
        _set(session, table, job_id, values, open_only=True)


def site_of(session: Session, job_id: str) -> int | None:
    """Return the site of what a job is about, where it has one."""
    for table in _tables_of_jobs():
        if "site_id" in table.c:
            statement = sa.select(table.c.site_id).where(table.c.workflow_id == job_id)
            site_id = session.scalar(statement)
            if site_id is not None:
                return int(site_id)
    return None


def _tables_of_jobs() -> Iterator[sa.Table]:
    for table in Base.metadata.tables.values():
        if {"workflow_id", "status"} <= set(table.c.keys()):
            yield table


def _set(
    session: Session,
    table: sa.Table,
    job_id: str,
    values: dict[str, object],
    *,
    open_only: bool = False,
) -> None:
    known = {name: value for name, value in values.items() if name in table.c}
    statement = sa.update(table).where(table.c.workflow_id == job_id)
    if open_only and "finished_at" in table.c:
        statement = statement.where(table.c.finished_at.is_(None))
    session.execute(statement.values(known))
