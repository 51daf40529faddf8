"""A vessel's box as a person sets it: upright on its place, with a heading and three sizes.

A generated box may be slightly sheared (the paper raises its top along the upper edge's plane, not
along the vertical). A person moves, turns and stretches an upright one. Its numbers are kept in the
east-north-up frame at a reference, the centre of the generated box's bottom, because a browser then
needs only a rotation and sums to draw it, and a distance on the water is a distance in it.
"""

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.geodesy import Geodetic, WorldFrame

# Signs of half a length (forward) and half a width (port) of the bottom's corners.
_FORWARD = np.array([1.0, 1.0, -1.0, -1.0])
_PORT = np.array([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class UprightBox:
    """The centre of its bottom east, north and up of a reference, its heading and its sizes."""

    east_m: float
    north_m: float
    up_m: float
    heading_deg: float
    length_m: float
    width_m: float
    height_m: float

    def axes_in_local(self) -> FloatArray:
        """Rows forward, port, up (3, 3) in the reference's east-north-up frame."""
        heading = radians(self.heading_deg)
        forward = np.array([sin(heading), cos(heading), 0.0])
        port = np.array([-cos(heading), sin(heading), 0.0])
        return np.vstack([forward, port, [0.0, 0.0, 1.0]])

    def corners_in_local(self) -> FloatArray:
        """Corners (8, 3) in the usual order: the bottom from bow-port on, then the top."""
        forward, port, up = self.axes_in_local()
        bottom = (
            np.array([self.east_m, self.north_m, self.up_m])
            + np.outer(_FORWARD * self.length_m / 2, forward)
            + np.outer(_PORT * self.width_m / 2, port)
        )
        return np.vstack([bottom, bottom + self.height_m * up])

    def centroid_in_local(self) -> FloatArray:
        """Return the mean of the eight corners, (3,)."""
        return np.array([self.east_m, self.north_m, self.up_m + self.height_m / 2])


def local_camera(camera: Camera, frame: WorldFrame, reference: Geodetic) -> Camera:
    """Return a camera in the east-north-up frame at a reference."""
    R_local_from_world = frame.axes(reference.lat_deg, reference.lon_deg)
    origin = frame.position(reference.lat_deg, reference.lon_deg, reference.height_m)
    return Camera(
        camera.intrinsics,
        camera.R_cam_from_world @ R_local_from_world.T,
        R_local_from_world @ (camera.center_in_world - origin),
    )


def geodetic_of(frame: WorldFrame, reference: Geodetic, point_in_local: npt.ArrayLike) -> Geodetic:
    """Return the WGS84 place of a point of the east-north-up frame at a reference."""
    R_local_from_world = frame.axes(reference.lat_deg, reference.lon_deg)
    origin = frame.position(reference.lat_deg, reference.lon_deg, reference.height_m)
    in_local = np.asarray(point_in_local, dtype=np.float64)
    return frame.geodetic(origin + R_local_from_world.T @ in_local)


def local_of(frame: WorldFrame, reference: Geodetic, place: Geodetic) -> FloatArray:
    """Return a WGS84 place in the east-north-up frame at a reference, (3,) metres."""
    R_local_from_world = frame.axes(reference.lat_deg, reference.lon_deg)
    origin = frame.position(reference.lat_deg, reference.lon_deg, reference.height_m)
    point = frame.position(place.lat_deg, place.lon_deg, place.height_m)
    return np.asarray(R_local_from_world @ (point - origin), dtype=np.float64)


def view_axes_in_local(camera_in_local: Camera) -> tuple[FloatArray, FloatArray]:
    """Return the horizontal unit vectors across (to the right) and away, seen from the camera.

    They are those at the reference. Raises ValueError for a camera straight above it.
    """
    away = -camera_in_local.center_in_world[:2]
    distance = float(np.linalg.norm(away))
    if distance < 1e-6:
        raise ValueError("the camera stands straight above the vessel: there is no `away`")
    east, north = away / distance
    return np.array([north, -east, 0.0]), np.array([east, north, 0.0])


def bottom_center_in_world(
    camera: Camera,
    up_in_world: FloatArray,
    forward_in_world: FloatArray,
    size_m: tuple[float, float],
    bottom_px: npt.ArrayLike,
) -> FloatArray | None:
    """Find the centre (3,) of a box's bottom from where its corners were drawn.

    `bottom_px` (4, 2) are bow-port, bow-starboard, stern-starboard, stern-port, NaN where a corner
    has no pixel; `size_m` is length and width. With the rectangle's size and directions known, each
    line of sight leaves one unknown, so two corners suffice; None for fewer, or where all lie in
    one direction. It holds for any estimator, whatever water level it used.
    """
    pixels = np.asarray(bottom_px, dtype=np.float64).reshape(4, 2)
    seen = np.isfinite(pixels).all(axis=1)
    rays = camera.rays(pixels[seen])
    if seen.sum() < 2 or not np.isfinite(rays).all():
        return None
    port = np.cross(up_in_world, forward_in_world)
    offsets = np.outer(_FORWARD * size_m[0] / 2, forward_in_world) + np.outer(
        _PORT * size_m[1] / 2, port
    )
    # center + offset_i = C + s_i ray_i, for the centre and all s_i at once.
    count = len(rays)
    equations = np.zeros((3 * count, 3 + count))
    for i, ray in enumerate(rays):
        equations[3 * i : 3 * i + 3, :3] = np.eye(3)
        equations[3 * i : 3 * i + 3, 3 + i] = -ray
    right = (camera.center_in_world - offsets[seen]).reshape(-1)
    solution, _, rank, _ = np.linalg.lstsq(equations, right)
    return None if rank < 3 + count else np.asarray(solution[:3], dtype=np.float64)
