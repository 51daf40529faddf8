"""A camera to import for, and a client that sends folders as the page does."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pytest
from httpx2 import Response
from starlette.testclient import TestClient

from app.db import Database
from app.tables.sites import Camera
from tests.factories.sites import make_camera, make_site

API = "/api/v1/imports"


@pytest.fixture
def camera(database: Database) -> Camera:
    """Give a camera of 64 x 48 px whose clock shows Berlin's time."""
    with database.writing() as session:
        return make_camera(session, make_site(session), name="Quay", timezone="Europe/Berlin")


@dataclass(frozen=True)
class Sender:
    """Sends files of a batch, one step at a time."""

    client: TestClient
    address: str

    def announce(self, files: Mapping[str, bytes], *, hashed: bool = False) -> list[dict[str, Any]]:
        """Announce files; returns them as the server has them."""
        manifest = [
            {"path": path, "size_bytes": len(data)}
            | ({"sha256": hashlib.sha256(data).hexdigest()} if hashed else {})
            for path, data in files.items()
        ]
        answer = self.client.post(f"{self.address}/files", json={"files": manifest})
        assert answer.status_code == 200, answer.text
        listed: list[dict[str, Any]] = answer.json()["files"]
        return listed

    def send(self, files: Mapping[str, bytes]) -> list[dict[str, Any]]:
        """Announce files and send what is wanted of them in one pack; returns what was sent."""
        announced = self.announce(files)
        wanted = [
            (file, data)
            for file, data in zip(announced, files.values(), strict=True)
            if file["state"] == "waiting"
        ]
        if not wanted:
            return []
        ids = ",".join(str(file["id"]) for file, _ in wanted)
        body = b"".join(data for _, data in wanted)
        answer = self.client.post(f"{self.address}/pack", params={"files": ids}, content=body)
        assert answer.status_code == 200, answer.text
        sent: list[dict[str, Any]] = answer.json()["files"]
        return sent

    def piece(self, file_id: int, data: bytes, offset: int = 0) -> Response:
        """Send a piece of a file."""
        address = f"{self.address}/files/{file_id}"
        return self.client.put(address, params={"offset": offset}, content=data)

    def preview(self) -> dict[str, Any]:
        """Return what a commit would do."""
        made: dict[str, Any] = self.client.get(f"{self.address}/preview").json()
        return made

    def odd(self) -> dict[str, int]:
        """Return how often what is odd."""
        return {odd["kind"]: odd["count"] for odd in self.preview()["odd"]}

    def act(self, act: str, **body: object) -> Response:
        """Commit, undo, restore or move."""
        return self.client.post(f"{self.address}/{act}", json=body or None)


@pytest.fixture
def sender(client: TestClient, camera: Camera) -> Sender:
    """Give a sender to a new batch."""
    return begin(client, camera)


def begin(client: TestClient, camera: Camera) -> Sender:
    """Begin a batch for a camera."""
    answer = client.post(API, json={"camera_id": camera.id, "name": "Card"})
    assert answer.status_code == 201, answer.text
    return Sender(client, answer.headers["location"])
