"""Corrections: a pose as a person would have it, beside the generated one, in versions.

The newest version counts; deleting it brings the generated pose back, and everything stays
readable. Two people who correct the same pose at once do not overwrite each other: the second is
told what stands now and how it differs from what was sent, so that it can be merged by hand.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from sqlalchemy.orm import Session

from app.db import now
from app.domain.geodesy import Geodetic
from app.domain.upright_box import UprightBox, local_of, view_axes_in_local
from app.errors import Invalid, NotFound
from app.reviews import correction_repository as repository
from app.reviews import grade_repository, placing
from app.reviews.placing import PlacedPose
from app.runs import service as runs
from app.runs.pose_columns import pixels
from app.tables.reviews import Correction, CorrectionKind
from app.tables.runs import Pose

# Differences smaller than these are rounding: a millimetre, a thousandth of a degree.
_SAME = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """Where the centre of a box's bottom shall be; exactly one of the three pairs is given."""

    lat_lon_deg: tuple[float, float] | None = None
    east_north_m: tuple[float, float] | None = None
    across_away_m: tuple[float, float] | None = None


def placed(session: Session, pose: Pose) -> PlacedPose:
    """Put a pose before its run's camera."""
    return placing.place(session, pose, runs.get_run(session, pose.run_id).registration_id)


def lock(session: Session, pose_id: int) -> Correction | None:
    """Let nobody else correct a pose until the transaction ends; returns its newest correction."""
    grade_repository.lock(session, [pose_id])
    return repository.newest(session, pose_id)


def all_of(session: Session, pose_id: int) -> Sequence[Correction]:
    """Return all corrections of a pose, deleted ones too, newest first."""
    return repository.all_of(session, pose_id)


def local_box(here: PlacedPose, correction: Correction) -> UprightBox:
    """Return the box of a correction in the frame at the pose's reference."""
    base = Geodetic(correction.lat_deg, correction.lon_deg, correction.base_height_m)
    east, north, up = local_of(here.frame, here.reference, base).tolist()
    return UprightBox(
        east,
        north,
        up,
        correction.heading_deg,
        correction.length_m,
        correction.width_m,
        correction.height_m,
    )


def present_box(here: PlacedPose, newest: Correction | None) -> UprightBox:
    """Return the box that counts: the correction's, or else the generated one."""
    if newest is None or newest.deleted_at is not None:
        return here.generated
    return local_box(here, newest)


def box_at(
    here: PlacedPose,
    spot: Spot,
    heading_deg: float,
    size_m: tuple[float, float, float],
    up_m: float,
) -> UprightBox:
    """Return the box that a person asked for. Raises Invalid naming the place."""
    if spot.lat_lon_deg is not None:
        place = Geodetic(*spot.lat_lon_deg, here.reference.height_m + up_m)
        east, north, _ = local_of(here.frame, here.reference, place).tolist()
    elif spot.across_away_m is not None:
        try:
            across, away = view_axes_in_local(here.camera_in_local)
        except ValueError as error:
            raise Invalid.field("across_m", str(error)) from error
        moved = spot.across_away_m[0] * across + spot.across_away_m[1] * away
        east, north = float(moved[0]), float(moved[1])
    elif spot.east_north_m is not None:
        east, north = spot.east_north_m
    else:
        raise Invalid.field("lat_deg", "give lat_deg and lon_deg, or metres from the reference")
    if np.hypot(east, north) > 20_000:
        raise Invalid.field("lat_deg", "lies more than 20 km from where the vessel was seen")
    return UprightBox(east, north, up_m, heading_deg % 360, *size_m)


def differences(mine: UprightBox, theirs: UprightBox) -> list[dict[str, object]]:
    """Return where two boxes differ: field, yours, theirs."""
    other = asdict(theirs)
    return [
        {"field": name, "yours": value, "theirs": other[name]}
        for name, value in asdict(mine).items()
        if abs(value - other[name]) > _SAME
    ]


def correct(
    session: Session,
    here: PlacedPose,
    newest: Correction | None,
    user_id: int,
    box: UprightBox,
    comment: str | None,
) -> Correction:
    """Store an edited box as the next version. Raises Invalid where no corner is in sight."""
    drawn = placing.draw(here, box)
    if not np.isfinite(drawn.corners_in_image_px).all(axis=1).any():
        raise Invalid.field("lat_deg", "the box would lie behind the camera or beyond its lens")
    stands = newest is not None and newest.deleted_at is None
    correction = Correction(
        pose_id=here.pose.id,
        version=1 + (newest.version if newest else 0),
        kind=CorrectionKind.EDITED,
        user_id=user_id,
        mmsi=newest.mmsi if newest and stands else here.pose.mmsi,
        vessel_state_id=newest.vessel_state_id if newest and stands else None,
        lat_deg=drawn.base.lat_deg,
        lon_deg=drawn.base.lon_deg,
        base_height_m=drawn.base.height_m,
        center_height_m=drawn.center.height_m,
        heading_deg=box.heading_deg,
        length_m=box.length_m,
        width_m=box.width_m,
        height_m=box.height_m,
        centroid_in_cam_m=drawn.centroid_in_cam_m.tolist(),
        rotvec_cam_from_vessel=drawn.rotvec_cam_from_vessel.tolist(),
        corners_in_image_px=pixels(drawn.corners_in_image_px),
        comment=comment or None,
    )
    session.add(correction)
    session.flush()
    return correction


def delete(session: Session, newest: Correction | None) -> int:
    """Let the generated pose count again; returns the version. Raises NotFound for none to delete.

    The deletion is a version of its own, so that an edit based on what was deleted is noticed.
    """
    if newest is None or newest.deleted_at is not None:
        raise NotFound("the pose has no correction")
    newest.deleted_at = now()
    newest.version += 1
    session.flush()
    return newest.version
