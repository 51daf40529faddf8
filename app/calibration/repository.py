"""The SQL of calibrations: versions of a camera's intrinsics and the photographs behind them."""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.calibration import (
    CalibrationPhoto,
    CalibrationStatus,
    CameraCalibration,
)


def get(session: Session, calibration_id: int) -> CameraCalibration | None:
    """Return a calibration with its camera."""
    return find(session, CameraCalibration, calibration_id, joinedload(CameraCalibration.camera))


def listed(
    session: Session, camera_id: int, paging: Paging
) -> tuple[Sequence[CameraCalibration], str | None]:
    """Return a page of a camera's calibrations, oldest first."""
    statement = sa.select(CameraCalibration).where(CameraCalibration.camera_id == camera_id)
    return fetch_page(session, statement, CameraCalibration.id, paging)


def of_camera(session: Session, camera_id: int) -> Sequence[CameraCalibration]:
    """Return all calibrations of a camera, newest first."""
    return session.scalars(
        sa.select(CameraCalibration)
        .where(CameraCalibration.camera_id == camera_id)
        .order_by(CameraCalibration.number.desc())
    ).all()


def next_number(session: Session, camera_id: int) -> int:
    """Return the number of a camera's next calibration."""
    last = session.scalar(
        sa.select(sa.func.max(CameraCalibration.number)).where(
            CameraCalibration.camera_id == camera_id
        )
    )
    return (last or 0) + 1


def photos(session: Session, calibration_id: int) -> Sequence[CalibrationPhoto]:
    """Return the photographs of a calibration in the order they came in."""
    return session.scalars(
        sa.select(CalibrationPhoto)
        .where(CalibrationPhoto.calibration_id == calibration_id)
        .order_by(CalibrationPhoto.position)
    ).all()


def photo(session: Session, calibration_id: int, position: int) -> CalibrationPhoto | None:
    """Return a photograph of a calibration by its place."""
    return session.scalar(
        sa.select(CalibrationPhoto).where(
            CalibrationPhoto.calibration_id == calibration_id,
            CalibrationPhoto.position == sa.literal(position, sa.BigInteger()),
        )
    )


def of_job(session: Session, workflow_id: str) -> CameraCalibration | None:
    """Return the calibration behind a job."""
    return session.scalar(
        sa.select(CameraCalibration).where(CameraCalibration.workflow_id == workflow_id)
    )


def open_count(session: Session, camera_id: int) -> int:
    """Count a camera's calibrations that are not done yet."""
    return (
        session.scalar(
            sa.select(sa.func.count())
            .select_from(CameraCalibration)
            .where(
                CameraCalibration.camera_id == camera_id,
                CameraCalibration.status.in_((CalibrationStatus.QUEUED, CalibrationStatus.RUNNING)),
            )
        )
        or 0
    )
