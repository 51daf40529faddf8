"""A viewport whose camera is known exactly, with the landmarks it sees."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.registration.conversion import frame_of
from app.tables.sites import Viewport
from tests.factories.sites import make_camera, make_site, make_viewport

WIDTH_PX, HEIGHT_PX, FOCAL_PX = 2560, 1920, 6500.0


@dataclass(frozen=True)
class Scene:
    """A viewport, its site's frame, its true camera, and keypoints without any error."""

    viewport: Viewport
    frame: EnuFrame
    camera: Camera
    keypoints: list[dict[str, Any]]


def look_at(center: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return R_cam_from_world (3, 3) of an upright camera."""
    forward = (target - center) / np.linalg.norm(target - center)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(forward, right), forward])


def make_scene(session: Session) -> Scene:
    """Insert a camera 30 m above the water that looks north-west over fourteen landmarks."""
    site = make_site(session, "Harbour")
    row = make_camera(
        session,
        site,
        "Quay",
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        fx_px=FOCAL_PX,
        fy_px=FOCAL_PX,
        cx_px=1279.5,
        cy_px=959.5,
    )
    viewport = make_viewport(session, row, "North-west")
    center, target = np.array([12.0, -7.0, 30.0]), np.array([-300.0, 350.0, 5.0])
    K = np.array([[FOCAL_PX, 0, 1279.5], [0, FOCAL_PX, 959.5], [0, 0, 1]])
    R = look_at(center, target)
    camera = Camera(Intrinsics(WIDTH_PX, HEIGHT_PX, K), R, center)
    generator = np.random.default_rng(4)
    pixels = generator.uniform([100, 200], [2460, 1700], (14, 2))
    ranges_m = generator.uniform(150, 900, (14, 1))
    points = center + camera.rays(pixels) * ranges_m
    frame = frame_of(site)
    keypoints = []
    for number, (point, (u_px, v_px)) in enumerate(zip(points, pixels, strict=True), 1):
        place: Geodetic = frame.geodetic(point)
        keypoints.append(
            {
                "name": f"Landmark {number}",
                "lat_deg": place.lat_deg,
                "lon_deg": place.lon_deg,
                "height_m": place.height_m,
                "u_px": float(u_px),
                "v_px": float(v_px),
            }
        )
    return Scene(viewport, frame, camera, keypoints)
