"""The land's mirror image lies on the water below what it shows."""

from datetime import UTC, datetime

import numpy as np
import pytest

from app.domain.geodesy import Geodetic
from app.simulation.light import WEATHERS, Light, light_at
from app.simulation.mesh import MeshBuilder, rgb
from app.simulation.mirror import mirror_of_land
from app.simulation.raster import Window
from app.simulation.sightlines import sight_lines
from app.simulation.viewports import looking, make_intrinsics


@pytest.fixture(scope="module")
def light() -> Light:
    """Return fair weather at noon."""
    fair = next(weather for weather in WEATHERS if weather.name == "fair")
    return light_at(Geodetic(53.5, 9.9, 0.0), datetime(2026, 5, 12, 11, tzinfo=UTC), fair)


def test_a_pile_is_mirrored_below_its_waterline_and_nowhere_else(light: Light) -> None:
    """The image hangs in the pile's columns; what of it is under water is not turned up."""
    builder = MeshBuilder()
    builder.box((-4, 4), (246, 254), (-30, 12), rgb(90, 60, 40))
    camera = looking(
        make_intrinsics(np.random.default_rng(1), 320, 240), np.array([0, 0, 28.0]), 0.0, 9.0, 0.0
    )
    sight = sight_lines(camera, Window(0, 0, 320, 240, 1))
    colour, cover = mirror_of_land(camera, builder.build(), light, 0.0, sight)
    left, right = camera.project(np.array([(-4, 246, 0), (4, 246, 0)]))[:, 0]
    waterline = float(camera.project(np.array([(0, 246, 0)]))[0, 1])
    strongest = np.unravel_index(int(cover.argmax()), cover.shape)

    assert waterline - 3 < strongest[0] < waterline + 40
    assert left - 1 <= strongest[1] <= right + 1
    assert cover[: int(waterline) - 30].max() == pytest.approx(0, abs=0.02)
    assert cover[:, : int(left) - 12].max() == pytest.approx(0, abs=1e-6)
    assert (colour[cover < 1e-6] == 0).all()
