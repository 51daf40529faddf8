"""Shadows fall where the sun's rays are stopped."""

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.simulation.mesh import Mesh, MeshBuilder, rgb
from app.simulation.shadows import SunView, openness

_TOWER_M, _RADIUS_M, _TEXELS = 20.0, 60.0, 512


def tower() -> Mesh:
    """Return a tower of 4 x 4 m on level ground."""
    builder = MeshBuilder()
    builder.box((-2, 2), (-2, 2), (0, _TOWER_M), rgb(200, 200, 200))
    return builder.build()


@given(azimuth_deg=st.floats(0, 360), elevation_deg=st.floats(20, 70), share=st.floats(0.1, 0.85))
def test_a_tower_shades_the_ground_opposite_the_sun(
    azimuth_deg: float, elevation_deg: float, share: float
) -> None:
    """Within height over tangent of the elevation the ground is dark, beyond and beside it lit."""
    a, e = radians(azimuth_deg), radians(elevation_deg)
    to_sun = np.array([sin(a) * cos(e), cos(a) * cos(e), sin(e)])
    sun = SunView.of(tower(), to_sun, np.zeros(3), _RADIUS_M, _TEXELS)
    away = -np.array([sin(a), cos(a), 0.0])
    beside = np.array([away[1], -away[0], 0.0])
    length_m = _TOWER_M / np.tan(e)
    inside, beyond = away * (3.5 + share * (length_m - 3.5)), away * (length_m + 6)
    points = np.array([inside, beyond, inside + 8 * beside, -5 * away])

    assert sun.lit(points) == pytest.approx([0, 1, 1, 1], abs=0.01)


def test_walls_in_the_sun_do_not_shade_themselves() -> None:
    """A lit face stays lit although it lies exactly at the depth the sun sees."""
    to_sun = np.array([0.0, -0.8, 0.6])
    sun = SunView.of(tower(), to_sun, np.zeros(3), _RADIUS_M, _TEXELS)
    x, z = np.meshgrid(np.linspace(-1.5, 1.5, 7), np.linspace(1, 19, 9))
    wall = np.column_stack([x.ravel(), np.full(x.size, -2.0), z.ravel()])

    assert sun.lit(wall).min() == 1


def test_only_hollows_are_dark() -> None:
    """A level plane is open everywhere; a notch in it is not; what is far behind is open again."""
    depth = np.full((60, 60), 100.0)
    depth[28:32, :] = 101.5
    depth[:10] = 400.0
    found = openness(1 / depth, np.ones(depth.shape, dtype=bool), 3, 1.6)

    assert found[45] == pytest.approx(1, abs=1e-3)
    assert found[30, 5:-5].max() < 0.85
    assert found[8] == pytest.approx(1, abs=1e-3)
