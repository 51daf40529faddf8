"""Silhouettes: what a projected box covers of its photograph.

The outline of a box is convex, and so is its projection without distortion: the convex hull of the
eight projected corners. Where the photograph ends, the silhouette does.
"""

from collections.abc import Sequence

from app.exports.writers.records import Pixels, PoseRecord

Point = list[float]
WHOLE, PARTIAL, BOX = "whole", "partial", "box"


def silhouette(pose: PoseRecord) -> tuple[list[float], str]:
    """Return u1, v1, u2, v2, ... of a pose's outline within the photograph, and what it is.

    `whole`: of all eight corners. `partial`: some lie behind the camera. `box`: too few are left,
    so it is the detection's rectangle.
    """
    corners = pose.corners_in_image_px
    points = [corner for corner in corners if corner is not None]
    outline = convex_hull(points) if len(points) > 2 else []
    width, height = pose.image.width_px, pose.image.height_px
    for u, v in outline:
        if not (0 <= u <= width and 0 <= v <= height):
            outline = clipped(outline, width, height)
            break
    if len(outline) < 3:
        x1, y1, x2, y2 = pose.box_px
        return [x1, y1, x2, y1, x2, y2, x1, y2], BOX
    kind = WHOLE if len(points) == len(corners) else PARTIAL
    return [value for point in outline for value in point], kind


def convex_hull(points: Sequence[Point]) -> list[Point]:
    """Return the corners of the convex hull in order (A. M. Andrew's monotone chain, 1979)."""
    ordered = sorted(points)
    lower = _chain(ordered)
    ordered.reverse()
    return lower[:-1] + _chain(ordered)[:-1]


def _chain(ordered: Sequence[Point]) -> list[Point]:
    chain: list[Point] = []
    for point in ordered:
        u, v = point
        while len(chain) > 1:
            (u1, v1), (u2, v2) = chain[-2], chain[-1]
            if (u2 - u1) * (v - v1) > (v2 - v1) * (u - u1):
                break
            chain.pop()
        chain.append(point)
    return chain


def clipped(outline: Sequence[Point], width: float, height: float) -> list[Point]:
    """Return what of a convex outline lies within a photograph (Sutherland and Hodgman, 1974)."""
    points: list[Point] = list(outline)
    for axis, sign, limit in ((0, 1, 0.0), (0, -1, -width), (1, 1, 0.0), (1, -1, -height)):
        kept: list[Point] = []
        for index, point in enumerate(points):
            before = points[index - 1]
            d, d_before = sign * point[axis] - limit, sign * before[axis] - limit
            if (d < 0) != (d_before < 0):
                t = d_before / (d_before - d)
                kept.append([b + t * (p - b) for b, p in zip(before, point, strict=True)])
            if d >= 0:
                kept.append(point)
        points = kept
    return points


def enclosing_box(corners: Pixels) -> tuple[float, float, float, float] | None:
    """Return x1, y1, x2, y2 around projected corners; None where no corner has a projection."""
    points = [corner for corner in corners if corner is not None]
    if not points:
        return None
    us, vs = zip(*points, strict=True)
    return min(us), min(vs), max(us), max(vs)


def visible_fraction(corners: Pixels, width: float, height: float) -> float:
    """Return how much of the box around projected corners lies in the photograph, 0 to 1.

    A corner behind the camera makes it 0: nobody can say how much there is.
    """
    box = enclosing_box(corners)
    if box is None or any(corner is None for corner in corners):
        return 0.0
    x1, y1, x2, y2 = box
    whole = (x2 - x1) * (y2 - y1)
    seen = max(0.0, min(x2, width) - max(x1, 0.0)) * max(0.0, min(y2, height) - max(y1, 0.0))
    return seen / whole if whole > 0 else 0.0
