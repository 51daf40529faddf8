"""From fusion's results to the columns that keep them: plain numbers, lists, None for no pixel."""

from collections.abc import Sequence
from math import isfinite
from typing import Any

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.candidates import UnmatchedReason
from app.domain.fusion import FusionResult
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane_segment
from app.runs.batch_repository import PoseRows

MATCHED = "matched"
# These are not even near the picture: a busy estuary has hundreds an image.
NOT_KEPT = frozenset(
    {
        UnmatchedReason.NO_POSITION,
        UnmatchedReason.OUT_OF_RANGE,
        UnmatchedReason.BEHIND_CAMERA,
        UnmatchedReason.REPORT_TOO_OLD,
    }
)


def kept_states(states: Sequence[VesselState], result: FusionResult) -> dict[int, int]:
    """Return, for each vessel state worth keeping, its place among those kept."""
    kept = [
        index for index in range(len(states)) if result.unmatched_states.get(index) not in NOT_KEPT
    ]
    return {index: place for place, index in enumerate(kept)}


def state_rows(
    camera: Camera,
    frame: WorldFrame,
    water_level_m: float,
    states: Sequence[VesselState],
    result: FusionResult,
) -> list[dict[str, Any]]:
    """Return the columns of `vessel_states` for the states worth keeping."""
    rows = []
    for index in kept_states(states, result):
        state = states[index]
        segment = water_plane_segment(frame, water_level_m, state)
        rows.append(
            {
                "mmsi": int(state.identifier),
                "lat_deg": state.lat_deg,
                "lon_deg": state.lon_deg,
                "heading_deg": state.heading_deg,
                "heading_source": state.heading_source.value,
                "speed_kn": state.speed_kn,
                "age_s": state.age_s,
                "to_bow_m": state.to_bow_m,
                "to_stern_m": state.to_stern_m,
                "to_port_m": state.to_port_m,
                "to_starboard_m": state.to_starboard_m,
                "report_ids": list(state.report_ids),
                "outcome": str(result.unmatched_states.get(index, MATCHED)),
                "segments_px": {
                    "reported": pixels(camera.project(segment.reported_corners_in_world)),
                    "dead_reckoned": pixels(camera.project(segment.corners_in_world)),
                },
            }
        )
    return rows


def pose_rows(
    frame: WorldFrame, states: Sequence[VesselState], result: FusionResult
) -> list[PoseRows]:
    """Return the columns of `matches` and `poses`, with each state's place among those kept."""
    places = kept_states(states, result)
    rows = []
    for pose in result.poses:
        state = states[pose.state_index]
        center = frame.geodetic(pose.centroid_in_world)
        covariance = pose.position_covariance_in_enu_m2
        rows.append(
            PoseRows(
                detection_index=pose.detection_index,
                state_index=places[pose.state_index],
                cost=pose.cost,
                cost_terms=pose.cost_terms,
                pose={
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
                    "position_covariance_in_enu_m2": None
                    if covariance is None
                    else covariance.tolist(),
                    "heading_sigma_deg": pose.heading_sigma_deg,
                    "height_sigma_m": pose.height_sigma_m,
                    "flags": pose.flags,
                },
            )
        )
    return rows


def pixels(points_px: FloatArray) -> list[list[float] | None]:
    """Return points (n, 2) as lists, None where a point has no projection."""
    return [point if all(map(isfinite, point)) else None for point in points_px.tolist()]
