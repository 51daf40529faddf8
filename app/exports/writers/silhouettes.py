"""Silhouettes: what a projected box covers of its photograph.

The outline of a box is convex, and so is its projection without distortion: the convex hull of the
eight projected corners. Where the photograph ends, the silhouette does.

Many silhouettes are had at once from which way each three corners of a box turn. Where that is no
clear case (corners in a line, outside, behind the camera) each is taken alone.
"""

from collections.abc import Sequence
from itertools import chain, combinations

import numpy as np
import numpy.typing as npt

from app.exports.writers.records import ImageRecord, Pixels

Point = list[float]
Box = tuple[float, float, float, float]
WHOLE, PARTIAL, BOX = "whole", "partial", "box"
CORNERS = 8
AT_ONCE = 256  # as many as stay in a processor's cache
# Twice the area of a triangle that is no line, px^2: far above what rounding makes of one.
CLEAR_TURN_PX2 = 1e-3
_TRIPLES = np.array(list(combinations(range(CORNERS), 3)))


def _turns_of_edges() -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Return for each edge i to j, and each other corner: its triple, whether that is in order."""
    places = {frozenset(triple): place for place, triple in enumerate(_TRIPLES.tolist())}
    edges = [(i, j) for i in range(CORNERS) for j in range(CORNERS) if i != j]
    others = [[k for k in range(CORNERS) if k not in edge] for edge in edges]
    triples = [
        [places[frozenset((*edge, k))] for k in ks] for edge, ks in zip(edges, others, strict=True)
    ]
    even = [
        [((i < j) + (j < k) + (i < k)) % 2 == 1 for k in ks]
        for (i, j), ks in zip(edges, others, strict=True)
    ]
    return np.array(triples), np.array(even)


_TRIPLE_OF, _IN_ORDER = _turns_of_edges()


def silhouettes(
    corners: Sequence[Pixels], images: Sequence[ImageRecord], boxes_px: Sequence[Box]
) -> tuple[list[list[float]], list[str]]:
    """Return the `silhouette` of each pose: the outlines, and what they are."""
    outlines: list[list[float]] = []
    kinds: list[str] = []
    for start in range(0, len(corners), AT_ONCE):
        end = start + AT_ONCE
        some = zip(corners[start:end], images[start:end], boxes_px[start:end], strict=True)
        sure = _sure(corners[start:end], images[start:end])
        for number, of_pose in enumerate(some):
            outline, kind = sure.get(number) or silhouette(*of_pose)
            outlines.append(outline)
            kinds.append(kind)
    return outlines, kinds


def _sure(
    corners: Sequence[Pixels], images: Sequence[ImageRecord]
) -> dict[int, tuple[list[float], str]]:
    """Return by place the silhouettes that are clear cases."""
    whole = [
        number for number, box in enumerate(corners) if len(box) == CORNERS and None not in box
    ]
    flat = chain.from_iterable(corners[number] for number in whole)
    values = chain.from_iterable(filter(None, flat))
    points = np.fromiter(values, np.float64, len(whole) * CORNERS * 2).reshape(-1, CORNERS, 2)
    sizes = np.array(
        [(images[number].width_px, images[number].height_px) for number in whole]
    ).reshape(-1, 1, 2)
    inside = ((points >= 0) & (points <= sizes)).all(axis=(1, 2))
    outlines, lengths, clear = _hulls(points)
    return {
        number: (outline[:length], WHOLE)
        for number, outline, length, is_sure in zip(
            whole, outlines.tolist(), lengths.tolist(), (inside & clear).tolist(), strict=True
        )
        if is_sure
    }


def _hulls(
    points: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Return hulls of (n, 8, 2) points as (n, 16) u1, v1, ..., their lengths, and which are sure.

    A hull's edge has all other corners on its left; from the corner farthest to the left edge leads
    to edge, in the order of `convex_hull`.
    """
    u, v = points[:, :, 0].T, points[:, :, 1].T
    i, j, k = _TRIPLES.T
    turns = (u[j] - u[i]) * (v[k] - v[i]) - (v[j] - v[i]) * (u[k] - u[i])
    edges = ((turns > 0)[_TRIPLE_OF] == _IN_ORDER[:, :, None]).all(axis=1)
    from_each = edges.reshape(CORNERS, CORNERS - 1, -1)
    after = from_each.argmax(axis=1)
    after += after >= np.arange(CORNERS)[:, None]
    rows = np.arange(len(points))
    leftmost = np.where(u == u.min(axis=0, initial=np.inf), v, np.inf)
    order = [leftmost.argmin(axis=0)]
    for _ in range(CORNERS - 1):
        order.append(after[order[-1], rows])
    outlines = points[rows[:, None], np.stack(order, axis=1)].reshape(-1, CORNERS * 2)
    clear = (np.abs(turns) > CLEAR_TURN_PX2).all(axis=0)
    return outlines, from_each.any(axis=1).sum(axis=0) * 2, clear


def silhouette(corners: Pixels, image: ImageRecord, box_px: Box) -> tuple[list[float], str]:
    """Return u1, v1, u2, v2, ... of a pose's outline within the photograph, and what it is.

    `whole`: of all eight corners. `partial`: some lie behind the camera. `box`: too few are left,
    so it is the detection's rectangle.
    """
    points = [corner for corner in corners if corner is not None]
    outline = convex_hull(points) if len(points) > 2 else []
    width, height = image.width_px, image.height_px
    for u, v in outline:
        if not (0 <= u <= width and 0 <= v <= height):
            outline = clipped(outline, width, height)
            break
    if len(outline) < 3:
        x1, y1, x2, y2 = box_px
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
