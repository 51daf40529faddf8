"""From a fused pose to the columns that keep it: plain numbers, lists, None for no pixel."""

from typing import Any

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.fusion import FusedPose
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState


def pose_columns(frame: WorldFrame, state: VesselState, pose: FusedPose) -> dict[str, Any]:
    """Return the columns of `poses` for a fused pose, but its run, image and match."""
    center = frame.geodetic(pose.centroid_in_world)
    covariance = pose.position_covariance_in_enu_m2
    return {
        "mmsi": int(state.identifier),
        "lat_deg": center.lat_deg,
        "lon_deg": center.lon_deg,
        "center_height_m": center.height_m,
        "heading_deg": pose.heading_deg,
        "centroid_in_cam_m": pose.centroid_in_cam_m.tolist(),
        "rotvec_cam_from_vessel": pose.rotvec_cam_from_vessel.tolist(),
        "length_m": pose.length_m,
        "width_m": pose.width_m,
        "height_m": float(pose.height_m),
        "corners_in_image_px": pixels(pose.corners_in_image_px),
        "corrected_segment_px": pixels(pose.segment_corrected_px),
        "correction_in_enu_m": pose.correction_in_enu_m.tolist(),
        "position_covariance_in_enu_m2": None if covariance is None else covariance.tolist(),
        "heading_sigma_deg": pose.heading_sigma_deg,
        "height_sigma_m": pose.height_sigma_m,
        "flags": pose.flags,
    }


def pixels(points_px: FloatArray) -> list[list[float] | None]:
    """Return points (n, 2) as lists, None where a point has no projection."""
    points: list[list[float] | None] = points_px.tolist()
    is_shown = np.isfinite(points_px)
    if not is_shown.all():
        points = [point if row.all() else None for point, row in zip(points, is_shown, strict=True)]
    return points
