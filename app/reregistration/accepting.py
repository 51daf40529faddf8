"""From a pointing to a viewport: its times, its registration, and what it rests on.

A camera looks one way at a time, so accepting a pointing ends the viewport that held its images
until now. Nothing that was made is touched: runs and poses keep the registration they were made
with; only where images belong from now on changes.
"""

from datetime import datetime, timedelta
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.db import now
from app.domain.arrays import FloatArray
from app.domain.reregistration import MOVEMENT_ALARM_DEG
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix
from app.errors import Conflict, FieldError
from app.registration import service as registration
from app.registration.schemas import ViewportIn, ViewportPatch
from app.reregistration import repository
from app.reregistration.schemas import AcceptIn
from app.sites.fields import in_zone
from app.tables.registration import Registration, RegistrationMethod
from app.tables.reregistration import Pointing, PointingState
from app.tables.sites import Viewport

A_MOMENT = timedelta(seconds=1)


def accept(session: Session, pointing: Pointing, data: AcceptIn, user_id: int | None) -> Viewport:
    """Make a pointing a viewport with a registration; returns the viewport.

    A pointing that looks as registered and only needs the reference's times widened widens them.
    Raises Conflict when it was decided already, or for times other viewports hold.
    """
    refuse_decided(pointing)
    reference = pointing.reregistration.viewport
    begin, end = times_of(session, pointing)
    timezone = reference.camera.timezone
    if data.valid_from is not None:
        begin = in_zone(data.valid_from, timezone, "valid_from")
    if data.valid_until is not None:
        end = in_zone(data.valid_until, timezone, "valid_until")
    viewport = None if data.name else _widened(session, pointing, begin, end)
    if viewport is None:
        viewport = _new_viewport(session, pointing, data.name, begin, end)
        registration.keep(session, turned_registration(session, pointing, viewport.id, user_id))
    _decide(pointing, PointingState.ACCEPTED, user_id)
    pointing.viewport_id = viewport.id
    session.flush()
    return viewport


def _widened(
    session: Session, pointing: Pointing, begin: datetime, end: datetime | None
) -> Viewport | None:
    """Widen the reference to a pointing that has not moved; None where that cannot be."""
    if pointing.angle_deg > MOVEMENT_ALARM_DEG:
        return None
    reference = pointing.reregistration.viewport
    own_begin, own_end = reference.valid_from, reference.valid_until
    wider = ViewportPatch(
        valid_from=own_begin and min(own_begin, begin),
        valid_until=own_end and end and max(own_end, end),
    )
    try:
        with session.begin_nested():
            return registration.update_viewport(session, reference, wider)
    except Conflict:
        return None  # another viewport lies between: it is a stretch of time of its own


def _new_viewport(
    session: Session,
    pointing: Pointing,
    name: str | None,
    begin: datetime,
    end: datetime | None,
) -> Viewport:
    reference = pointing.reregistration.viewport
    _end_others(session, reference, begin)
    data = ViewportIn(
        camera_id=reference.camera_id,
        name=name or _free_name(session, reference, begin),
        valid_from=begin,
        valid_until=end,
    )
    return registration.create_viewport(session, data)


def reject(session: Session, pointing: Pointing, user_id: int | None) -> None:
    """Put a pointing aside; its images stay where they are. Raises Conflict when decided."""
    refuse_decided(pointing)
    _decide(pointing, PointingState.REJECTED, user_id)
    session.flush()


def refuse_decided(pointing: Pointing) -> None:
    """Raise Conflict unless a pointing still waits for a decision."""
    if pointing.state is not PointingState.PROPOSED:
        raise Conflict(f"this pointing is {pointing.state.value} already")


def keep_unmoved(session: Session, pointing: Pointing) -> bool:
    """Settle a pointing whose images all belong to the reference, and look as it does.

    Returns whether it was so.
    """
    if pointing.angle_deg > MOVEMENT_ALARM_DEG:
        return False
    reference = pointing.reregistration.viewport
    rows = repository.images(session, pointing.reregistration_id, pointing_id=pointing.id)
    if any(row.image.viewport_id != reference.id for row in rows):
        return False
    _decide(pointing, PointingState.ACCEPTED, None)
    pointing.viewport_id = reference.id
    pointing.note = "looks as registered"
    session.flush()
    return True


