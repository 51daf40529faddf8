"""A second shipyard and other weather, so that no estimator is judged only by ships we know.

Nothing here is shared with the simulated harbour: hulls are clouds of points from plain formulas,
ships are as long as 200 m or as short as 8, antennas stand anywhere, and errors may be other than
stated, heavy-tailed, or of a detector that likes its boxes too small. What stays the same is the
question: where does the ship stand, given its box, its AIS state and a registered camera?
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import HALF_PIXEL, Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.metrics import BoxPose
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix
from app.domain.vessel_state import VesselState
from app.domain.waterplane import vessel_axes

FRAME = EnuFrame(Geodetic(51.9, 4.2, 0.0))
Rng = np.random.Generator


@dataclass(frozen=True, slots=True)
class Weather:
    """What differs from truth: true spreads (one sigma) beside those that are stated."""

    ships: int = 20
    level_sigma_m: float = 1.0
    position_sigma_m: float = 5.0
    heading_sigma_deg: float = 3.0
    rotation_sigma_deg: float = 0.0
    edge_sigma_px: float = 1.0
    edge_bias_px: float = 0.0  # outwards, of every edge
    edge_share: float = 0.0  # sigma in share of the box's size
    heavy_tails: bool = False  # Student's t with 3 degrees for AIS
    stated_position_m: float | None = None
    stated_heading_deg: float | None = None
    size_sigma_m: float = 0.0
    focal_px: float = 6570.0
    camera_height_m: float = 30.0
    nearest_m: float = 180.0
    farthest_m: float = 900.0
    family: str | None = None


@dataclass(frozen=True, eq=False)
class OtherShip:
    """One ship as it was seen and reported, and its true pose in the true camera's frame."""

    detection: Detection
    state: VesselState
    truth: BoxPose
    family: str
    range_m: float


@dataclass(frozen=True, eq=False)
class OtherRoads:
    """Ships on one water surface before a registered and a true camera."""

    camera: Camera
    true_camera: Camera
    level_m: float
    ships: list[OtherShip]


def _ring(length: float, width: float, bow: float, stern: float) -> FloatArray:
    """Return a superellipse-like waterline (n, 2): `bow`, `stern` are the tapered shares."""
    along = np.linspace(-0.5, 0.5, 61)
    half = np.full_like(along, 0.5)
    fore, aft = along > 0.5 - bow, along < stern - 0.5
    half[fore] *= np.sqrt(np.clip(1 - ((along[fore] - 0.5 + bow) / bow) ** 2, 0, 1))
    half[aft] *= np.sqrt(np.clip(1 - ((stern - 0.5 - along[aft]) / stern) ** 2, 0, 1))
    ring = np.vstack([np.column_stack([along, half]), np.column_stack([along, -half])])
    return ring * (length, width)


def _raised(ring: FloatArray, z: float, scale: float = 1.0, shift: float = 0.0) -> FloatArray:
    return np.column_stack([ring[:, 0] * scale + shift, ring[:, 1], np.full(len(ring), z)])


def _block(x: tuple[float, float], half: float, z: tuple[float, float]) -> FloatArray:
    return np.array([(a, b, c) for a in x for b in (-half, half) for c in z])


def _round_stern(rng: Rng) -> FloatArray:
    """Draw a coaster: rounded stern, deckhouse aft, mast forward."""
    length = rng.uniform(40, 110)
    width, free = length / rng.uniform(5.5, 7), rng.uniform(1.5, 4)
    ring = _ring(length, width, 0.25, 0.12)
    house = _block((-0.42 * length, -0.25 * length), 0.4 * width, (free, free + rng.uniform(6, 12)))
    mast = np.array([[0.42 * length, 0.0, free + rng.uniform(4, 10)]])
    return np.vstack([_raised(ring, 0), _raised(ring, free), house, mast])


def _raked_bow(rng: Rng) -> FloatArray:
    """Draw a yacht-like ship: long overhang forward, house amidships."""
    length = rng.uniform(25, 90)
    width, free = length / rng.uniform(4.5, 6.5), rng.uniform(1.5, 5)
    rake = rng.uniform(0.05, 0.12)
    ring = _ring(length, width, 0.4, 0.02)
    water = _raised(ring * (1, 0.92), 0, 1 - rake, -rake / 2 * length)
    house = _block((-0.3 * length, 0.15 * length), 0.36 * width, (free, free + rng.uniform(4, 9)))
    mast = np.array([[-0.05 * length, 0.0, free + rng.uniform(10, 16)]])
    return np.vstack([water, _raised(ring, free), house, mast])


