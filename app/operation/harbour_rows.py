"""A simulated harbour in the words of the services: what a person would type and upload."""

from collections.abc import Sequence

import cv2
import numpy as np

from app.domain.arrays import FloatArray, UInt8Array
from app.registration.schemas import KeypointIn
from app.simulation.harbour import Harbour
from app.simulation.truth import VesselTruth as SimulatedTruth
from app.simulation.viewports import Viewport
from app.sites.schemas import CameraIn, SiteIn
from app.tables.groundtruth import VesselClass, VesselTruth

JPEG_QUALITY = 90


def site_in(harbour: Harbour, name: str) -> SiteIn:
    """Return the site, under a name."""
    origin = harbour.site.origin
    return SiteIn.model_validate(
        {
            "name": name,
            "origin": {
                "lat_deg": origin.lat_deg,
                "lon_deg": origin.lon_deg,
                "height_m": origin.height_m,
            },
            "water_level_m": harbour.site.water_level_m,
            "timezone": harbour.site.timezone,
            "is_simulated": True,
        }
    )


def camera_in(harbour: Harbour, site_id: int) -> CameraIn:
    """Return the camera with its calibrated lens."""
    intrinsics = harbour.camera.intrinsics
    return CameraIn.model_validate(
        {
            "site_id": site_id,
            "name": harbour.camera.name,
            "width_px": intrinsics.width_px,
            "height_px": intrinsics.height_px,
            "K": intrinsics.K.tolist(),
            "distortion": intrinsics.distortion.tolist(),
            "timezone": "UTC",
        }
    )


def keypoints_in(harbour: Harbour, viewport: Viewport) -> list[KeypointIn]:
    """Return the keypoints of a viewport with the places of their landmarks."""
    places = {landmark.name: landmark.place for landmark in harbour.landmarks}
    return [
        KeypointIn(
            name=seen.landmark,
            lat_deg=places[seen.landmark].lat_deg,
            lon_deg=places[seen.landmark].lon_deg,
            height_m=places[seen.landmark].height_m,
            u_px=seen.u_px,
            v_px=seen.v_px,
        )
        for seen in viewport.keypoints
    ]


def jpeg(image_bgr: UInt8Array) -> bytes:
    """Encode an image (height, width, 3), BGR."""
    _, encoded = cv2.imencode(".jpg", image_bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return encoded.tobytes()


def truth_rows(image_id: int, truths: Sequence[SimulatedTruth]) -> list[VesselTruth]:
    """Return the truth of an image as rows."""
    return [_truth_row(image_id, truth) for truth in truths]


def _truth_row(image_id: int, truth: SimulatedTruth) -> VesselTruth:
    box = truth.box_px or truth.whole_box_px
    return VesselTruth(
        image_id=image_id,
        identifier=truth.identifier,
        mmsi=truth.mmsi,
        vessel_class=VesselClass(truth.class_name.value),
        centroid_in_cam_m=truth.centroid_in_cam_m.tolist(),
        rotvec_cam_from_vessel=truth.rotvec_cam_from_vessel.tolist(),
        length_m=truth.length_m,
        width_m=truth.width_m,
        height_m=truth.height_m,
        corners_in_image_px=_pixels(truth.corners_in_image_px),
        visible_fraction=truth.visible_fraction,
        x1_px=box[0],
        y1_px=box[1],
        x2_px=box[2],
        y2_px=box[3],
    )


def _pixels(points_px: FloatArray) -> list[list[float] | None]:
    return [None if np.isnan(point).any() else [float(x) for x in point] for point in points_px]
