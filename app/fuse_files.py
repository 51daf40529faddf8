"""Fusion of one published label with its camera, without any database: `quaymark fuse`.

Reads a camera file and a label file in the format of the BONK-pose data set, takes the label's 2D
boxes as detections and its vessels as AIS states, and gives poses as plain JSON values. The world
frame is geocentric (ECEF) and the water lies at ellipsoidal height 0, as in the published data,
unless the camera file tells its level.
Labels are taken as their publisher chose them: the age of a report is no reason to leave it out.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.fusion import FusedPose, FusionSettings, Preset, fuse
from app.domain.fusion_settings import MATCHING_OF
from app.domain.geodesy import EcefFrame
from app.published_files import (
    PublishedFileError,
    PublishedVessel,
    boxes_of,
    read_camera,
    read_label,
    read_water_level_m,
)


def fuse_files(
    camera_path: Path, label_path: Path, preset: str = Preset.PAPER
) -> dict[str, object]:
    """Fuse a label's boxes with its vessels and return the JSON values of `quaymark fuse`.

    `unmatched_vessels` lists identifiers, `unmatched_vessel_reasons` the same vessels with their
    position in the label and the reason. Raises PublishedFileError with one clear line.
    """
    if preset not in set(Preset):
        known = ", ".join(Preset)
        raise PublishedFileError(f"preset {preset!r} is not available here; choose one of: {known}")
    camera = read_camera(camera_path)
    label = read_label(label_path)
    boxes = boxes_of(label_path, label.objects)
    # The label's publisher has chosen the reports already: their age is no reason to drop them.
    settings = FusionSettings(
        preset=Preset(preset),
        matching=MATCHING_OF[Preset(preset)],
        maximum_report_age_s=float("inf"),
    )
    try:
        result = fuse(
            camera,
            EcefFrame(),
            read_water_level_m(camera_path),
            list(boxes.values()),
            [vessel.state() for vessel in label.vessels],
            settings,
        )
    except ValueError as error:
        raise PublishedFileError(f"{label_path}: {error}") from error
    object_indices = list(boxes)
    return {
        "poses": [
            _pose_values(pose, object_indices[pose.detection_index], label.vessels)
            for pose in result.poses
        ],
        "unmatched_detections": [object_indices[i] for i in result.unmatched_detections],
        "unmatched_vessels": [str(label.vessels[i].identifier) for i in result.unmatched_states],
        "unmatched_vessel_reasons": [
            {"vessel": i, "identifier": str(label.vessels[i].identifier), "reason": str(reason)}
            for i, reason in result.unmatched_states.items()
        ],
    }


def _pose_values(
    pose: FusedPose, object_index: int, vessels: Sequence[PublishedVessel]
) -> dict[str, object]:
    vessel = vessels[pose.state_index]
    east, north, up = pose.correction_in_enu_m.tolist()
    covariance = pose.position_covariance_in_enu_m2
    return {
        "identifier": str(vessel.identifier),
        "detection": object_index,
        "vessel": pose.state_index,
        "cost": pose.cost,
        "cost_terms": pose.cost_terms,
        "centroid_in_cam_m": pose.centroid_in_cam_m.tolist(),
        "rotvec_cam_from_vessel": pose.rotvec_cam_from_vessel.tolist(),
        "length_m": pose.length_m,
        "width_m": pose.width_m,
        "height_m": pose.height_m,
        "corners_in_image_px": _pixels(pose.corners_in_image_px),
        "correction_m": {"east": east, "north": north, "up": up},
        "position_covariance_in_enu_m2": None if covariance is None else covariance.tolist(),
        "heading_sigma_deg": pose.heading_sigma_deg,
        "height_sigma_m": pose.height_sigma_m,
        "flags": pose.flags + vessel.flags(),
    }


def _pixels(pixels_px: FloatArray) -> list[list[float] | None]:
    """Give rows as JSON knows them: null for a point without a projection."""
    return [None if np.isnan(row).any() else row.tolist() for row in pixels_px]
