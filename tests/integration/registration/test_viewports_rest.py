"""Viewports and their keypoints over REST: one pointing at a time, landmarks shared by a site."""

from collections.abc import Callable
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database
from app.tables.identity import Role
from app.tables.sites import Camera
from tests.factories.sites import make_camera, make_site
from tests.integration.conftest import MakeUser
from tests.integration.registration.conftest import Scene


@pytest.fixture
def camera(database: Database) -> Camera:
    """Give a camera in Europe/Berlin."""
    with database.writing() as session:
        return make_camera(session, make_site(session))


def test_a_viewport_is_made_read_listed_and_changed(client: TestClient, camera: Camera) -> None:
    """Times without a zone are the camera's; null in an edit opens the range again."""
    made = client.post(
        "/api/v1/viewports",
        json={"camera_id": camera.id, "name": "East", "valid_from": "2026-07-01T12:00:00"},
    )
    assert made.status_code == 201
    viewport = made.json()
    assert viewport["valid_from"] == "2026-07-01T10:00:00Z"
    assert (viewport["keypoint_count"], viewport["registration_id"]) == (0, None)
    assert client.get(made.headers["location"]).json() == viewport
    listed = client.get("/api/v1/viewports", params={"camera_id": camera.id}).json()
    assert listed["items"] == [viewport]
    version = {"If-Match": made.headers["etag"]}
    opened = client.patch(made.headers["location"], json={"valid_from": None}, headers=version)
    assert opened.json()["valid_from"] is None
    stale = client.patch(made.headers["location"], json={"name": "West"}, headers=version)
    assert stale.status_code == 412
    assert client.patch(made.headers["location"], json={"name": "West"}).status_code == 428


@pytest.mark.parametrize(
    ("times", "status"),
    [
        ({}, 409),
        ({"valid_from": "2026-03-01T00:00:00Z"}, 409),
        ({"valid_until": "2026-02-02T00:00:00Z"}, 409),
        ({"valid_from": "2026-02-01T01:00:00Z", "valid_until": "2026-02-01T02:00:00Z"}, 409),
        ({"valid_from": "2026-04-01T00:00:00Z"}, 201),
        ({"valid_until": "2026-02-01T00:00:00Z"}, 201),
        ({"valid_from": "2026-05-01T00:00:00Z", "valid_until": "2026-05-01T00:00:00Z"}, 422),
    ],
)
def test_viewports_of_a_camera_do_not_overlap(
    client: TestClient, camera: Camera, times: dict[str, str], status: int
) -> None:
    """A range that meets another's gives 409 naming it; touching ranges are fine."""
    body = {"camera_id": camera.id, "name": "Spring"}
    spring = {"valid_from": "2026-02-01T00:00:00Z", "valid_until": "2026-04-01T00:00:00Z"}
    assert client.post("/api/v1/viewports", json=body | spring).status_code == 201
    answer = client.post("/api/v1/viewports", json=body | {"name": "Other"} | times)
    assert answer.status_code == status
    if status == 409:
        assert "'Spring'" in answer.json()["detail"]


def test_keypoints_are_replaced_all_at_once(client: TestClient, scene: Scene) -> None:
    """The first set needs no If-Match, the next does; what was read can be sent back."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    first = client.put(path, json={"keypoints": scene.keypoints})
    assert first.status_code == 200
    stored = first.json()["items"]
    assert [point["name"] for point in stored] == [point["name"] for point in scene.keypoints]
    assert stored[0]["role"] == "control"
    assert client.put(path, json={"keypoints": []}).status_code == 428
    read = client.get(path)
    assert read.json() == first.json()
    version = {"If-Match": read.headers["etag"]}
    again = client.put(path, json=read.json()["items"][:10], headers=version)
    assert again.json()["items"] == stored[:10]
    assert client.put(path, json=read.json(), headers=version).status_code == 412
    viewport = client.get(f"/api/v1/viewports/{scene.viewport.id}").json()
    assert viewport["keypoint_count"] == 10


def test_a_landmark_is_the_same_in_every_viewport(client: TestClient, scene: Scene) -> None:
    """A known name at another place gives 422 naming it, unless moving it is asked for."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    first = client.put(path, json=scene.keypoints)
    version = {"If-Match": first.headers["etag"]}
    moved = scene.keypoints[0] | {"height_m": scene.keypoints[0]["height_m"] + 1}
    refused = client.put(path, json=[moved], headers=version)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "keypoints.0"
    assert "'Landmark 1'" in refused.json()["detail"]
    assert len(client.get(path).json()["items"]) == 14
    done = client.put(path, json={"keypoints": [moved], "update_landmarks": True}, headers=version)
    assert done.json()["items"][0]["height_m"] == moved["height_m"]
    by_name = {"name": "Landmark 1", "u_px": 5, "v_px": 6}
    short = client.put(path, json=[by_name], headers={"If-Match": done.headers["etag"]})
    assert short.json()["items"][0]["landmark_id"] == done.json()["items"][0]["landmark_id"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"u_px": 2560}, "outside the image"),
        ({"name": "Landmark 2"}, "twice"),
        ({"name": None}, "needs the name"),
        ({"lat_deg": None}, "together"),
        ({"lat_deg": None, "lon_deg": None, "height_m": None}, "is new"),
        ({"landmark_id": 999_999_999_999}, "no landmark"),
        ({"role": "judge"}, "control"),
    ],
)
def test_a_wrong_keypoint_is_named_and_nothing_stored(
    client: TestClient, scene: Scene, change: dict[str, Any], says: str
) -> None:
    """The answer points at the keypoint and says what to do; the others are not stored either."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    other = scene.keypoints[1]
    answer = client.put(path, json={"keypoints": [other, scene.keypoints[0] | change]})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"].startswith("keypoints.1")
    assert says in answer.json()["detail"]
    assert client.get(path).json()["items"] == []


def test_a_foreign_viewport_does_not_exist(
    client_of: Callable[..., TestClient], make_user: MakeUser, database: Database, scene: Scene
) -> None:
    """An operator of another site gets 404 for a viewport on every verb and below it."""
    with database.writing() as session:
        own = make_site(session)
    stranger = client_of(make_user(Role.OPERATOR, own.id), *Scope)
    address = f"/api/v1/viewports/{scene.viewport.id}"
    version = {"If-Match": '"1"'}
    answers = [
        stranger.get(address),
        stranger.patch(address, json={}, headers=version),
        stranger.delete(address),
        stranger.get(f"{address}/keypoints"),
        stranger.put(f"{address}/keypoints", json=scene.keypoints),
        stranger.get(f"{address}/registrations"),
        stranger.post(f"{address}/registrations", json={"method": "pnp"}),
        stranger.post(
            "/api/v1/viewports", json={"camera_id": scene.viewport.camera_id, "name": "X"}
        ),
    ]
    assert {answer.status_code for answer in answers} == {404}
    assert stranger.get("/api/v1/viewports").json()["items"] == []
