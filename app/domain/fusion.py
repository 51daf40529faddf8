"""From detections and vessel states to 6D poses.

The method's stages meet here: the vessels that can be in the picture (candidates), the detection
each of them belongs to (matching), and the box that stands there. Preset `paper` makes each box by
itself (correction); preset `waterline` makes those of a while together, since they stand on the
same water. Whatever does not become a pose is accounted for: a detection as unmatched, a vessel
with the reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import CutEdges
from app.domain.camera import Camera
from app.domain.candidates import UnmatchedReason
from app.domain.correction import paper_boxes
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings, MatchingMethod, Preset
from app.domain.geodesy import WorldFrame
from app.domain.pairing import MatchedImage, match_images, windows
from app.domain.rotations import rotvecs_from_matrices
from app.domain.sighting import SeenImage, Sighting, VesselBoxes
from app.domain.vessel_state import VesselState
from app.domain.waterline import waterline_boxes
from app.domain.waterplane import WaterPlane

__all__ = [
    "FusedPose",
    "FusionResult",
    "FusionSettings",
    "MatchingMethod",
    "Preset",
    "SeenImage",
    "UnmatchedReason",
    "fuse",
    "fuse_series",
]


@dataclass(eq=False)  # not frozen: of 21 fields that would take most of the time to make one
class FusedPose:
    """The 3D box of one vessel.

    Corners (8, ...) are bow-port, bow-starboard, stern-starboard, stern-port at the water, then
    the same four on top; segments (4, 2) have the first four. A pixel row is NaN where a point has
    no projection. `rotvec_cam_from_vessel` (3,) is the Rodrigues vector of the rotation whose
    columns are the vessel's forward, port and up axes in the camera frame; with the centroid
    (the mean of the eight corners) it is the 6D pose. `correction_in_enu_m` (3,) is how far the
    AIS segment was moved east, north and up. `height_m` is not rounded. `cost_terms` are the
    parts of `cost`. `flags`: see `pose_flags`. `water_level_m` is the height of the box's bottom
    as estimated or given. Preset `waterline` tells how sure it is: `position_covariance_in_enu_m2`
    (3, 3) of the centroid, and one sigma of heading and height; None from `paper`.
    """

    detection_index: int
    state_index: int
    cost: float
    cost_terms: dict[str, float]
    centroid_in_world: FloatArray
    centroid_in_cam_m: FloatArray
    rotvec_cam_from_vessel: FloatArray
    heading_deg: float
    length_m: float
    width_m: float
    height_m: float
    water_level_m: float
    position_covariance_in_enu_m2: FloatArray | None
    heading_sigma_deg: float | None
    height_sigma_m: float | None
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
    image = SeenImage(detections, states, water_level_m)
    return fuse_series(camera, frame, [image], settings)[0]


def fuse_series(
    camera: Camera, frame: WorldFrame, images: Sequence[SeenImage], settings: FusionSettings
) -> list[FusionResult]:
    """Do what `fuse` does for several images of one viewport, in any order.

    Preset `waterline` takes the water to be the same within `level_window_s`; more images of that
    time make each pose better. Raises ValueError as `fuse` does.
    """
    matched = match_images(camera, frame, images, settings)
    poses: list[list[FusedPose]] = [[] for _ in images]
    together = (
        [list(range(len(images)))]
        if settings.preset is Preset.PAPER
        else windows(images, settings.level_window_s)
    )
    for window in together:
        of_image = [(index, pair) for index in window for pair in matched[index].pairs]
        pairs = [pair for _, pair in of_image]
        if not pairs:
            continue
        boxes = (
            paper_boxes(camera, pairs)
            if settings.preset is Preset.PAPER
            else waterline_boxes(camera, pairs, settings)
        )
        for (index, _), pose in zip(of_image, _poses(camera, pairs, boxes), strict=True):
            poses[index].append(pose)
    return [
        _accounted(image, found, result)
        for image, found, result in zip(images, poses, matched, strict=True)
    ]


def _accounted(image: SeenImage, poses: list[FusedPose], matched: MatchedImage) -> FusionResult:
    used = {pose.detection_index for pose in poses}
    return FusionResult(
        poses=poses,
        unmatched_detections=[i for i in range(len(image.detections)) if i not in used],
        unmatched_states=dict(sorted(matched.unmatched_states.items())),
    )


def pose_flags(
    cut: CutEdges, state: VesselState, box_height_m: float, doubts: Sequence[str] = ()
) -> list[str]:
    """Name what a reviewer should know of a pose.

    `cut_left`, `cut_right`: that side of the box is the image's border, no pull came from it.
    `cut_bottom`: the depth is AIS's own, uncorrected. `cut_top`: the height is a lower bound.
    `no_length`, `no_width`: AIS gives this dimension as 0. `no_height`: the box's upper edge lies
    below the plane segment, so the height is 0 or negative. Of `doubts`, `unsure_place`: one sigma
    of the place is over 10 m; `contradicts_ais`: the detection lies, looks or is wide as AIS makes
    it hardly possible; `partly_hidden`: what is not seen of it may be its highest point. The
    state's own flags follow.
    """
    flags = []
    # One after the other, not from a table: there are thousands of poses and few flags.
    if cut.left:
        flags.append("cut_left")
    if cut.right:
        flags.append("cut_right")
    if cut.bottom:
        flags.append("cut_bottom")
    if cut.top:
        flags.append("cut_top")
    if state.length_m <= 0:
        flags.append("no_length")
    if state.width_m <= 0:
        flags.append("no_width")
    if box_height_m <= 0:
        flags.append("no_height")
    return [*flags, *doubts, *state.flags]


def _poses(camera: Camera, pairs: Sequence[Sighting], boxes: VesselBoxes) -> list[FusedPose]:
    """Say all there is to say of the boxes that stand where pairs were found."""
    plane = WaterPlane.of([pair.candidate.segment for pair in pairs])
    bottom = boxes.bottom_in_world
    points = np.concatenate(
        [
            bottom,
            bottom + boxes.top_from_bottom_m[:, None],
            plane.reported_corners_in_world,
            plane.corners_in_world,
        ],
        axis=1,
    )
    pixels = np.ascontiguousarray(camera.project(points)).reshape(*points.shape[:2], 2)
    centroids = points[:, :8].sum(axis=1) / 8
    # A vessel's axes are the columns of the rotation from its frame.
    axes = boxes.vessel_axes_in_world.swapaxes(1, 2)
    shifts = (bottom - plane.corners_in_world).sum(axis=1) / 4
    placed = map(
        _Placed,
        *(points[:, :8], centroids, camera.to_cam(centroids)),
        rotvecs_from_matrices(camera.R_cam_from_world @ axes),
        (plane.enu_axes_in_world @ shifts[..., None])[..., 0],
        *(boxes.heading_deg.tolist(), boxes.height_m.tolist(), boxes.water_level_m.tolist()),
        *(pixels[:, :4], pixels[:, :8], pixels[:, 8:12], pixels[:, 12:]),
        *(_sigmas(boxes), boxes.doubts),
    )
    return [_pose(pair, one) for pair, one in zip(pairs, placed, strict=True)]


def _sigmas(boxes: VesselBoxes) -> list[tuple[FloatArray | None, float | None, float | None]]:
    """Return the covariance of each box's place, and one sigma of its heading and height."""
    if boxes.sigmas is None:
        return [(None, None, None)] * len(boxes.doubts)
    known = boxes.sigmas
    return list(
        zip(
            known.position_covariance_in_enu_m2,
            known.heading_deg.tolist(),
            known.height_m.tolist(),
            strict=True,
        )
    )


