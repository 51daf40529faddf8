"""From detections and vessel states of one image to 6D poses: preset `paper`.

The method's five stages meet here: the vessels that can be in the picture (candidates), the
detection each of them belongs to (matching), the shift of its plane segment under the detection
and the height of its box (correction). Whatever does not become a pose is accounted for: a
detection as unmatched, a vessel with the reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import CutEdges, cut_edges
from app.domain.camera import Camera
from app.domain.candidates import Candidate, UnmatchedReason, candidate_or_reason
from app.domain.correction import correction_in_world, edge_planes, height_m
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings, Preset
from app.domain.geodesy import WorldFrame
from app.domain.matching import Cost, match
from app.domain.rotations import rotvec_from_matrix
from app.domain.vessel_state import VesselState

__all__ = ["FusedPose", "FusionResult", "FusionSettings", "Preset", "UnmatchedReason", "fuse"]


@dataclass(frozen=True, eq=False)
class FusedPose:
    """The 3D box of one vessel.

    Corners (8, ...) are bow-port, bow-starboard, stern-starboard, stern-port at the water, then
    the same four on top; segments (4, 2) have the first four. A pixel row is NaN where a point has
    no projection. `rotvec_cam_from_vessel` (3,) is the Rodrigues vector of the rotation whose
    columns are the vessel's forward, port and up axes in the camera frame; with the centroid
    (the mean of the eight corners) it is the 6D pose. `correction_in_enu_m` (3,) is how far the
    AIS segment was moved east, north and up. `height_m` is not rounded. `cost_terms` are the
    parts of `cost`. `flags`: see `pose_flags`.
    """

    detection_index: int
    state_index: int
    cost: float
    cost_terms: dict[str, float]
    centroid_in_world: FloatArray
    centroid_in_cam_m: FloatArray
    rotvec_cam_from_vessel: FloatArray
    length_m: float
    width_m: float
    height_m: float
    corners_in_world: FloatArray
    corners_in_image_px: FloatArray
    segment_reported_px: FloatArray
    segment_dead_reckoned_px: FloatArray
    segment_corrected_px: FloatArray
    correction_in_enu_m: FloatArray
    flags: list[str]


@dataclass(frozen=True, eq=False)
class FusionResult:
    """Poses in the order of detections, and all that became none.

    Detections by index; vessel states by index with an `UnmatchedReason`.
    """

    poses: list[FusedPose]
    unmatched_detections: list[int]
    unmatched_states: dict[int, str]


def fuse(
    camera: Camera,
    frame: WorldFrame,
    water_level_m: float,
    detections: Sequence[Detection],
    states: Sequence[VesselState],
    settings: FusionSettings,
) -> FusionResult:
    """Match the detections of one image with vessel states and build a 3D box for each pair.

    `camera` stands in `frame`; `water_level_m` is the ellipsoidal height of the water. Raises
    ValueError naming the detection whose box is empty or not finite.
    """
    for index, detection in enumerate(detections):
        _require_box(index, detection)
    candidates: list[Candidate] = []
    unmatched_states: dict[int, str] = {}
    for index, state in enumerate(states):
        placed = candidate_or_reason(index, state, camera, frame, water_level_m, settings)
        if isinstance(placed, Candidate):
            candidates.append(placed)
        else:
            unmatched_states[index] = placed
    poses: list[FusedPose] = []
    reasons = dict.fromkeys(range(len(candidates)), UnmatchedReason.NO_DETECTION_LEFT)
    for pair in match(detections, candidates, camera.intrinsics, settings):
        candidate = candidates[pair.candidate]
        if pair.cost.total > settings.maximum_cost:
            reasons[pair.candidate] = UnmatchedReason.COST_TOO_HIGH
        elif not candidate.has_size:
            reasons[pair.candidate] = UnmatchedReason.SIZE_UNKNOWN
        else:
            del reasons[pair.candidate]
            detection = detections[pair.detection]
            cut = cut_edges(detection, camera.intrinsics, settings.border_tolerance_px)
            poses.append(_pose(camera, (pair.detection, detection), candidate, cut, pair.cost))
    unmatched_states |= {candidates[i].state_index: reason for i, reason in reasons.items()}
    used = {pose.detection_index for pose in poses}
    return FusionResult(
        poses=poses,
        unmatched_detections=[i for i in range(len(detections)) if i not in used],
        unmatched_states=dict(sorted(unmatched_states.items())),
    )


def pose_flags(cut: CutEdges, state: VesselState, box_height_m: float) -> list[str]:
    """Name what a reviewer should know of a pose.

    `cut_left`, `cut_right`: that side of the box is the image's border, no pull came from it.
    `cut_bottom`: the depth is AIS's own, uncorrected. `cut_top`: the height is a lower bound.
    `no_length`, `no_width`: AIS gives this dimension as 0. `no_height`: the box's upper edge lies
    below the plane segment, so the height is 0 or negative.
    """
    conditions = {
        "cut_left": cut.left,
        "cut_right": cut.right,
        "cut_bottom": cut.bottom,
        "cut_top": cut.top,
        "no_length": state.length_m <= 0,
        "no_width": state.width_m <= 0,
        "no_height": box_height_m <= 0,
    }
    return [flag for flag, holds in conditions.items() if holds]


def _pose(
    camera: Camera,
    numbered_detection: tuple[int, Detection],
    candidate: Candidate,
    cut: CutEdges,
    cost: Cost,
) -> FusedPose:
    """Build the 3D box of a matched pair (paper, b1 to b8)."""
    detection_index, detection = numbered_detection
    segment = candidate.segment
    planes = edge_planes(camera, detection, segment.vessel_axes_in_world[2])
    shift = correction_in_world(planes, segment.corners_in_world, cut)
    bottom = segment.corners_in_world + shift
    height = height_m(planes, bottom)
    corners = np.vstack([bottom, bottom - height * planes.delta])
    centroid = corners.mean(axis=0)
    # The vessel's axes are the columns of the rotation from the vessel's frame.
    R_cam_from_vessel = camera.R_cam_from_world @ segment.vessel_axes_in_world.T
    return FusedPose(
        detection_index=detection_index,
        state_index=candidate.state_index,
        cost=cost.total,
        cost_terms=cost.terms(),
        centroid_in_world=centroid,
        centroid_in_cam_m=camera.to_cam(centroid)[0],
        rotvec_cam_from_vessel=rotvec_from_matrix(R_cam_from_vessel),
        length_m=candidate.state.length_m,
        width_m=candidate.state.width_m,
        height_m=height,
        corners_in_world=corners,
        corners_in_image_px=camera.project(corners),
        segment_reported_px=camera.project(segment.reported_corners_in_world),
        segment_dead_reckoned_px=camera.project(segment.corners_in_world),
        segment_corrected_px=camera.project(bottom),
        correction_in_enu_m=segment.enu_axes_in_world @ shift,
        flags=pose_flags(cut, candidate.state, height),
    )


def _require_box(index: int, detection: Detection) -> None:
    numbers = (detection.x1_px, detection.y1_px, detection.x2_px, detection.y2_px, detection.score)
    if not all(isfinite(number) for number in numbers):
        raise ValueError(f"detection {index}: coordinates and score must be finite numbers")
    if detection.x1_px >= detection.x2_px or detection.y1_px >= detection.y2_px:
        raise ValueError(f"detection {index}: needs x1 < x2 and y1 < y2, the box is empty")
