"""A viewport of its own to register: a camera that is known, landmarks it sees, a photograph.

The photograph is coloured noise, so that each pixel can be told from its neighbours.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import httpx2
import numpy as np

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from tests.factories.imagery import photograph

WIDTH_PX, HEIGHT_PX = 640, 480
ORIGIN = Geodetic(53.54, 9.98, 40.0)
WATER_LEVEL_M = 39.6
INTRINSICS = Intrinsics(
    WIDTH_PX, HEIGHT_PX, np.array([[800.0, 0, 319.5], [0, 800.0, 239.5], [0, 0, 1]])
)
# East, north and up of the origin, metres: near and far, left and right, low and high.
PLACES_M = (
    (-22, 74, 5),
    (20, 85, 1),
    (-5, 120, 6),
    (42, 150, 12),
    (-60, 190, 2),
    (10, 240, 4),
    (95, 310, 25),
    (-120, 420, 30),
    (60, 520, 8),
    (-40, 640, 45),
    (210, 780, 60),
    (-250, 900, 70),
)
_numbers = itertools.count(1)


def true_camera() -> Camera:
    """Stand 30 m above the origin, looking north and 4 degrees down."""
    down = np.radians(4.0)
    forward = np.array([0, np.cos(down), -np.sin(down)])
    right = np.array([1.0, 0, 0])
    R = np.vstack([right, np.cross(forward, right), forward])
    return Camera(INTRINSICS, R, np.array([0.0, 0.0, 30.0]))


def true_keypoints() -> list[dict[str, Any]]:
    """Give what the camera sees of the landmarks, exactly, as REST takes keypoints."""
    frame = EnuFrame(ORIGIN)
    points = np.array(PLACES_M, dtype=np.float64)
    keypoints = []
    for number, (point, (u_px, v_px)) in enumerate(
        zip(points, true_camera().project(points), strict=True), 1
    ):
        place = frame.geodetic(point)
        assert 0 <= u_px < WIDTH_PX
        assert 0 <= v_px < HEIGHT_PX
        keypoints.append(
            {
                "name": f"Mark {number:02d}",
                "lat_deg": place.lat_deg,
                "lon_deg": place.lon_deg,
                "height_m": place.height_m,
                "u_px": float(u_px),
                "v_px": float(v_px),
                "role": "control",
            }
        )
    return keypoints


@dataclass(frozen=True)
class Registrable:
    """A viewport with what belongs to it; `seed` is that of its photograph's noise."""

    site_id: int
    viewport_id: int
    seed: int


def make_registrable(api: httpx2.Client, keypoint_count: int) -> Registrable:
    """Make a site with all landmarks and a viewport on which the first ones are placed."""
    number = next(_numbers)
    origin = {"lat_deg": ORIGIN.lat_deg, "lon_deg": ORIGIN.lon_deg, "height_m": ORIGIN.height_m}
    site = {"name": f"Trial dock {number}", "origin": origin, "water_level_m": WATER_LEVEL_M}
    site_id = _made(api, "/sites", site)
    camera = {
        "site_id": site_id,
        "name": "Mast",
        "width_px": WIDTH_PX,
        "height_px": HEIGHT_PX,
        "K": INTRINSICS.K.tolist(),
    }
    camera_id = _made(api, "/cameras", camera)
    viewport_id = _made(api, "/viewports", {"camera_id": camera_id, "name": "North"})
    keypoints = true_keypoints()
    for keypoint in keypoints:
        place = {name: keypoint[name] for name in ("name", "lat_deg", "lon_deg", "height_m")}
        _made(api, f"/sites/{site_id}/landmarks", place)
    if keypoint_count:
        answer = api.put(f"/viewports/{viewport_id}/keypoints", json=keypoints[:keypoint_count])
        assert answer.status_code == 200, answer.text
    answer = api.post(
        "/images",
        data={"camera_id": str(camera_id), "captured_at": "2026-06-01T12:00:00Z"},
        files={"file": ("noise.png", photograph(number, WIDTH_PX, HEIGHT_PX, kind="PNG"))},
    )
    assert answer.status_code == 201, answer.text
    return Registrable(site_id, viewport_id, number)


def _made(api: httpx2.Client, path: str, body: dict[str, Any]) -> int:
    answer = api.post(path, json=body)
    assert answer.status_code == 201, answer.text
    return int(answer.json()["id"])
