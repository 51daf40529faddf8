"""Which vessels can be in the picture at all, and where their plane segments are in it.

Matching needs the enclosing rectangle of a vessel's plane segment in pixels (the paper's WP_ais).
A vessel with a corner behind the camera has none; one kilometres away or far beside the image can
only take a detection away from another vessel. What is refused here is refused with its reason.
"""

from collections.abc import Sequence
from enum import StrEnum
from math import isfinite
from typing import NamedTuple

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState
from app.domain.waterplane import WaterPlaneSegment, water_plane


class UnmatchedReason(StrEnum):
    """Why a vessel state has no pose."""

    NO_POSITION = "no_position"  # the latitude or longitude is not available
    NO_HEADING = "no_heading"  # no heading: the box would have no direction
    REPORT_TOO_OLD = "report_too_old"  # older than maximum_report_age_s
    OUT_OF_RANGE = "out_of_range"  # farther away than maximum_range_m
    BEHIND_CAMERA = "behind_camera"  # a corner of its plane segment lies behind the camera
    OUTSIDE_IMAGE = "outside_image"  # its plane segment misses the widened image
    NO_DETECTION_LEFT = "no_detection_left"  # more vessels than detections: others fit better
    COST_TOO_HIGH = "cost_too_high"  # its detection is too unlike: theta above maximum_cost
    CLOCK_SUSPECT = "clock_suspect"  # its receiver's clock is: nobody knows when it was there
    SIZE_UNKNOWN = "size_unknown"  # matched by position, but all dimensions are 0: no box


class Candidate(NamedTuple):
    """A vessel that may be in the picture, with its plane segment and WP_ais (x1, y1, x2, y2)."""

    state_index: int
    state: VesselState
    segment: WaterPlaneSegment
    rectangle_px: FloatArray

    @property
    def has_size(self) -> bool:
        """Whether AIS knows any dimension; all four 0 means unknown (ITU-R M.1371)."""
        return self.state.length_m > 0 or self.state.width_m > 0


def candidates_or_reasons(
    images: Sequence[Sequence[VesselState]],
    camera: Camera,
    frame: WorldFrame,
    water_levels_m: Sequence[float],
    settings: FusionSettings,
) -> list[list[Candidate | UnmatchedReason]]:
    """Place the vessel states of images, or say why they cannot be there; all images at once.

    Each image has its water level; candidates have the indices of their states in their image.
    """
    placed: list[list[Candidate | UnmatchedReason]] = [[] for _ in images]
    usable: list[tuple[int, int]] = []
    for image, states in enumerate(images):
        for index, state in enumerate(states):
            reason = _unusable(state, settings)
            if reason is None:
                usable.append((image, index))
            # Whoever is usable holds its place until it is known where.
            placed[image].append(reason or UnmatchedReason.OUTSIDE_IMAGE)
    plane = water_plane(
        frame,
        np.array([water_levels_m[image] for image, _ in usable]),
        [images[image][index] for image, index in usable],
    )
    in_cam = camera.to_cam(plane.corners_in_world).T.reshape(3, -1, 4)
    pixels = camera.shown(in_cam)
    rectangles = np.concatenate([pixels.min(axis=2), pixels.max(axis=2)]).T
    away_m = np.sqrt(((plane.antenna_in_world - camera.center_in_world) ** 2).sum(axis=1))
    is_far = (away_m > settings.maximum_range_m).tolist()
    is_behind = (in_cam[2].min(axis=1) <= 0).tolist()
    is_overlapping = _overlap(rectangles, camera.intrinsics, settings).tolist()
    for row, (image, index) in enumerate(usable):
        if is_far[row]:
            placed[image][index] = UnmatchedReason.OUT_OF_RANGE
        elif is_behind[row]:
            placed[image][index] = UnmatchedReason.BEHIND_CAMERA
        elif not is_overlapping[row]:
            placed[image][index] = UnmatchedReason.OUTSIDE_IMAGE
        elif images[image][index].is_withheld:
            placed[image][index] = UnmatchedReason.CLOCK_SUSPECT
        else:
            segment = WaterPlaneSegment(plane, row)
            placed[image][index] = Candidate(index, images[image][index], segment, rectangles[row])
    return placed


def candidate_or_reason(
    index: int,
    state: VesselState,
    camera: Camera,
    frame: WorldFrame,
    water_level_m: float,
    settings: FusionSettings,
) -> Candidate | UnmatchedReason:
    """Place one vessel state in the image, or say why it cannot be there."""
    ((placed,),) = candidates_or_reasons([[state]], camera, frame, [water_level_m], settings)
    return placed._replace(state_index=index) if isinstance(placed, Candidate) else placed


def _unusable(state: VesselState, settings: FusionSettings) -> UnmatchedReason | None:
    """Say what of a state keeps it from being placed at all."""
    if not (-90 <= state.lat_deg <= 90 and -180 <= state.lon_deg <= 180):
        return UnmatchedReason.NO_POSITION
    if not isfinite(state.heading_deg):
        return UnmatchedReason.NO_HEADING
    if state.age_s > settings.maximum_report_age_s:
        return UnmatchedReason.REPORT_TOO_OLD
    return None


def _overlap(rectangles_px: FloatArray, image: Intrinsics, settings: FusionSettings) -> BoolArray:
    """Whether rectangles (n, 4) meet the image widened by the margin on every side.

    Below the image too: a near ship's waterline may be out of the picture while its bridge is in.
    A corner in front but without a pixel (NaN) lies outside the lens's one-to-one range: far aside.
    """
    margin = settings.image_margin * image.width_px
    x1, y1, x2, y2 = rectangles_px.T
    beside = (x2 >= -margin) & (x1 <= image.width_px - 1 + margin)
    above_or_below = (y2 >= -margin) & (y1 <= image.height_px - 1 + margin)
    return np.asarray(beside & above_or_below)
