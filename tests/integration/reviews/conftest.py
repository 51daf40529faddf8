"""A run with poses, and people to judge them."""

from collections.abc import Callable
from typing import Protocol

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import User
from app.tables.runs import Pose
from tests.factories.runs import Harbour, make_harbour, make_run


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a registered viewport with three images."""
    with database.writing() as session:
        return make_harbour(session, images=3)


class MakePoses(Protocol):
    """Stores a run; returns its id and those of its poses in order."""

    def __call__(self, *poses_per_image: int) -> tuple[int, list[int]]:
        """Put so many poses into each image of the harbour."""


@pytest.fixture
def run_with(database: Database, harbour: Harbour) -> MakePoses:
    """Give the maker of runs with poses."""

    def make(*poses_per_image: int) -> tuple[int, list[int]]:
        with database.writing() as session:
            run = make_run(session, harbour, poses_per_image)
            ids = session.scalars(sa.select(Pose.id).where(Pose.run_id == run.id).order_by(Pose.id))
            return run.id, list(ids)

    return make


@pytest.fixture
def ada(client_of: Callable[..., TestClient], make_user: Callable[..., User]) -> TestClient:
    """Give a reviewer."""
    return client_of(make_user("reviewer", email="ada@harbour.example"))


@pytest.fixture
def ben(client_of: Callable[..., TestClient], make_user: Callable[..., User]) -> TestClient:
    """Give another reviewer."""
    return client_of(make_user("reviewer", email="ben@harbour.example"))
