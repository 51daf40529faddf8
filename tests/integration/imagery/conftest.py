"""A camera to upload to, and the upload itself."""

from collections.abc import Callable
from typing import Protocol

import pytest
from httpx2 import Response
from starlette.testclient import TestClient

from app.db import Database
from app.tables.sites import Camera
from tests.factories.sites import make_camera, make_site


class Upload(Protocol):
    """Uploads bytes as a photograph."""

    def __call__(
        self, data: bytes, name: str = "photo.jpg", media_type: str = "image/jpeg", **form: object
    ) -> Response:
        """Return the answer."""


@pytest.fixture
def camera(database: Database) -> Camera:
    """Give a camera of 64 x 48 px in Europe/Berlin."""
    with database.writing() as session:
        return make_camera(
            session, make_site(session), name="Quay", file_name_pattern="quay_%d-%m-%Y_%H.%M.%S"
        )


@pytest.fixture
def upload(client: TestClient, camera: Camera) -> Upload:
    """Give the upload to that camera, with a time unless the test gives one or None."""
    return uploader(client, camera)


def uploader(client: TestClient, camera: Camera) -> Callable[..., Response]:
    """Return an upload as a client, to a camera."""

    def send(
        data: bytes, name: str = "photo.jpg", media_type: str = "image/jpeg", **form: object
    ) -> Response:
        fields = {"camera_id": camera.id, "captured_at": "2026-11-22T10:00:05Z"} | form
        return client.post(
            "/api/v1/images",
            files={"file": (name, data, media_type)},
            data={key: value for key, value in fields.items() if value is not None},
        )

    return send
