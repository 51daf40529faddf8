"""From fusion's results to the rows that keep them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.domain.camera import Camera
from app.domain.candidates import UnmatchedReason
from app.domain.fusion import FusionResult
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane
from app.runs.batch_repository import PoseRows
from app.runs.pose_columns import pixels, pose_columns

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
    kept = list(kept_states(states, result))
    plane = water_plane(frame, water_level_m, [states[index] for index in kept])
    corners = np.stack([plane.reported_corners_in_world, plane.corners_in_world], axis=1)
    shown = camera.project(corners).reshape(-1, 2, 4, 2)
    rows = []
    for index, (reported, dead_reckoned) in zip(kept, shown, strict=True):
        state = states[index]
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
                "static_ids": list(state.static_ids),
                "track_method": state.track_method and state.track_method.value,
                "position_covariance_m2": list(state.position_covariance_m2),
                "heading_sigma_deg": state.heading_sigma_deg,
                "flags": list(state.flags),
                "outcome": str(result.unmatched_states.get(index, MATCHED)),
                "segments_px": {
                    "reported": pixels(reported),
                    "dead_reckoned": pixels(dead_reckoned),
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
        rows.append(
            PoseRows(
                detection_index=pose.detection_index,
                state_index=places[pose.state_index],
                cost=pose.cost,
                cost_terms=pose.cost_terms,
                pose=pose_columns(frame, state, pose),
            )
        )
    return rows
