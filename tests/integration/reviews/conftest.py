"""A run with poses, and people to judge them."""

import pytest

from app.db import Database
from tests.factories.runs import Harbour, make_harbour


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a registered viewport with three images."""
    with database.writing() as session:
        return make_harbour(session, images=3)
