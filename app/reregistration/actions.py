"""What callers do with re-registrations: the permission, the change and the audit line together."""

from collections.abc import Callable, Sequence
from typing import TypeVar

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.db import Database
from app.jobs import JobClient
from app.paging import Page, Paging, encode_cursor
from app.registration import actions as registration
from app.reregistration import accepting, service
from app.reregistration.schemas import AcceptIn, ReregistrationIn
from app.tables.reregistration import Pointing, Reregistration, ReregistrationImage

Item = TypeVar("Item")


def reregistration_for(
    session: Session, access: Access, scope: Scope, reregistration_id: int
) -> Reregistration:
    """Return a re-registration on whose site the caller holds a scope."""
    row = service.get(session, reregistration_id)
    access.require(scope, row.site_id)
    return row


def pointing_for(session: Session, access: Access, scope: Scope, pointing_id: int) -> Pointing:
    """Return a pointing on whose site the caller holds a scope."""
    pointing = service.get_pointing(session, pointing_id)
    access.require(scope, pointing.reregistration.site_id)
    return pointing


def start(
    session: Session, jobs: JobClient, access: Access, viewport_id: int, data: ReregistrationIn
) -> Reregistration:
    """Start a re-registration from a viewport the caller may register."""
    viewport = registration.viewport_for(session, access, Scope.REGISTER, viewport_id)
    row = service.start(session, jobs, viewport, data, access.user_id)
    record(session, access, "start", "reregistration", row.id, row.site_id, images=row.image_count)
    return row


def cancel(database: Database, jobs: JobClient, access: Access, reregistration_id: int) -> None:
    """Stop a re-registration; an ended one stays as it is."""
    with database.reading() as session:
        row = reregistration_for(session, access, Scope.REGISTER, reregistration_id)
    if row.status in service.ENDED:
        return
    # Before any row is written here: the job engine writes on a connection of its own.
    jobs.cancel(row.workflow_id)
    with database.writing() as session:
        if service.mark_cancelled(session, row.id):
            record(session, access, "cancel", "reregistration", row.id, row.site_id)


def accept(session: Session, access: Access, pointing_id: int, data: AcceptIn) -> Pointing:
    """Make a pointing a viewport."""
    pointing = pointing_for(session, access, Scope.REGISTER, pointing_id)
    viewport = accepting.accept(session, pointing, data, access.user_id)
    site_id = pointing.reregistration.site_id
    record(session, access, "accept", "pointing", pointing.id, site_id, viewport_id=viewport.id)
    return pointing


def reject(session: Session, access: Access, pointing_id: int) -> Pointing:
    """Put a pointing aside."""
    pointing = pointing_for(session, access, Scope.REGISTER, pointing_id)
    accepting.reject(session, pointing, access.user_id)
    site_id = pointing.reregistration.site_id
    record(session, access, "reject", "pointing", pointing.id, site_id)
    return pointing


def page_of(
    rows: Sequence[ReregistrationImage],
    paging: Paging,
    shown: Callable[[ReregistrationImage], Item],
) -> Page[Item]:
    """Return a page of images in order of time, of one more row than it may hold."""
    more = len(rows) > paging.limit
    kept = rows[: paging.limit]
    cursor = encode_cursor(kept[-1].position + 1) if more else None
    return Page(items=[shown(row) for row in kept], next_cursor=cursor)
