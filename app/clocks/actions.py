"""What callers do with clocks: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.clocks import service
from app.clocks.schemas import EstimateIn, OffsetIn
from app.errors import Invalid, looked_up_by
from app.jobs import JobClient
from app.runs import actions as runs
from app.sites import actions as sites
from app.sites.fields import in_zone
from app.tables.clock import ClockEstimate, ClockOffset, OffsetSource
from app.tables.sites import Camera


def add_offset(session: Session, access: Access, camera: Camera, data: OffsetIn) -> ClockOffset:
    """Correct a camera's clock by a person's word, or by an estimate's."""
    if data.estimate_id is not None:
        with looked_up_by("estimate_id"):
            estimate = service.get_estimate(session, data.estimate_id)
        if estimate.camera_id != camera.id:
            raise Invalid.field("estimate_id", "is of another camera")
        row = service.offset_of_estimate(estimate)
    elif data.offset_s is None:
        raise Invalid.field("offset_s", "say by how many seconds the clock is off")
    else:
        zone = camera.timezone
        row = ClockOffset(
            camera_id=camera.id,
            offset_s=data.offset_s,
            valid_from=data.valid_from and in_zone(data.valid_from, zone, "valid_from"),
            valid_until=data.valid_until and in_zone(data.valid_until, zone, "valid_until"),
            source=OffsetSource.GIVEN,
            note=data.note,
            concerns_given=data.concerns_given,
        )
    row.created_by_id = access.user_id
    changed = service.add_offset(session, row)
    record(
        session,
        access,
        "apply",
        "clock offset",
        row.id,
        camera.site_id,
        camera=camera.id,
        offset_s=row.offset_s,
        images=changed,
    )
    return row


def undo(session: Session, access: Access, offset_id: int) -> ClockOffset:
    """Take a correction of a clock back."""
    row = service.get_offset(session, offset_id)
    camera = sites.camera_for(session, access, Scope.REGISTER, row.camera_id)
    changed = service.undo(session, row)
    record(session, access, "undo", "clock offset", row.id, camera.site_id, images=changed)
    return row


def start_estimate(
    session: Session, jobs: JobClient, access: Access, camera: Camera, data: EstimateIn
) -> ClockEstimate:
    """Have a worker tell a camera's clock from a run's images."""
    with looked_up_by("run_id"):
        run = runs.run_for(session, access, Scope.READ, data.run_id)
    zone = camera.timezone
    begin = data.begin and in_zone(data.begin, zone, "begin")
    end = data.end and in_zone(data.end, zone, "end")
    row = service.start_estimate(session, jobs, camera, run, begin, end, access.user_id)
    record(session, access, "start", "clock estimate", row.id, camera.site_id, run=run.id)
    return row
