"""Calibrations: photographs taken in, corners looked for by a worker, lenses solved, versions.

The corners are kept, so leaving a photograph out and solving again needs no search. A camera's
intrinsics only change when somebody activates a version; registrations made before keep theirs,
because each holds its own.
"""

import uuid
from collections.abc import Container, Sequence

import numpy as np
from sqlalchemy.orm import Session

from app.calibration import repository
from app.calibration.schemas import BoardIn
from app.calibration.uploads import Taken
from app.db import now
from app.domain.calibration import Board, LensSolution, solve_lens
from app.edits import flush_edit
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.jobs import JobClient, JobQueue
from app.paging import Paging
from app.registration.conversion import intrinsics_of, intrinsics_to_json
from app.tables.calibration import (
    CalibrationPhoto,
    CalibrationSource,
    CalibrationStatus,
    CameraCalibration,
)
from app.tables.sites import Camera

CALIBRATION_JOB = "calibrate"
NO_CALIBRATION = "there is no such calibration"
OPEN = frozenset({CalibrationStatus.QUEUED, CalibrationStatus.RUNNING})
MOST_OPEN = 3
OUTLIER = "fits far worse than the others: blurred, a bent board, or a wrong corner"


def start(
    session: Session,
    jobs: JobClient,
    camera: Camera,
    board: BoardIn,
    photos: Sequence[Taken],
    user_id: int | None,
) -> CameraCalibration:
    """Store a calibration with its photographs and have a worker look for the corners.

    Raises Conflict when too many wait for the same camera.
    """
    if repository.open_count(session, camera.id) >= MOST_OPEN:
        raise Conflict(f"{MOST_OPEN} calibrations of this camera are not done yet; wait for them")
    row = CameraCalibration(
        camera_id=camera.id,
        number=repository.next_number(session, camera.id),
        source=CalibrationSource.CHEQUERBOARD,
        corner_columns=board.columns,
        corner_rows=board.rows,
        square_mm=board.square_mm,
        workflow_id=f"calibrate-{uuid.uuid4()}",
        created_by_id=user_id,
    )
    session.add(row)
    session.flush()
    session.add_all(
        CalibrationPhoto(
            calibration_id=row.id,
            position=position,
            file_name=photo.file_name,
            sha256=photo.sha256,
            media_type=photo.media_type,
            problem=_wrong_size(photo, camera),
        )
        for position, photo in enumerate(photos, 1)
    )
    session.flush()
    jobs.enqueue(
        session, CALIBRATION_JOB, row.id, queue=JobQueue.SHORT, job_id=row.workflow_id or ""
    )
    return row


def _wrong_size(photo: Taken, camera: Camera) -> str | None:
    if (photo.width_px, photo.height_px) == (camera.width_px, camera.height_px):
        return None
    return (
        f"wrong size: {photo.width_px} x {photo.height_px} px, but the camera takes "
        f"{camera.width_px} x {camera.height_px} px; give the originals"
    )


def get(session: Session, calibration_id: int) -> CameraCalibration:
    """Return a calibration. Raises NotFound."""
    row = repository.get(session, calibration_id)
    if row is None:
        raise NotFound(NO_CALIBRATION)
    return row


def list_calibrations(
    session: Session, camera_id: int, paging: Paging
) -> tuple[Sequence[CameraCalibration], str | None]:
    """Return a page of a camera's calibrations, oldest first."""
    return repository.listed(session, camera_id, paging)


def history(session: Session, camera_id: int) -> Sequence[CameraCalibration]:
    """Return all calibrations of a camera, newest first."""
    return repository.of_camera(session, camera_id)


def photos(session: Session, calibration_id: int) -> Sequence[CalibrationPhoto]:
    """Return the photographs of a calibration."""
    return repository.photos(session, calibration_id)


def get_photo(session: Session, calibration_id: int, number: int) -> CalibrationPhoto:
    """Return a photograph of a calibration by its number. Raises NotFound."""
    photo = repository.photo(session, calibration_id, number)
    if photo is None:
        raise NotFound(NO_CALIBRATION)
    return photo


def board_of(row: CameraCalibration) -> Board:
    """Return the board that a calibration's photographs show."""
    return Board(row.corner_columns or 0, row.corner_rows or 0, (row.square_mm or 0.0) / 1000)


def is_active(row: CameraCalibration) -> bool:
    """Whether a camera uses this version now."""
    if row.activated_at is None or row.intrinsics is None:
        return False
    return row.intrinsics == intrinsics_to_json(intrinsics_of(row.camera))


def solved(
    row: CameraCalibration, found: Sequence[CalibrationPhoto], left_out: Container[int]
) -> LensSolution | str:
    """Solve the lens from the photographs that take part; the reason where they carry none.

    Touches no database: solving takes its time.
    """
    views = [
        np.array(photo.corners, dtype=np.float64) for photo in found if _takes_part(photo, left_out)
    ]
    try:
        return solve_lens(board_of(row), views, row.camera.width_px, row.camera.height_px)
    except ValueError as error:
        return str(error)


