"""Example pictures of the guideline, drawn to scale by the camera model that everything here uses.

A ship of 60 m lies 190 m from a camera that stands 45 m above the water; each picture puts a box
over it with exactly the error its caption names. So "12 degrees" in a picture are 12 degrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, radians, sin

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics

WIDTH_PX, HEIGHT_PX = 360, 200
LENGTH_M, BREADTH_M, HEIGHT_M = 60.0, 11.0, 13.0
HEADING_DEG = 62.0
DISTANCE_M, CAMERA_HEIGHT_M = 190.0, 45.0
_LIGHT = np.array([-0.35, -0.6, 0.72])
_BOX_EDGES = (
    ((0, 1), (1, 2), (2, 3), (3, 0)),
    ((4, 5), (5, 6), (6, 7), (7, 4)),
    ((0, 4), (1, 5), (2, 6), (3, 7)),
)


@dataclass(frozen=True, slots=True)
class Box:
    """A box as a pipeline might give it: the ship's own, with an error."""

    forward_m: float = 0.0
    away_m: float = 0.0
    turn_deg: float = 0.0
    length_m: float = LENGTH_M
    breadth_m: float = BREADTH_M
    height_m: float = HEIGHT_M


@dataclass(frozen=True, slots=True)
class Face:
    """A visible part of a ship: its outline as SVG points, and how bright it is (0 to 2)."""

    points: str
    shade: int


@dataclass(frozen=True, slots=True)
class Picture:
    """A drawing: the ship's faces, the box's edges and its bow face as SVG, and what it shows."""

    caption: str
    faces: tuple[Face, ...]
    edges: str
    bow: str
    mast: str


@lru_cache(maxsize=1)
def pictures() -> dict[str, tuple[Picture, ...]]:
    """Return the example pictures by grade."""
    return {
        "good": (
            _picture("Ends, sides and top follow the hull.", Box()),
            _picture("The mast stands out of the box: still Good.", Box(), mast_m=9),
        ),
        "ok": (
            _picture("Off-centre: 5 m too far forward.", Box(forward_m=5)),
            _picture("Skewed: the heading is 12° off.", Box(turn_deg=12)),
        ),
        "bad": (
            _picture("The mast went into the height.", Box(height_m=23), mast_m=10),
            _picture("Right vessel, but 20 m too far away.", Box(away_m=20)),
        ),
        "wrong": (
            _picture("Another vessel's AIS: a boat of 24 m.", Box(14, 3, -50, 24, 6, 8)),
            _picture("No vessel under the box.", Box(), ship=False),
        ),
    }


def _picture(caption: str, box: Box, *, mast_m: float = 0.0, ship: bool = True) -> Picture:
    camera = _camera()
    corners = camera.project(_box_corners(box))
    edges = [f"M{_xy(corners[a])}L{_xy(corners[b])}" for ring in _BOX_EDGES for a, b in ring]
    return Picture(
        caption=caption,
        faces=tuple(_ship(camera)) if ship else (),
        edges="".join(edges),
        bow=_outline(corners[[0, 1, 5, 4]]),
        mast=_mast(camera, mast_m) if mast_m else "",
    )


def _camera() -> Camera:
    down = radians(13.5)
    forward = np.array([0.0, cos(down), -sin(down)])
    right = np.array([1.0, 0.0, 0.0])
    rotation = np.array([right, np.cross(forward, right), forward])
    intrinsics = Intrinsics(
        WIDTH_PX,
        HEIGHT_PX,
        np.array([[840.0, 0, WIDTH_PX / 2], [0, 840.0, HEIGHT_PX / 2 + 16], [0, 0, 1]]),
    )
    return Camera(intrinsics, rotation, np.array([0.0, 0.0, CAMERA_HEIGHT_M]))


def _placed(points_in_vessel: FloatArray, heading_deg: float, center: FloatArray) -> FloatArray:
    """Turn vessel coordinates (forward, port, up) (n, 3) into the picture's world."""
    heading = radians(heading_deg)
    forward = np.array([sin(heading), cos(heading), 0.0])
    port = np.array([-cos(heading), sin(heading), 0.0])
    axes = np.array([forward, port, [0.0, 0.0, 1.0]])
    return np.asarray(points_in_vessel @ axes + center, dtype=np.float64)


def _box_corners(box: Box) -> FloatArray:
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * [box.length_m / 2, box.breadth_m / 2]
    bottom = np.column_stack([signs, np.zeros(4)])
    top = np.column_stack([signs, np.full(4, box.height_m)])
    ship_heading = radians(HEADING_DEG)
    moved = box.forward_m * np.array([sin(ship_heading), cos(ship_heading), 0.0])
    center = np.array([0.0, DISTANCE_M + box.away_m, 0.0]) + moved
    return _placed(np.vstack([bottom, top]), HEADING_DEG + box.turn_deg, center)


def _ship(camera: Camera) -> list[Face]:
    """Draw hull, deck house and bridge, what is nearer over what is farther."""
    hull = [(30, 0), (20, -5.5), (-30, -5.5), (-30, 5.5), (20, 5.5)]
    parts = (
        _prism(hull, 0.0, 5.5),
        _prism(_rectangle(-27, -9, 4.6), 5.5, 9.0),
        _prism(_rectangle(-25, -14, 4.0), 9.0, HEIGHT_M),
    )
    faces = []
    for part in parts:
        for face in part:
            world = _placed(face, HEADING_DEG, np.array([0.0, DISTANCE_M, 0.0]))
            normal = np.cross(world[1] - world[0], world[2] - world[1])
            normal /= np.linalg.norm(normal)
            if normal @ (camera.center_in_world - world.mean(axis=0)) > 0:
                faces.append(Face(_outline(camera.project(world)), _shade(normal)))
    return faces


def _shade(normal: FloatArray) -> int:
    brightness = float(normal @ _LIGHT)
    return 2 if brightness > 0.6 else int(brightness > 0.3)


def _rectangle(stern_m: float, bow_m: float, half_m: float) -> list[tuple[float, float]]:
    return [(bow_m, half_m), (bow_m, -half_m), (stern_m, -half_m), (stern_m, half_m)]


def _prism(
    outline: Sequence[tuple[float, float]], bottom_m: float, top_m: float
) -> list[FloatArray]:
    """Return the side faces and the roof over an outline that runs clockwise seen from above."""
    lower = np.array([(x, y, bottom_m) for x, y in outline])
    upper = np.array([(x, y, top_m) for x, y in outline])
    following = np.roll(np.arange(len(outline)), -1)
    sides = [
        np.array([lower[i], upper[i], upper[j], lower[j]]) for i, j in enumerate(following.tolist())
    ]
    return [*sides, upper[::-1]]


def _mast(camera: Camera, height_m: float) -> str:
    ends = np.array([[-19.0, 0.0, HEIGHT_M], [-19.0, 0.0, HEIGHT_M + height_m]])
    foot, top = camera.project(_placed(ends, HEADING_DEG, np.array([0.0, DISTANCE_M, 0.0])))
    return f"M{_xy(foot)}L{_xy(top)}"


def _outline(points: FloatArray) -> str:
    return " ".join(_xy(point) for point in points)


def _xy(point: FloatArray) -> str:
    return f"{point[0]:.1f},{point[1]:.1f}"
