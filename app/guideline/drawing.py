"""A pose drawn over its photograph as one SVG: cropped to the box, with some surroundings.

SVG counts from a pixel's corner, our geometry from its centre: half a pixel is added.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from app.tables.runs import Pose

MARGIN = 0.6
_EDGES = (
    (0, 1),
    (1, 2),
    (2, 3),
    (3, 0),
    (4, 5),
    (5, 6),
    (6, 7),
    (7, 4),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
)
_BOW = (0, 1, 5, 4)


@dataclass(frozen=True, slots=True)
class PoseDrawing:
    """What a template needs to draw a pose: the photograph, the part shown, box and bow."""

    image_href: str
    width_px: int
    height_px: int
    view_box: str
    edges: str
    bow: str
    vessel: str


def draw_pose(pose: Pose, vessel: str) -> PoseDrawing:
    """Draw a pose; edges with an end behind the camera are left out."""
    image, box = pose.image, pose.match.detection
    corners = [None if corner is None else _moved(corner) for corner in pose.corners_in_image_px]
    seen = [corner for corner in corners if corner is not None]
    xs = [box.x1_px, box.x2_px, *(x for x, _ in seen)]
    ys = [box.y1_px, box.y2_px, *(y for _, y in seen)]
    extent = max(max(xs) - min(xs), (max(ys) - min(ys)) * 1.6, image.width_px / 12)
    width = min(extent * (1 + MARGIN), float(image.width_px))
    height = min(width / 1.6, float(image.height_px))
    left = _within((min(xs) + max(xs) - width) / 2, image.width_px - width)
    top = _within((min(ys) + max(ys) - height) / 2, image.height_px - height)
    lines = [(corners[a], corners[b]) for a, b in _EDGES]
    bow = [corners[index] for index in _BOW]
    return PoseDrawing(
        image_href=f"/api/v1/images/{image.id}/file?v={image.sha256[:12]}",
        width_px=image.width_px,
        height_px=image.height_px,
        view_box=f"{left:.1f} {top:.1f} {width:.1f} {height:.1f}",
        edges="".join(f"M{_xy(a)}L{_xy(b)}" for a, b in lines if a is not None and b is not None),
        bow=" ".join(_xy(corner) for corner in bow if corner is not None),
        vessel=vessel,
    )


def _moved(corner: Sequence[float]) -> tuple[float, float]:
    return corner[0] + 0.5, corner[1] + 0.5


def _within(start: float, most: float) -> float:
    return min(max(start, 0.0), max(most, 0.0))


def _xy(point: tuple[float, float]) -> str:
    return f"{point[0]:.1f},{point[1]:.1f}"
