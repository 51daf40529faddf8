"""Ships strewn over the water in front of a camera, without pictures: a laboratory for estimators.

The harbour has traffic, weather and tides; a roadstead has nothing but what a pose depends on, each
with a known spread: the height of the water that all ships share, the errors of AIS positions and
headings, the camera's rotation, the edges of detections. Boxes bound the projected hull mesh.
"""

from dataclasses import dataclass
from math import radians

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.metrics import BoxPose
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix
from app.domain.vessel_state import VesselState
from app.simulation.mesh import Mesh
from app.simulation.ship_plans import Fleet
from app.simulation.ships import ShipType, build_ship

FRAME = EnuFrame(Geodetic(53.54, 9.9, 0.0))
CAMERA_HEIGHT_M = 30.0
PITCH_DEG = 4.0
FOCAL_PX = 6570.0
WIDTH_PX, HEIGHT_PX = 2560, 1920
SIDE_SHARE = 0.17  # of the range: ships lie this far to either side
TYPES = tuple(ShipType)


@dataclass(frozen=True, slots=True)
class RoadsteadSettings:
    """Spreads (one sigma each) and the range of the ships from the camera."""

    ships: int = 20
    water_level_sigma_m: float = 1.0
    position_sigma_m: float = 5.0  # east and north each
    heading_sigma_deg: float = 3.0
    rotation_sigma_deg: float = 0.0  # about each axis of the camera
    edge_sigma_px: float = 1.0
    nearest_m: float = 180.0
    farthest_m: float = 900.0


@dataclass(frozen=True, eq=False)
class Anchored:
    """One ship: its detection, its AIS state, and the truth in the true camera's frame."""

    detection: Detection
    state: VesselState
    truth: BoxPose
    ship_type: ShipType
    range_m: float
    heading_deg: float


@dataclass(frozen=True, eq=False)
class Roadstead:
    """Ships on one water surface. `camera` is the registered one, `true_camera` took the image."""

    camera: Camera
    true_camera: Camera
    water_level_m: float
    ships: list[Anchored]


def make_roadstead(seed: int, settings: RoadsteadSettings | None = None) -> Roadstead:
    """Anchor ships of the fleet kept for judging; the same for the same seed and settings."""
    settings = settings or RoadsteadSettings()
    rng = np.random.default_rng(seed)
    true_camera = _camera()
    error = np.radians(settings.rotation_sigma_deg) * rng.normal(size=3)
    camera = Camera(
        true_camera.intrinsics,
        matrix_from_rotvec(error) @ true_camera.R_cam_from_world,
        true_camera.center_in_world,
    )
    level_m = float(rng.normal(0, settings.water_level_sigma_m))
    ships: list[Anchored] = []
    while len(ships) < settings.ships:
        ship = _anchored(rng, true_camera, level_m, str(len(ships)), settings)
        if ship is not None:
            ships.append(ship)
    return Roadstead(camera, true_camera, level_m, ships)


def _camera() -> Camera:
    pitch = radians(PITCH_DEG)
    forward = np.array([0.0, np.cos(pitch), -np.sin(pitch)])
    right = np.array([1.0, 0.0, 0.0])
    R_cam_from_world = np.vstack([right, np.cross(forward, right), forward])
    K = np.array([[FOCAL_PX, 0, (WIDTH_PX - 1) / 2], [0, FOCAL_PX, (HEIGHT_PX - 1) / 2], [0, 0, 1]])
    center = np.array([0.0, 0.0, CAMERA_HEIGHT_M])
    return Camera(Intrinsics(WIDTH_PX, HEIGHT_PX, K), R_cam_from_world, center)


def _anchored(
    rng: np.random.Generator,
    camera: Camera,
    level_m: float,
    identifier: str,
    settings: RoadsteadSettings,
) -> Anchored | None:
    """Anchor one ship; None when it is not wholly in the image."""
    ship_type = TYPES[int(rng.integers(len(TYPES)))]
    ship = build_ship(ship_type, rng, Fleet.JUDGING)
    range_m = float(rng.uniform(settings.nearest_m, settings.farthest_m))
    east_m = range_m * float(rng.uniform(-SIDE_SHARE, SIDE_SHARE))
    heading_deg = float(rng.uniform(0, 360))
    # The water's surface follows the ellipsoid, the frame is flat: 6 cm at 900 m.
    flat = FRAME.geodetic(np.array([east_m, range_m, 0.0]))
    middle = FRAME.position(flat.lat_deg, flat.lon_deg, level_m)
    R_world_from_ship = _axes(FRAME.axes(flat.lat_deg, flat.lon_deg), heading_deg).T
    size = (ship.length_m, ship.width_m, ship.height_m)
    detection = _detected(rng, camera, ship.mesh, R_world_from_ship, middle, settings)
    if detection is None:
        return None
    off_m = rng.normal(0, settings.position_sigma_m, 2)
    place = FRAME.geodetic(middle + np.array([*off_m, 0.0]))
    half_length, half_width = ship.length_m / 2, ship.width_m / 2
    variance_m2 = max(settings.position_sigma_m, 0.1) ** 2
    state = VesselState(
        identifier=identifier,
        lat_deg=place.lat_deg,
        lon_deg=place.lon_deg,
        heading_deg=float((heading_deg + rng.normal(0, settings.heading_sigma_deg)) % 360),
        speed_kn=0.0,
        age_s=0.0,
        to_bow_m=half_length,
        to_stern_m=half_length,
        to_port_m=half_width,
        to_starboard_m=half_width,
        position_covariance_m2=(variance_m2, 0.0, variance_m2),
        heading_sigma_deg=max(settings.heading_sigma_deg, 0.1),
    )
    centroid = middle + ship.height_m / 2 * R_world_from_ship[:, 2]
    truth = BoxPose(
        camera.to_cam(centroid)[0],
        rotvec_from_matrix(camera.R_cam_from_world @ R_world_from_ship),
        *size,
    )
    return Anchored(detection, state, truth, ship_type, range_m, heading_deg)


def _axes(enu_axes_in_world: FloatArray, heading_deg: float) -> FloatArray:
    """Return forward, port and up of a ship (3, 3) as rows in the world frame."""
    heading = radians(heading_deg)
    forward = np.array([np.sin(heading), np.cos(heading), 0.0])
    port = np.array([-np.cos(heading), np.sin(heading), 0.0])
    return np.vstack([forward, port, [0.0, 0.0, 1.0]]) @ enu_axes_in_world


def _detected(
    rng: np.random.Generator,
    camera: Camera,
    mesh: Mesh,
    R_world_from_ship: FloatArray,
    middle_in_world: FloatArray,
    settings: RoadsteadSettings,
) -> Detection | None:
    pixels = camera.project(mesh.vertices @ R_world_from_ship.T + middle_in_world)
    # Detections count from the image's edge, half a pixel before the first pixel's centre.
    low, high = pixels.min(axis=0) + 0.5, pixels.max(axis=0) + 0.5
    margin = 5.0
    inside = (low >= margin).all() and (high <= (WIDTH_PX - margin, HEIGHT_PX - margin)).all()
    if not inside:
        return None
    x1, y1, x2, y2 = np.concatenate([low, high]) + rng.normal(0, settings.edge_sigma_px, 4)
    return Detection(float(x1), float(y1), float(x2), float(y2), 1.0)