def keep_solution(
    row: CameraCalibration,
    found: Sequence[CalibrationPhoto],
    left_out: Container[int],
    lens: LensSolution | str,
) -> None:
    """Store a solution, or why there is none, and each photograph's own error."""
    used = [photo for photo in found if _takes_part(photo, left_out)]
    for photo in found:
        photo.is_left_out = photo.position in left_out
        photo.rms_px = photo.tilt_deg = None
    row.finished_at = now()
    if isinstance(lens, str):
        row.status, row.error, row.warnings = CalibrationStatus.FAILED, lens, []
        row.intrinsics = row.deviations = row.rms_px = row.coverage = None
    else:
        row.status, row.error = CalibrationStatus.SOLVED, None
        _keep(row, used, lens)


def _takes_part(photo: CalibrationPhoto, left_out: Container[int]) -> bool:
    is_sound = photo.problem is None or photo.problem == OUTLIER
    return photo.corners is not None and photo.position not in left_out and is_sound


def _keep(row: CameraCalibration, used: Sequence[CalibrationPhoto], lens: LensSolution) -> None:
    row.intrinsics = intrinsics_to_json(lens.intrinsics)
    names = ("fx_px", "fy_px", "cx_px", "cy_px")
    row.deviations = dict(zip(names, lens.deviations_px.tolist(), strict=True))
    row.rms_px, row.coverage = lens.rms_px, lens.coverage
    row.warnings = list(lens.warnings)
    for index, photo in enumerate(used):
        photo.rms_px = float(lens.view_rms_px[index])
        photo.tilt_deg = float(lens.view_tilt_deg[index])
        photo.problem = OUTLIER if index in lens.outliers else None


def check_solvable(
    row: CameraCalibration, found: Sequence[CalibrationPhoto], numbers: Sequence[int]
) -> None:
    """Raise Conflict or Invalid unless these photographs can be left out and the rest solved.

    An active version stays what it was when it was activated.
    """
    if row.source is not CalibrationSource.CHEQUERBOARD:
        raise Conflict("this version was typed in; there is nothing to solve")
    if row.status in OPEN:
        raise Conflict("its photographs are still looked at; wait until that is done")
    if row.activated_at is not None:
        raise Conflict("this version has been in use, so it stays as it is; upload a new set")
    unknown = set(numbers) - {photo.position for photo in found}
    if unknown:
        raise Invalid.field("left_out", f"there is no photograph number {min(unknown)}")


def activate(session: Session, row: CameraCalibration, user_id: int | None) -> None:
    """Make a version the one its camera uses. Raises Conflict for one that is not solved.

    What the camera had before is kept as a version too, so that one can go back to it.
    """
    if row.intrinsics is None or row.status is not CalibrationStatus.SOLVED:
        raise Conflict("only a solved calibration can be used; see what its photographs lack")
    camera = row.camera
    size = (row.intrinsics["width_px"], row.intrinsics["height_px"])
    if size != (camera.width_px, camera.height_px):
        message = f"is for {size[0]} x {size[1]} px, which the camera no longer takes"
        raise Conflict(f"it {message}", fields=(FieldError("size", message),))
    _keep_present(session, camera)
    for name in ("fx_px", "fy_px", "cx_px", "cy_px", "distortion"):
        setattr(camera, name, row.intrinsics[name])
    row.activated_at, row.activated_by_id = now(), user_id
    flush_edit(session)


def _keep_present(session: Session, camera: Camera) -> None:
    present = intrinsics_to_json(intrinsics_of(camera))
    versions = repository.of_camera(session, camera.id)
    if any(version.activated_at and version.intrinsics == present for version in versions):
        return
    session.add(
        CameraCalibration(
            camera_id=camera.id,
            number=repository.next_number(session, camera.id),
            source=CalibrationSource.ENTERED,
            status=CalibrationStatus.SOLVED,
            intrinsics=present,
            finished_at=now(),
            activated_at=camera.created_at,
        )
    )


def mark(
    session: Session, calibration_id: int, status: CalibrationStatus, error: str | None = None
) -> None:
    """Set where a calibration stands, unless it has ended already."""
    row = repository.get(session, calibration_id)
    if row is not None and row.status in OPEN:
        row.status, row.error = status, error
        if status not in OPEN:
            row.finished_at = now()
        session.flush()


def fail_job(session: Session, workflow_id: str, reason: str) -> None:
    """Mark the calibration behind a job as failed, with the reason."""
    row = repository.of_job(session, workflow_id)
    if row is not None:
        mark(session, row.id, CalibrationStatus.FAILED, reason)
