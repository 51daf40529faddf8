"""Solid things as flat four-cornered faces.

Everything the harbour is built from (hulls, houses, cranes, trees) is a mesh of planar convex
faces with one colour each. Four corners suit ships and buildings; a triangle repeats its last
corner. Faces are listed counter-clockwise as seen from outside, so those turned away from the
camera can be left out. Colours are linear light, blue first as OpenCV has its images.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import cos, pi, sin
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array, FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]
# Light and shade need no more than float32 and do not mind float64.
Shade: TypeAlias = npt.NDArray[np.floating[Any]]
Colour: TypeAlias = tuple[float, float, float]


class Surface(IntEnum):
    """What a face is made of: it decides the texture that is drawn on it."""

    PAINT = 0
    GLASS = 1
    MASONRY = 2  # a wall with rows of windows
    SHEETING = 3  # corrugated walls of sheds
    FOLIAGE = 4
    GROUND = 5
    SHEET_PILES = 6  # a quay wall with fenders and tide marks


def rgb(red: int, green: int, blue: int) -> Colour:
    """Linear colour, blue first, of the screen colour with parts 0 to 255 (gamma 2)."""
    return ((blue / 255) ** 2, (green / 255) ** 2, (red / 255) ** 2)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Faces in a metric frame.

    `vertices` (n, 3) metres; `faces` (m, 4) indices; `colours` (m, 3) linear, blue first;
    `surfaces` (m,) values of `Surface`.
    """

    vertices: FloatArray
    faces: IntArray
    colours: Float32Array
    surfaces: npt.NDArray[np.uint8]

    def moved(self, rotation: npt.ArrayLike, translation: npt.ArrayLike) -> "Mesh":
        """Return the mesh in another frame: `rotation` (3, 3) @ vertex + `translation` (3,)."""
        moved = self.vertices @ np.asarray(rotation, dtype=np.float64).T
        return Mesh(
            moved + np.asarray(translation, dtype=np.float64),
            self.faces,
            self.colours,
            self.surfaces,
        )

    def normals(self) -> FloatArray:
        """Outward unit normals (m, 3); zero for a face without area."""
        corner = self.vertices[self.faces]
        normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        unit: FloatArray = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
        return unit

    @staticmethod
    def joined(meshes: Sequence["Mesh"]) -> "Mesh":
        """All faces of several meshes of one frame."""
        starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
        return Mesh(
            np.concatenate([mesh.vertices for mesh in meshes]),
            np.concatenate(
                [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
            ),
            np.concatenate([mesh.colours for mesh in meshes]),
            np.concatenate([mesh.surfaces for mesh in meshes]),
        )


class MeshBuilder:
    """Collects faces, shape by shape."""

    def __init__(self) -> None:
        self._corners: list[FloatArray] = []
        self._colours: list[Colour] = []
        self._surfaces: list[int] = []

    def build(self) -> Mesh:
        """Return what was collected so far; raises ValueError when that is nothing."""
        if not self._corners:
            raise ValueError("a mesh needs at least one face")
        vertices = np.concatenate(self._corners)
        return Mesh(
            vertices,
            np.arange(len(vertices), dtype=np.int64).reshape(-1, 4),
            np.array(self._colours, dtype=np.float32),
            np.array(self._surfaces, dtype=np.uint8),
        )

    def face(
        self,
        corners: npt.ArrayLike,
        colour: Colour,
        surface: Surface = Surface.PAINT,
        *,
        both_sides: bool = False,
    ) -> None:
        """Add one planar face of three or four corners (n, 3), counter-clockwise from outside."""
        points = np.asarray(corners, dtype=np.float64)
        if len(points) == 3:
            points = np.vstack([points, points[2:]])
        self._corners.append(points)
        self._colours.append(colour)
        self._surfaces.append(int(surface))
        if both_sides:
            self.face(points[::-1], colour, surface)

    def prism(
        self,
        outline: npt.ArrayLike,
        bottom_m: float,
        top_m: float,
        colour: Colour,
        *,
        roof: Colour | None = None,
        surface: Surface = Surface.PAINT,
        inset: float = 1.0,
    ) -> None:
        """Add upright walls over a convex counter-clockwise outline (n, 2), with a roof.

        `inset` shrinks the top about its middle (1 keeps it): tapered towers, raked wheelhouses.
        """
        base = np.asarray(outline, dtype=np.float64)
        middle = base.mean(axis=0)
        low = np.column_stack([base, np.full(len(base), bottom_m)])
        high = np.column_stack([middle + (base - middle) * inset, np.full(len(base), top_m)])
        following = np.roll(np.arange(len(base)), -1)
        for i, j in enumerate(following):
            self.face([low[i], low[j], high[j], high[i]], colour, surface)
        self.cap(high, roof or colour)

    def cap(self, ring: FloatArray, colour: Colour, surface: Surface = Surface.PAINT) -> None:
        """Close a convex planar ring (n, 3), counter-clockwise from outside."""
        for i in range(1, len(ring) - 1, 2):
            last = ring[i + 2] if i + 2 < len(ring) else ring[i + 1]
            self.face([ring[0], ring[i], ring[i + 1], last], colour, surface)

    def box(
        self,
        x_m: tuple[float, float],
        y_m: tuple[float, float],
        z_m: tuple[float, float],
        colour: Colour,
        *,
        roof: Colour | None = None,
        surface: Surface = Surface.PAINT,
    ) -> None:
        """Add an axis-parallel box without its floor."""
        outline = [(x_m[0], y_m[0]), (x_m[1], y_m[0]), (x_m[1], y_m[1]), (x_m[0], y_m[1])]
        self.prism(outline, *z_m, colour, roof=roof, surface=surface)

    def cylinder(
        self,
        centre: tuple[float, float],
        radius_m: float,
        z_m: tuple[float, float],
        colour: Colour,
        *,
        sides: int = 14,
        taper: float = 1.0,
        roof: Colour | None = None,
    ) -> None:
        """Add an upright cylinder, or a cone for `taper` below 1."""
        turn = [2 * pi * i / sides for i in range(sides)]
        outline = [(centre[0] + radius_m * cos(a), centre[1] + radius_m * sin(a)) for a in turn]
        self.prism(outline, *z_m, colour, roof=roof, inset=taper)

    def beam(
        self, start: npt.ArrayLike, end: npt.ArrayLike, thickness_m: float, colour: Colour
    ) -> None:
        """Add a straight beam of square section between two points."""
        a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        along = (b - a) / np.linalg.norm(b - a)
        helper = np.array([1.0, 0.0, 0.0]) if abs(along[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
        side = np.cross(along, helper)
        side *= thickness_m / 2 / np.linalg.norm(side)
        lift = np.cross(along, side)
        ring = [side + lift, -side + lift, -side - lift, side - lift]
        for i in range(4):
            p, q = ring[i], ring[(i + 1) % 4]
            self.face([a + p, b + p, b + q, a + q], colour)
        self.face([b + r for r in ring[::-1]], colour)

    def strip(
        self,
        lower: FloatArray,
        upper: FloatArray,
        colour: Colour,
        surface: Surface = Surface.PAINT,
    ) -> None:
        """Add the wall between two lines (n, 3) that run to the right as seen from outside."""
        for i in range(len(lower) - 1):
            self.face([lower[i], lower[i + 1], upper[i + 1], upper[i]], colour, surface)