def _catamaran(rng: Rng) -> FloatArray:
    """Draw two slim hulls below a wide deck with a cabin over nearly all of it."""
    length = rng.uniform(18, 45)
    width, free = length / rng.uniform(2.8, 4), rng.uniform(1.5, 3)
    hull = _ring(length, 0.22 * width, 0.35, 0.02)
    apart = np.array([0, 0.39 * width])
    hulls = [_raised(hull + side * apart, 0) for side in (-1, 1)]
    deck = _block((-0.5 * length, 0.42 * length), 0.5 * width, (free * 0.6, free))
    cabin = _block((-0.45 * length, 0.3 * length), 0.42 * width, (free, free + rng.uniform(2, 5)))
    return np.vstack([*hulls, deck, cabin])


def _bulk_carrier(rng: Rng) -> FloatArray:
    """Draw a large ship with everything tall aft."""
    length = rng.uniform(120, 200)
    width, free = length / rng.uniform(5.8, 6.8), rng.uniform(4, 12)
    ring = _ring(length, width, 0.14, 0.06)
    house = _block((-0.47 * length, -0.38 * length), 0.48 * width, (free, free + 18))
    funnel = _block((-0.48 * length, -0.45 * length), 0.1 * width, (free, free + 22))
    return np.vstack([_raised(ring, 0), _raised(ring, free), house, funnel])


def _supply_ship(rng: Rng) -> FloatArray:
    """Draw a ship with its house right forward and a long low deck aft."""
    length = rng.uniform(50, 95)
    width, free = length / rng.uniform(4.2, 5), rng.uniform(2, 4)
    ring = _ring(length, width, 0.22, 0.01)
    house = _block((0.15 * length, 0.4 * length), 0.45 * width, (free, free + rng.uniform(9, 15)))
    mast = np.array([[0.25 * length, 0.0, free + rng.uniform(17, 24)]])
    return np.vstack([_raised(ring * (1, 0.95), 0), _raised(ring, free), house, mast])


def _barge(rng: Rng) -> FloatArray:
    """Draw a plain low box."""
    length = rng.uniform(30, 90)
    return _block((-length / 2, length / 2), rng.uniform(4, 6), (0.0, rng.uniform(0.5, 1.5)))


def _sailing_boat(rng: Rng) -> FloatArray:
    """Draw a slim boat with a mast taller than it is long."""
    length = rng.uniform(8, 18)
    ring = _ring(length, length / rng.uniform(2.9, 3.8), 0.6, 0.3)
    mast = np.array([[rng.uniform(0, 0.15) * length, 0.0, length * rng.uniform(1.2, 1.5)]])
    boom = np.array([[-0.35 * length, rng.uniform(-0.2, 0.2) * length, 1.8]])
    return np.vstack([_raised(ring, 0, 0.88), _raised(ring, 0.9), mast, boom])


def _passenger_ship(rng: Rng) -> FloatArray:
    """Draw decks over nearly all of the length, wider than the hull at the water."""
    length = rng.uniform(60, 180)
    width, top = length / rng.uniform(6, 7.5), rng.uniform(12, 28)
    ring = _ring(length, width, 0.18, 0.04)
    house = _block((-0.47 * length, 0.3 * length), 0.5 * width, (4, top))
    return np.vstack([_raised(ring * (1, 0.96), 0, 0.96), _raised(ring, 4), house])


FAMILIES: dict[str, Callable[[Rng], FloatArray]] = {
    "round stern": _round_stern,
    "raked bow": _raked_bow,
    "catamaran": _catamaran,
    "bulk carrier": _bulk_carrier,
    "supply ship": _supply_ship,
    "barge": _barge,
    "sailing boat": _sailing_boat,
    "passenger ship": _passenger_ship,
}


def make_roads(seed: int, weather: Weather) -> OtherRoads:
    """Draw ships before a camera; the same for the same seed and weather."""
    rng = np.random.default_rng([seed, 77])
    true_camera = _camera(rng, weather)
    error = np.radians(weather.rotation_sigma_deg) * rng.normal(size=3)
    camera = Camera(
        true_camera.intrinsics,
        matrix_from_rotvec(error) @ true_camera.R_cam_from_world,
        true_camera.center_in_world,
    )
    level_m = float(rng.normal(0, weather.level_sigma_m))
    ships: list[OtherShip] = []
    while len(ships) < weather.ships:
        ship = _ship(rng, true_camera, level_m, 211000000 + len(ships), weather)
        if ship is not None:
            ships.append(ship)
    return OtherRoads(camera, true_camera, level_m, ships)


