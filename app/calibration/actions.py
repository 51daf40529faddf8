"""What callers do with calibrations: the permission, the change and the audit line together."""

from collections.abc import Callable, Sequence
from typing import BinaryIO

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.calibration import service
from app.calibration.schemas import BoardIn
from app.calibration.uploads import take_in
from app.config import Settings
from app.db import Database
from app.edits import flush_edit
from app.jobs import JobClient
from app.sites import actions as sites
from app.storage import Storage
from app.tables.calibration import CameraCalibration


def calibration_for(
    session: Session, access: Access, scope: Scope, calibration_id: int
) -> CameraCalibration:
    """Return a calibration on whose site the caller holds a scope."""
    row = service.get(session, calibration_id)
    access.require(scope, row.camera.site_id)
    return row


def start(
    database: Database,
    storage: Storage,
    settings: Settings,
    jobs: JobClient,
    access: Access,
    camera_id: int,
    board: BoardIn,
    files: Sequence[tuple[str | None, BinaryIO]],
) -> CameraCalibration:
    """Take photographs of a board in and have a worker calibrate the camera by them."""
    with database.reading() as session:
        sites.camera_for(session, access, Scope.REGISTER, camera_id)
    photos = take_in(storage, settings, files)
    with database.writing() as session:
        camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
        row = service.start(session, jobs, camera, board, photos, access.user_id)
        site_id, count = camera.site_id, len(photos)
        record(session, access, "start", "calibration", row.id, site_id, photos=count)
    return row


def leave_out(
    database: Database,
    access: Access,
    calibration_id: int,
    numbers: Sequence[int],
    check: Callable[[CameraCalibration], None],
) -> None:
    """Solve again without some photographs; `check` compares the version that was edited."""
    left_out = frozenset(numbers)
    with database.reading() as session:
        row = calibration_for(session, access, Scope.REGISTER, calibration_id)
        check(row)
        found = service.photos(session, row.id)
        service.check_solvable(row, found, numbers)
        lens = service.solved(row, found, left_out)
    with database.writing() as session:
        row = calibration_for(session, access, Scope.REGISTER, calibration_id)
        check(row)
        found = service.photos(session, row.id)
        service.check_solvable(row, found, numbers)
        service.keep_solution(row, found, left_out, lens)
        flush_edit(session)
        site_id, named = row.camera.site_id, sorted(left_out)
        record(session, access, "solve", "calibration", row.id, site_id, left_out=named)


def activate(session: Session, access: Access, row: CameraCalibration) -> None:
    """Make a version the one its camera uses."""
    service.activate(session, row, access.user_id)
    camera = row.camera_id
    record(session, access, "activate", "calibration", row.id, row.camera.site_id, camera=camera)
