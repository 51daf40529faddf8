"""Which vessels can be in the picture at all, and where their plane segments are in it.

Matching needs the enclosing rectangle of a vessel's plane segment in pixels (the paper's WP_ais).
A vessel with a corner behind the camera has none; one kilometres away or far beside the image can
only take a detection away from another vessel. What is refused here is refused with its reason.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import isfinite

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState
from app.domain.waterplane import WaterPlaneSegment, water_plane_segment


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
    SIZE_UNKNOWN = "size_unknown"  # matched by position, but all dimensions are 0: no box


@dataclass(frozen=True, eq=False)
class Candidate:
    """A vessel that may be in the picture, with its plane segment and WP_ais (x1, y1, x2, y2)."""

    state_index: int
    state: VesselState
    segment: WaterPlaneSegment
    rectangle_px: FloatArray

    @property
    def has_size(self) -> bool:
        """Whether AIS knows any dimension; all four 0 means unknown (ITU-R M.1371)."""
        return self.state.length_m > 0 or self.state.width_m > 0


def candidate_or_reason(
    index: int,
    state: VesselState,
    camera: Camera,
    frame: WorldFrame,
    water_level_m: float,
    settings: FusionSettings,
) -> Candidate | UnmatchedReason:
    """Place a vessel state in the image, or say why it cannot be there."""
    unusable = _unusable(state, settings)
    if unusable is not None:
        return unusable
    segment = water_plane_segment(frame, water_level_m, state)
    away = np.linalg.norm(segment.antenna_in_world - camera.center_in_world)
    if away > settings.maximum_range_m:
        return UnmatchedReason.OUT_OF_RANGE
    if (camera.to_cam(segment.corners_in_world)[:, 2] <= 0).any():
        return UnmatchedReason.BEHIND_CAMERA
    corners_px = camera.project(segment.corners_in_world)
    rectangle = np.concatenate([corners_px.min(axis=0), corners_px.max(axis=0)])
    # A corner in front but without a pixel lies outside the lens's one-to-one range: far aside.
    if np.isnan(rectangle).any() or not _overlaps(rectangle, camera.intrinsics, settings):
        return UnmatchedReason.OUTSIDE_IMAGE
    return Candidate(index, state, segment, rectangle)


def _unusable(state: VesselState, settings: FusionSettings) -> UnmatchedReason | None:
    """Say what of a state keeps it from being placed at all."""
    if not (-90 <= state.lat_deg <= 90 and -180 <= state.lon_deg <= 180):
        return UnmatchedReason.NO_POSITION
    if not isfinite(state.heading_deg):
        return UnmatchedReason.NO_HEADING
    if state.age_s > settings.maximum_report_age_s:
        return UnmatchedReason.REPORT_TOO_OLD
    return None


def _overlaps(rectangle_px: FloatArray, image: Intrinsics, settings: FusionSettings) -> bool:
    """Whether a rectangle meets the image widened by the margin on every side.

    Below the image too: a near ship's waterline may be out of the picture while its bridge is in.
    """
    margin = settings.image_margin * image.width_px
    x1, y1, x2, y2 = rectangle_px
    beside = x2 < -margin or x1 > image.width_px - 1 + margin
    above_or_below = y2 < -margin or y1 > image.height_px - 1 + margin
    return not (beside or above_or_below)
