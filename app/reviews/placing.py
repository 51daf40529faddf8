"""A pose with the camera it was seen by: where its box stands, and what stands around it.

The reference is the centre of the generated box's bottom. It is found from the pixels the pose was
drawn at, not from the water level of today, so that it holds for every estimator and for ever.
"""

from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.rotations import rotvec_from_matrix
from app.domain.upright_box import UprightBox, bottom_center_in_world, geodetic_of, local_camera
from app.domain.waterplane import vessel_axes
from app.registration.service import camera_of
from app.tables.runs import Pose


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPose:
    """A generated pose in the frame of its site and as a box that can be edited."""

    pose: Pose
    camera: Camera
    frame: EnuFrame
    reference: Geodetic
    camera_in_local: Camera
    generated: UprightBox


@dataclass(frozen=True, slots=True, eq=False)
class DrawnBox:
    """An edited box in the world and in the image; a pixel row is NaN without projection."""

    base: Geodetic
    center: Geodetic
    centroid_in_cam_m: FloatArray
    rotvec_cam_from_vessel: FloatArray
    corners_in_image_px: FloatArray


def place(session: Session, pose: Pose, registration_id: int) -> PlacedPose:
    """Put a pose before its run's camera."""
    camera, frame = camera_of(session, registration_id)
    reference = _reference(pose, camera, frame)
    return PlacedPose(
        pose,
        camera,
        frame,
        reference,
        local_camera(camera, frame, reference),
        UprightBox(0, 0, 0, pose.heading_deg, pose.length_m, pose.width_m, pose.height_m),
    )


def _reference(pose: Pose, camera: Camera, frame: EnuFrame) -> Geodetic:
    enu_axes = frame.axes(pose.lat_deg, pose.lon_deg)
    forward, _, up = vessel_axes(enu_axes, pose.heading_deg)
    below_center = (
        frame.position(pose.lat_deg, pose.lon_deg, pose.center_height_m) - up * pose.height_m / 2
    )
    pixels = np.array(
        [[np.nan, np.nan] if point is None else point for point in pose.corrected_segment_px]
    )
    found = bottom_center_in_world(camera, up, forward, (pose.length_m, pose.width_m), pixels)
    # A box is sheared by a fraction of its height at most; anything else is numerical noise.
    if found is None or np.linalg.norm(found - below_center) > abs(pose.height_m) + 1:
        found = below_center
    return frame.geodetic(found)


def draw(placed: PlacedPose, box: UprightBox) -> DrawnBox:
    """Put an edited box into the world and the image."""
    camera = placed.camera_in_local
    centroid = box.centroid_in_local()
    base = np.array([box.east_m, box.north_m, box.up_m])
    return DrawnBox(
        base=geodetic_of(placed.frame, placed.reference, base),
        center=geodetic_of(placed.frame, placed.reference, centroid),
        centroid_in_cam_m=camera.to_cam(centroid)[0],
        rotvec_cam_from_vessel=rotvec_from_matrix(camera.R_cam_from_world @ box.axes_in_local().T),
        corners_in_image_px=camera.project(box.corners_in_local()),
    )