class _Placed(NamedTuple):
    """A box's corners (8, 3) and their mean (3,) in the world, the latter in the camera too.

    `rotvec` (3,) is the vessel's in the camera, `shift_in_enu` (3,) the correction. Pixels are
    those of its bottom (4, 2), of all its corners (8, 2), of the reported and of the dead-reckoned
    segment (4, 2).
    """

    corners: FloatArray
    centroid: FloatArray
    centroid_in_cam: FloatArray
    rotvec: FloatArray
    shift_in_enu: FloatArray
    heading_deg: float
    height_m: float
    water_level_m: float
    bottom_px: FloatArray
    corners_px: FloatArray
    reported_px: FloatArray
    dead_reckoned_px: FloatArray
    sigmas: tuple[FloatArray | None, float | None, float | None]
    doubts: Sequence[str]


def _pose(pair: Sighting, placed: _Placed) -> FusedPose:
    candidate = pair.candidate
    covariance, heading_sigma_deg, height_sigma_m = placed.sigmas
    return FusedPose(
        detection_index=pair.detection_index,
        state_index=candidate.state_index,
        cost=pair.cost.total,
        cost_terms=pair.cost.terms(),
        centroid_in_world=placed.centroid,
        centroid_in_cam_m=placed.centroid_in_cam,
        rotvec_cam_from_vessel=placed.rotvec,
        heading_deg=placed.heading_deg,
        length_m=candidate.state.length_m,
        width_m=candidate.state.width_m,
        height_m=placed.height_m,
        water_level_m=placed.water_level_m,
        position_covariance_in_enu_m2=covariance,
        heading_sigma_deg=heading_sigma_deg,
        height_sigma_m=height_sigma_m,
        corners_in_world=placed.corners,
        corners_in_image_px=placed.corners_px,
        segment_reported_px=placed.reported_px,
        segment_dead_reckoned_px=placed.dead_reckoned_px,
        segment_corrected_px=placed.bottom_px,
        correction_in_enu_m=placed.shift_in_enu,
        flags=pose_flags(pair.cut, candidate.state, placed.height_m, placed.doubts),
    )