def times_of(session: Session, pointing: Pointing) -> tuple[datetime, datetime | None]:
    """Return from when until when (None: open) a pointing's viewport is best valid.

    It begins with its first image and ends where the next pointing or viewport begins, or where
    the viewport ended that held its images until now.
    """
    begin = pointing.first_at
    ends = [
        other.first_at
        for other in repository.pointings(session, pointing.reregistration_id)
        if other.first_at > begin
    ]
    for viewport in _viewports(session, pointing):
        if viewport.valid_from is not None and viewport.valid_from > begin:
            ends.append(viewport.valid_from)
        elif viewport.valid_until is not None and viewport.valid_until > begin:
            ends.append(viewport.valid_until)
    end = min(ends, default=None)
    if end is not None and end <= pointing.last_at:
        end = pointing.last_at + A_MOMENT
    return begin, end


def turned_registration(
    session: Session, pointing: Pointing, viewport_id: int, user_id: int | None
) -> Registration:
    """Return the reference's registration, turned as the pointing is; not yet stored.

    The place and the intrinsics stay. Its covariance is the reference's, turned along, and the
    turn's own: `R = exp([omega]) R_found`, so omega = omega_turn + R_turn omega_reference.
    """
    source = pointing.reregistration.registration
    turn_matrix = matrix_from_rotvec(pointing.rotation_from_reference)
    rotation = rotvec_from_matrix(turn_matrix @ matrix_from_rotvec(source.rotation or (0, 0, 0)))
    best = repository.strongest(session, pointing.id)
    provenance: dict[str, Any] = {
        "from_registration_id": source.id,
        "reregistration_id": pointing.reregistration_id,
        "pointing_id": pointing.id,
        "reference_image_id": pointing.reregistration.reference_image_id,
        "image_count": pointing.image_count,
        "angle_deg": pointing.angle_deg,
        "keyframe_image_ids": best.keyframe_ids if best else [],
        "inliers": best.inliers if best else None,
        "hull_share": best.hull_share if best else None,
        "rmse_px": best.rmse_px if best else None,
    }
    return Registration(
        viewport_id=viewport_id,
        method=RegistrationMethod.ROTATION,
        rotation=rotation.tolist(),
        center_lat_deg=source.center_lat_deg,
        center_lon_deg=source.center_lon_deg,
        center_height_m=source.center_height_m,
        intrinsics=source.intrinsics,
        covariance=_covariance(source.covariance, np.array(pointing.covariance), turn_matrix),
        residuals=[],
        warnings=[],
        provenance=provenance,
        created_by_id=user_id,
    )


def _covariance(
    reference: list[list[float]] | None, turn: FloatArray, turn_matrix: FloatArray
) -> list[list[float]] | None:
    if reference is None:
        return None
    whole = np.array(reference)[:6, :6]
    along = np.eye(6)
    along[:3, :3] = turn_matrix
    turned = along @ whole @ along.T
    turned[:3, :3] += turn
    covariance: list[list[float]] = turned.tolist()
    return covariance


def _decide(pointing: Pointing, state: PointingState, user_id: int | None) -> None:
    pointing.state = state
    pointing.decided_at = now()
    pointing.decided_by_id = user_id


def _viewports(session: Session, pointing: Pointing) -> list[Viewport]:
    camera_id = pointing.reregistration.viewport.camera_id
    return list(repository.viewports_of_camera(session, camera_id))


def _end_others(session: Session, reference: Viewport, begin: datetime) -> None:
    """End, at the new one's beginning, the viewport that is valid then."""
    for viewport in repository.viewports_of_camera(session, reference.camera_id):
        has_begun = viewport.valid_from is None or viewport.valid_from < begin
        goes_on = viewport.valid_until is None or viewport.valid_until > begin
        if has_begun and goes_on:
            registration.update_viewport(session, viewport, ViewportPatch(valid_until=begin))
        elif viewport.valid_from == begin:
            message = f"viewport {viewport.name!r} begins at the very same moment"
            raise Conflict(message, fields=(FieldError("valid_from", message),))


def _free_name(session: Session, reference: Viewport, begin: datetime) -> str:
    taken = {
        viewport.name for viewport in repository.viewports_of_camera(session, reference.camera_id)
    }
    base = f"{reference.name.partition(', from ')[0][:150]}, from {begin:%Y-%m-%d %H:%M}"
    if base not in taken:
        return base
    return next(name for number in range(2, 10_000) if (name := f"{base} ({number})") not in taken)
