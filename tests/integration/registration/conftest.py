"""A viewport whose camera is known exactly, with the landmarks it sees."""

import pytest

from app.db import Database
from tests.factories.scene import Scene, make_scene

__all__ = ["Scene", "scene"]


@pytest.fixture
def scene(database: Database) -> Scene:
    """Store a camera 30 m above the water that looks north-west over fourteen landmarks."""
    with database.writing() as session:
        return make_scene(session)
