"""From faces to pixels: an exact depth buffer in NumPy.

A pixel belongs to a face when its centre lies inside the projected outline: nothing is fattened,
so boxes measured from the pixels are the truth and not a drawing routine's habit. All faces are
filled at once: each face's rows are found, each row's span between the face's edges, and all spans
are spread to pixels together; the nearest face wins. The inverse depth of a plane is affine in
pinhole pixels; lens distortion bends that a little, so large faces are to be cut up beforehand.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array, FloatArray
from app.domain.camera import Camera
from app.simulation.mesh import IntArray, Mesh

NO_FACE = -1
_FACES_AT_ONCE = 1000  # keeps a viewport of the land within some 100 MB


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of samples: `samples_per_px` along each axis, first sample at (`left`, `top`).

    Sample (i, j) lies at pixel coordinate `(i + 0.5) / samples_per_px - 0.5`, as pixel (0, 0) is
    the centre of the first pixel.
    """

    left: int
    top: int
    width: int
    height: int
    samples_per_px: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Row and column slices of this window in a buffer that starts at sample (0, 0)."""
        return (
            slice(self.top, self.top + self.height),
            slice(self.left, self.left + self.width),
        )

    def clipped(self, other: "Window") -> "Window":
        """Return the part common with `other`, perhaps empty."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        right = min(self.left + self.width, other.left + other.width)
        bottom = min(self.top + self.height, other.top + other.height)
        return Window(left, top, max(0, right - left), max(0, bottom - top), self.samples_per_px)

    def within(self, outer: "Window") -> tuple[slice, slice]:
        """Row and column slices of this window in a buffer that covers `outer`."""
        row, column = self.top - outer.top, self.left - outer.left
        return slice(row, row + self.height), slice(column, column + self.width)


@dataclass(frozen=True, eq=False)
class Raster:
    """The nearest face at each sample of a window.

    `face` (height, width) is `NO_FACE` where there is none; `inverse_depth` (height, width), 1/m
    along the optical axis, is 0 there.
    """

    window: Window
    face: npt.NDArray[np.int32]
    inverse_depth: Float32Array

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Where any face is."""
        covered: npt.NDArray[np.bool_] = self.face != NO_FACE
        return covered


@dataclass(frozen=True, eq=False)
class _Outlines:
    """Faces turned to the camera: edges a x + b y + c >= 0 inside, and the plane of 1/depth."""

    index: IntArray
    edges: FloatArray  # (m, 4, 3)
    plane: FloatArray  # (m, 3)
    first_row: IntArray
    last_row: IntArray

    def part(self, start: int, end: int) -> "_Outlines":
        return _Outlines(
            self.index[start:end],
            self.edges[start:end],
            self.plane[start:end],
            self.first_row[start:end],
            self.last_row[start:end],
        )


def window_of(camera: Camera, mesh: Mesh, samples_per_px: int, limit: Window) -> Window:
    """Return the samples that a mesh can cover, within `limit`."""
    pixels = camera.project(mesh.vertices)
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    if not len(pixels):
        return Window(limit.left, limit.top, 0, 0, samples_per_px)
    samples = (pixels + 0.5) * samples_per_px
    low = np.floor(samples.min(axis=0)).astype(int) - 1
    high = np.ceil(samples.max(axis=0)).astype(int) + 1
    span = high - low
    return Window(int(low[0]), int(low[1]), int(span[0]), int(span[1]), samples_per_px).clipped(
        limit
    )


def rasterise(camera: Camera, mesh: Mesh, window: Window) -> Raster:
    """Fill a mesh in the camera's world frame into the samples of a window.

    Faces with a corner that the camera cannot show (behind it, or too far aside) are left out.
    """
    face = np.full(window.height * window.width, NO_FACE, dtype=np.int32)
    depth = np.zeros(window.height * window.width, dtype=np.float32)
    outlines = _outlines(camera, mesh, window)
    for start in range(0, len(outlines.index), _FACES_AT_ONCE):
        some = outlines.part(start, start + _FACES_AT_ONCE)
        which, position, inverse = _fragments(some, window)
        np.maximum.at(depth, position, inverse)
        nearest = inverse == depth[position]
        face[position[nearest]] = some.index[which[nearest]]
    shape = (window.height, window.width)
    return Raster(window, face.reshape(shape), depth.reshape(shape))


def _outlines(camera: Camera, mesh: Mesh, window: Window) -> _Outlines:
    """Project the faces, drop those turned away or outside, and prepare their edges."""
    samples = (camera.project(mesh.vertices) + 0.5) * window.samples_per_px - 0.5
    samples -= (window.left, window.top)
    in_cam = camera.to_cam(mesh.vertices)
    with np.errstate(divide="ignore"):
        inverse = np.where(in_cam[:, 2] > 0.1, 1.0 / in_cam[:, 2], np.nan)
    corners = np.column_stack([samples, inverse])[mesh.faces]  # (m, 4, 3): u, v, 1/depth
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    # Counter-clockwise from outside is negative here, because image rows run downwards.
    shown = np.isfinite(corners).all(axis=(1, 2)) & (normal[:, 2] < -1e-9)
    shown &= (high >= 0).all(axis=1) & (low <= (window.width - 1, window.height - 1)).all(axis=1)
    index = np.flatnonzero(shown)
    corners, normal, low, high = corners[index], normal[index], low[index], high[index]
    slope = -normal[:, :2] / normal[:, 2:]
    middle = corners.mean(axis=1)
    offset = middle[:, 2] - (slope * middle[:, :2]).sum(axis=1)
    start, end = corners[:, :, :2], np.roll(corners[:, :, :2], -1, axis=1)
    a, b = end[..., 1] - start[..., 1], start[..., 0] - end[..., 0]
    c = -(a * start[..., 0] + b * start[..., 1])
    return _Outlines(
        index,
        np.stack([a, b, c], axis=-1),
        np.column_stack([slope, offset]),
        np.clip(np.ceil(low[:, 1]), 0, None).astype(np.int64),
        np.clip(np.floor(high[:, 1]), None, window.height - 1).astype(np.int64),
    )


def _fragments(outlines: _Outlines, window: Window) -> tuple[IntArray, IntArray, Float32Array]:
    """Return face, position in the flat window and inverse depth of every covered sample."""
    which, row = _spread(outlines.first_row, outlines.last_row)
    edges = outlines.edges[which]  # (p, 4, 3)
    a, rest = edges[..., 0], edges[..., 1] * row[:, None] + edges[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / a
    left = np.where(a > 0, crossing, -np.inf).max(axis=1)
    right = np.where(a < 0, crossing, np.inf).min(axis=1)
    outside = ((a == 0) & (rest < 0)).any(axis=1)
    first = np.clip(np.ceil(left), 0, window.width).astype(np.int64)
    last = np.clip(np.floor(right), -1, window.width - 1).astype(np.int64)
    last[outside] = -1
    span, column = _spread(first, last)
    row, which = row[span], which[span]
    plane = outlines.plane[which]
    inverse = plane[:, 0] * column + plane[:, 1] * row + plane[:, 2]
    return which, row * window.width + column, inverse.astype(np.float32)


def _spread(first: IntArray, last: IntArray) -> tuple[IntArray, IntArray]:
    """Return every integer of the ranges `first` to `last` inclusive, and its range's number."""
    counts = np.maximum(last - first + 1, 0)
    number = np.repeat(np.arange(len(first)), counts)
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    return number, np.arange(total) - np.repeat(ends - counts, counts) + first[number]
