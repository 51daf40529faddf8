"""Which pixels a face covers, and which face is nearest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.camera import Camera, Intrinsics
from app.simulation.mesh import Mesh, MeshBuilder, rgb
from app.simulation.raster import Window, rasterise, window_of

_K = np.array([[300.0, 0.0, 60.0], [0.0, 310.0, 40.0], [0.0, 0.0, 1.0]])
CAMERA = Camera(Intrinsics(120, 90, _K, np.array([-0.05, 0.02, 1e-4, -1e-4, 0.0])), np.eye(3),
                np.zeros(3))  # fmt: skip


def _triangle(corners: list[tuple[float, float, float]]) -> Mesh:
    builder = MeshBuilder()
    builder.face(corners, rgb(200, 0, 0), both_sides=True)
    return builder.build()


def _inside(points: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Barycentric test, another way than half planes by row."""
    a, b, c = triangle
    basis = np.column_stack([b - a, c - a])
    weights = np.linalg.solve(basis, (points - a).T)
    return np.asarray((weights >= -1e-9).all(axis=0) & (weights.sum(axis=0) <= 1 + 1e-9))


_COORDINATE = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(8, 20))


@given(st.tuples(_COORDINATE, _COORDINATE, _COORDINATE), st.sampled_from([1, 2]))
def test_a_sample_is_covered_exactly_when_its_centre_lies_inside(
    corners: tuple[tuple[float, float, float], ...], per_px: int
) -> None:
    """Coverage equals a point-in-triangle test of every sample, so silhouettes are not fattened."""
    pixels = CAMERA.project(np.array(corners))
    (ax, ay), (bx, by), (cx, cy) = pixels
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if not np.isfinite(pixels).all() or abs(area) < 2.0:
        return
    window = Window(-20, -10, 100 * per_px, 80 * per_px, per_px)
    raster = rasterise(CAMERA, _triangle(list(corners)), window)
    columns, rows = np.meshgrid(
        np.arange(window.width) + window.left, np.arange(window.height) + window.top
    )
    centres = np.column_stack([columns.ravel(), rows.ravel()]) + 0.5
    expected = _inside(centres / per_px - 0.5, pixels).reshape(raster.mask.shape)
    # Centres that lie on an edge to within rounding may fall either way.
    grown = _inside(centres / per_px - 0.5, pixels + (pixels - pixels.mean(axis=0)) * 1e-7)
    shrunk = _inside(centres / per_px - 0.5, pixels - (pixels - pixels.mean(axis=0)) * 1e-7)
    certain = (grown == shrunk).reshape(raster.mask.shape)
    assert np.array_equal(raster.mask[certain], expected[certain])


def test_the_nearer_face_wins_and_its_depth_is_kept() -> None:
    """Of two squares in line the nearer one shows, at the inverse of its distance."""
    builder = MeshBuilder()
    for z, size in ((20.0, 4.0), (10.0, 1.0)):
        square = [(-size, size, z), (size, size, z), (size, -size, z), (-size, -size, z)]
        builder.face(square, rgb(0, 0, 0), both_sides=True)
    raster = rasterise(CAMERA, builder.build(), Window(0, 0, 120, 90, 1))
    assert raster.inverse_depth[40, 60] == pytest.approx(1 / 10)
    assert raster.inverse_depth[40, 5] == pytest.approx(1 / 20)
    assert raster.face[40, 60] // 2 == 1
    assert raster.face[40, 5] // 2 == 0


def test_faces_behind_the_camera_are_left_out() -> None:
    """A face behind the camera covers nothing and has no window."""
    mesh = _triangle([(0, 0, -5), (1, 0, -5), (0, 1, -5)])
    assert not rasterise(CAMERA, mesh, Window(0, 0, 120, 90, 1)).mask.any()
    assert window_of(CAMERA, mesh, 1, Window(0, 0, 120, 90, 1)).width == 0


def test_a_window_is_clipped_and_found_again() -> None:
    """Slices of a clipped window address the same samples in both buffers."""
    outer, inner = Window(0, 0, 10, 8, 1), Window(-3, 5, 6, 9, 1)
    both = inner.clipped(outer)
    assert (both.left, both.top, both.width, both.height) == (0, 5, 3, 3)
    assert both.slices == (slice(5, 8), slice(0, 3))
    assert both.within(inner) == (slice(0, 3), slice(3, 6))