def _camera(rng: Rng, weather: Weather) -> Camera:
    middle_m = (weather.nearest_m + weather.farthest_m) / 2.2
    pitch = np.arctan2(weather.camera_height_m, middle_m)
    bearing = rng.uniform(0, 2 * np.pi)
    ahead = np.array([np.sin(bearing), np.cos(bearing), 0.0])
    forward = np.cos(pitch) * ahead - np.array([0.0, 0.0, np.sin(pitch)])
    right = np.array([ahead[1], -ahead[0], 0.0])
    K = np.array([[weather.focal_px, 0, 1279.5], [0, weather.focal_px, 959.5], [0, 0, 1]])
    rotation = np.vstack([right, np.cross(forward, right), forward])
    center = np.array([0.0, 0.0, weather.camera_height_m])
    return Camera(Intrinsics(2560, 1920, K), rotation, center)


def _ship(
    rng: Rng, camera: Camera, level_m: float, mmsi: int, weather: Weather
) -> OtherShip | None:
    """Draw one ship; None when it is not wholly in the image."""
    family = weather.family or str(rng.choice(list(FAMILIES)))
    points = FAMILIES[family](rng)
    low, high = points.min(axis=0), points.max(axis=0)
    points = points - [*(low + high)[:2] / 2, 0.0]
    length, width, height = (high - low)[0], (high - low)[1], high[2]
    range_m = rng.uniform(weather.nearest_m, weather.farthest_m)
    half_view = 1280 / weather.focal_px
    right, _, forward = camera.R_cam_from_world
    ahead = forward * (1, 1, 0) / np.hypot(*forward[:2])
    flat = range_m * (ahead + rng.uniform(-half_view, half_view) * right)
    there = FRAME.geodetic(flat)
    middle = FRAME.position(there.lat_deg, there.lon_deg, level_m)
    heading = rng.uniform(0, 360)
    axes = vessel_axes(FRAME.axes(there.lat_deg, there.lon_deg), heading)
    detection = _seen(rng, camera.project(middle + points @ axes), camera.intrinsics, weather)
    if detection is None:
        return None
    size = np.round(np.array([length, width]) + rng.normal(0, weather.size_sigma_m, 2))
    size = np.maximum(size, [6.0, 2.0])
    antenna = np.array([rng.uniform(-0.45, 0.45) * size[0], rng.uniform(-0.4, 0.4) * size[1]])
    antenna = np.round(antenna)
    draws = rng.standard_t(3, 3) / np.sqrt(3) if weather.heavy_tails else rng.normal(size=3)
    off = np.array([*draws[:2] * weather.position_sigma_m, 0.0])
    reported = FRAME.geodetic(middle + antenna[0] * axes[0] + antenna[1] * axes[1] + off)
    stated = weather.stated_position_m or max(weather.position_sigma_m, 0.1)
    state = VesselState(
        identifier=str(mmsi),
        lat_deg=reported.lat_deg,
        lon_deg=reported.lon_deg,
        heading_deg=float((heading + draws[2] * weather.heading_sigma_deg) % 360),
        speed_kn=0.0,
        age_s=0.0,
        to_bow_m=float(size[0] / 2 - antenna[0]),
        to_stern_m=float(size[0] / 2 + antenna[0]),
        to_port_m=float(size[1] / 2 - antenna[1]),
        to_starboard_m=float(size[1] / 2 + antenna[1]),
        position_covariance_m2=(stated**2, 0.0, stated**2),
        heading_sigma_deg=weather.stated_heading_deg or max(weather.heading_sigma_deg, 0.1),
    )
    truth = BoxPose(
        camera.to_cam((middle + height / 2 * axes[2])[None])[0],
        rotvec_from_matrix(camera.R_cam_from_world @ axes.T),
        float(length),
        float(width),
        float(height),
    )
    return OtherShip(detection, state, truth, family, float(range_m))


def _seen(rng: Rng, pixels: FloatArray, image: Intrinsics, weather: Weather) -> Detection | None:
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    if not ((low > 5).all() and (high < (image.width_px - 6, image.height_px - 6)).all()):
        return None
    size = np.tile(high - low, 2)
    spread = np.hypot(weather.edge_sigma_px, weather.edge_share * size)
    edges = np.concatenate([low, high]) + HALF_PIXEL + rng.normal(size=4) * spread
    edges += weather.edge_bias_px * np.array([-1, -1, 1, 1])
    x1, y1, x2, y2 = (float(edge) for edge in edges)
    if x2 - x1 < 4 or y2 - y1 < 4:
        return None
    return Detection(x1, y1, x2, y2, 1.0)
