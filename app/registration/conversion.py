"""Between rows and the domain's cameras: intrinsics as JSON, poses in a site's ENU frame."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.rotations import matrix_from_rotvec
from app.sites.fields import matrix_of
from app.tables.registration import Registration
from app.tables.sites import Camera as CameraRow
from app.tables.sites import Site


def frame_of(site: Site) -> EnuFrame:
    """Return a site's east-north-up frame."""
    return EnuFrame(Geodetic(site.origin_lat_deg, site.origin_lon_deg, site.origin_height_m))


def intrinsics_of(camera: CameraRow) -> Intrinsics:
    """Return a camera's present intrinsics."""
    values = {name: getattr(camera, name) for name in ("fx_px", "fy_px", "cx_px", "cy_px")}
    return Intrinsics(
        camera.width_px,
        camera.height_px,
        np.array(matrix_of(values)),
        np.array(camera.distortion, dtype=np.float64),
    )


def intrinsics_to_json(intrinsics: Intrinsics) -> dict[str, Any]:
    """Return intrinsics as a registration keeps them."""
    return {
        "width_px": intrinsics.width_px,
        "height_px": intrinsics.height_px,
        "fx_px": float(intrinsics.K[0, 0]),
        "fy_px": float(intrinsics.K[1, 1]),
        "cx_px": float(intrinsics.K[0, 2]),
        "cy_px": float(intrinsics.K[1, 2]),
        "distortion": [float(term) for term in intrinsics.distortion],
    }


def intrinsics_from_json(values: Mapping[str, Any]) -> Intrinsics:
    """Return the intrinsics a registration keeps."""
    return Intrinsics(
        values["width_px"],
        values["height_px"],
        np.array(matrix_of(dict(values))),
        np.array(values["distortion"], dtype=np.float64),
    )


def camera_of(registration: Registration, frame: EnuFrame) -> Camera | None:
    """Return a registration's camera in a site's frame; None for a homography."""
    place = (
        registration.center_lat_deg,
        registration.center_lon_deg,
        registration.center_height_m,
    )
    lat_deg, lon_deg, height_m = place
    if registration.rotation is None or lat_deg is None or lon_deg is None or height_m is None:
        return None
    return Camera(
        intrinsics_from_json(registration.intrinsics),
        matrix_from_rotvec(registration.rotation),
        frame.position(lat_deg, lon_deg, height_m),
        None if registration.covariance is None else np.array(registration.covariance),
    )
