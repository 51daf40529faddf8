"""The harbour's camera, its pointings, and the landmarks a person would click in each.

The camera never moves, but someone turned it between two sessions: each pointing is a viewport
with its own true extrinsics and its own keypoints. Keypoints are clicked, so they are about a
pixel off; only landmarks that can be seen are clicked, spread over the image.
"""

from dataclasses import dataclass
from datetime import datetime
from math import cos, radians, sin

import numpy as np

from app.domain.arrays import Float32Array, FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import Geodetic
from app.simulation.painter import ViewportScene

_FOCAL_SHARE = 1700 / 1280  # of the image width
_MOST_KEYPOINTS = 20


@dataclass(frozen=True, slots=True)
class Landmark:
    """A named place in the world (WGS84, ellipsoidal height)."""

    name: str
    place: Geodetic


@dataclass(frozen=True, slots=True)
class Keypoint:
    """A landmark as clicked in a viewport: pixels, (0, 0) the centre of the first pixel."""

    landmark: str
    u_px: float
    v_px: float


@dataclass(frozen=True, eq=False)
class Viewport:
    """One pointing with its true camera in ENU; `valid_until` is None while it is in use."""

    name: str
    valid_from: datetime
    valid_until: datetime | None
    camera: Camera
    keypoints: tuple[Keypoint, ...]


def make_intrinsics(rng: np.random.Generator, width_px: int, height_px: int) -> Intrinsics:
    """Draw a lens: focal length about 1.33 image widths, mild barrel distortion."""
    focal = _FOCAL_SHARE * width_px * float(rng.uniform(0.97, 1.03))
    K = np.array(
        [
            [focal, 0.0, (width_px - 1) / 2 + width_px * float(rng.uniform(-0.012, 0.012))],
            [0.0, focal * float(rng.uniform(0.998, 1.004)),
             (height_px - 1) / 2 + height_px * float(rng.uniform(-0.012, 0.012))],
            [0.0, 0.0, 1.0],
        ]
    )  # fmt: skip
    k1 = float(rng.uniform(-0.09, -0.04))
    tangential = rng.uniform(-4e-4, 4e-4, 2)
    return Intrinsics(width_px, height_px, K, np.array([k1, -0.3 * k1, *tangential, 0.0]))


def looking(
    intrinsics: Intrinsics,
    center_in_enu: FloatArray,
    azimuth_deg: float,
    tilt_deg: float,
    roll_deg: float,
) -> Camera:
    """Return a camera that looks to an azimuth, tilted below the horizon, rolled clockwise."""
    a, t, r = radians(azimuth_deg), radians(tilt_deg), radians(roll_deg)
    ahead = np.array([sin(a) * cos(t), cos(a) * cos(t), -sin(t)])
    right = np.array([cos(a), -sin(a), 0.0])
    down = np.cross(ahead, right)
    turned_right = cos(r) * right + sin(r) * down
    return Camera(
        intrinsics,
        np.stack([turned_right, np.cross(ahead, turned_right), ahead]),
        center_in_enu,
    )


def click_keypoints(
    rng: np.random.Generator,
    scene: ViewportScene,
    landmarks_in_enu: dict[str, FloatArray],
    sigma_px: float,
) -> tuple[Keypoint, ...]:
    """Click up to 20 visible landmarks, chosen one by one as far as possible from those before."""
    names = list(landmarks_in_enu)
    points = np.array([landmarks_in_enu[name] for name in names])
    pixels = scene.camera.project(points)
    land = scene.backdrop.inverse_depth_above(-np.inf)
    shown = [i for i in range(len(names)) if _visible(scene, land, points[i], pixels[i])]
    chosen: list[int] = []
    while shown and len(chosen) < _MOST_KEYPOINTS:
        if chosen:
            away = [float(np.min(np.hypot(*(pixels[chosen] - pixels[i]).T))) for i in shown]
        else:
            away = [float(pixels[i][1]) for i in shown]  # begin with the nearest, lowest one
        chosen.append(shown.pop(int(np.argmax(away))))
    noise = rng.normal(0.0, 1.0, (len(chosen), 2)) * sigma_px
    return tuple(
        Keypoint(names[i], float(pixels[i][0] + dx), float(pixels[i][1] + dy))
        for i, (dx, dy) in zip(chosen, noise, strict=True)
    )


def _visible(
    scene: ViewportScene, land: Float32Array, point: FloatArray, pixel: FloatArray
) -> bool:
    """Whether nothing ashore stands between the camera and a landmark inside the image.

    `land` is the inverse depth of the land at the scene's samples.
    """
    inner = scene.camera.intrinsics
    margin = 6.0
    if not np.isfinite(pixel).all():
        return False
    inside = margin <= pixel[0] < inner.width_px - margin
    if not (inside and margin <= pixel[1] < inner.height_px - margin):
        return False
    column, row = ((pixel + 0.5) * scene.backdrop.window.samples_per_px).astype(int)
    # About a corner some of its own surface must show, and nothing clearly nearer prevail.
    around = land[row - 2 : row + 3, column - 2 : column + 3]
    depth = float(scene.camera.to_cam(point)[0, 2])
    nearest = 1 / max(float(np.median(around)), 1e-9)
    own = np.abs(1 / np.maximum(around, 1e-9) - depth) < 0.02 * depth + 1.0
    return nearest > 0.97 * depth - 1.0 and bool(own.any())
