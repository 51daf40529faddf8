"""One small harbour, made once: its backdrops take a second or two."""

import pytest

from app.simulation.harbour import Harbour, make_harbour
from app.simulation.settings import HarbourSettings


@pytest.fixture(scope="session")
def harbour() -> Harbour:
    """Eighteen images of 320x240 in three sessions and two viewports."""
    return make_harbour(7, image_count=18, width_px=320, height_px=240)


@pytest.fixture(scope="session")
def perfect_harbour() -> Harbour:
    """Return the same without any error."""
    return make_harbour(
        7, image_count=18, width_px=320, height_px=240, settings=HarbourSettings.perfect()
    )
