"""The sun where the almanac has it."""

from datetime import UTC, datetime

import numpy as np
import pytest

from app.domain.geodesy import Geodetic
from app.simulation.light import WEATHERS, light_at, sun_position

GREENWICH = Geodetic(51.4779, 0.0, 0.0)


@pytest.mark.parametrize(
    ("moment", "azimuth_deg", "elevation_deg"),
    [
        # Culmination: 90 - latitude + declination at the solstices and an equinox.
        (datetime(2026, 6, 21, 12, 2, tzinfo=UTC), 180.0, 61.96),
        (datetime(2026, 12, 21, 11, 58, tzinfo=UTC), 180.0, 15.08),
        (datetime(2026, 3, 20, 12, 7, tzinfo=UTC), 180.0, 38.46),
    ],
)
def test_the_sun_culminates_in_the_south(
    moment: datetime, azimuth_deg: float, elevation_deg: float
) -> None:
    """At noon it stands south, as high as latitude and season make it."""
    azimuth, elevation = sun_position(GREENWICH, moment)
    assert azimuth == pytest.approx(azimuth_deg, abs=1.0)
    assert elevation == pytest.approx(elevation_deg, abs=0.3)


def test_mornings_are_east_and_evenings_west() -> None:
    """The sun goes round with the clock."""
    morning, _ = sun_position(GREENWICH, datetime(2026, 5, 12, 6, tzinfo=UTC))
    evening, _ = sun_position(GREENWICH, datetime(2026, 5, 12, 18, tzinfo=UTC))
    assert 60 < morning < 110
    assert 250 < evening < 300


@pytest.mark.parametrize("weather", WEATHERS, ids=lambda w: w.name)
def test_faces_towards_the_sun_are_brighter(weather: object) -> None:
    """Under every sky the sunny side is at least as bright as the shady one."""
    chosen = next(w for w in WEATHERS if w is weather)
    light = light_at(GREENWICH, datetime(2026, 5, 12, 9, tzinfo=UTC), chosen)
    level = light.to_sun_in_enu * (1, 1, 0)
    level /= np.linalg.norm(level)
    sunny, shady = light.on(np.array([level, -level]), np.full((2, 3), 0.5, dtype=np.float32))
    assert (sunny >= shady).all()
