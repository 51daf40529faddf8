"""From fusion's results to the rows that keep them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.domain.camera import Camera
from app.domain.candidates import UnmatchedReason
from app.domain.fusion import FusionResult
from app.domain.geodesy import WorldFrame
from app.domain.sighting import SeenImage
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane
from app.runs.outcome_repository import PoseRows
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


def kept_states(states: Sequence[VesselState], result: FusionResult) -> list[int]:
    """Return the vessel states worth keeping, by index."""
    unmatched = result.unmatched_states
    return [index for index in range(len(states)) if unmatched.get(index) not in NOT_KEPT]


def state_rows(
    camera: Camera, frame: WorldFrame, images: Sequence[SeenImage], results: Sequence[FusionResult]
) -> list[list[dict[str, Any]]]:
    """Return the columns of `vessel_states` for the states worth keeping of each image."""
    kept = [
        (number, index)
        for number, (image, result) in enumerate(zip(images, results, strict=True))
        for index in kept_states(image.states, result)
    ]
    plane = water_plane(
        frame,
        np.array([images[number].water_level_m for number, _ in kept]),
        [images[number].states[index] for number, index in kept],
    )
    corners = np.stack([plane.reported_corners_in_world, plane.corners_in_world], axis=1)
    segments = pixels(camera.project(corners))
    rows: list[list[dict[str, Any]]] = [[] for _ in images]
    for place, (number, index) in enumerate(kept):
        outcome = str(results[number].unmatched_states.get(index, MATCHED))
        of_state = segments[8 * place : 8 * place + 8]
        rows[number].append(_state_row(images[number].states[index], outcome, of_state))
    return rows


def _state_row(
    state: VesselState, outcome: str, segments_px: Sequence[list[float] | None]
) -> dict[str, Any]:
    return {
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
        "outcome": outcome,
        "segments_px": {"reported": segments_px[:4], "dead_reckoned": segments_px[4:]},
    }


def pose_rows(
    frame: WorldFrame, states: Sequence[VesselState], result: FusionResult
) -> list[PoseRows]:
    """Return the columns of `matches` and `poses`."""
    rows = []
    for pose in result.poses:
        state = states[pose.state_index]
        rows.append(
            PoseRows(
                detection_index=pose.detection_index,
                cost=pose.cost,
                cost_terms=pose.cost_terms,
                pose=pose_columns(frame, state, pose),
            )
        )
    return rows
