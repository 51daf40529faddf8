"""Re-registrations by REST and by page: asked for, listed, accepted, put aside."""

from collections.abc import Callable

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.domain.rotations import matrix_from_rotvec
from app.tables.identity import User
from tests.integration.reregistration.conftest import Turned

API = "/api/v1"


def test_a_job_is_asked_for_and_cancelled(client: TestClient, turned: Turned) -> None:
    """POST answers 202 with where to look; its images are frozen; cancelling ends it."""
    path = f"{API}/viewports/{turned.viewport_id}/reregistrations"
    asked = client.post(path, json={"images": "unassigned", "from": "2026-11-22T14:30:00Z"})
    assert asked.status_code == 202, asked.text
    job = asked.json()
    assert asked.headers["location"] == f"{API}/reregistrations/{job['id']}"
    assert (job["status"], job["images_total"], job["images_done"]) == ("queued", 3, 0)
    assert job["reference_image_id"] == turned.image_ids[0]
    cancelled = client.post(f"{asked.headers['location']}/cancel")
    assert cancelled.json()["status"] == "cancelled"
    listed = client.get(path).json()["items"]
    assert [item["status"] for item in listed] == ["succeeded", "cancelled"]


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        ({"images": "viewport"}, 409, "viewport_id"),
        ({"from": "2027-01-01T00:00:00Z"}, 409, "viewport_id"),
        ({"from": "2026-11-22T15:00:00Z", "until": "2026-11-22T14:00:00Z"}, 422, "until"),
        ({"reference_image_id": 999_999}, 422, "reference_image_id"),
        ({"gate": {"inliers": 1}}, 422, "gate.inliers"),
        ({"images": "some"}, 422, "images"),
        ({"image": "all"}, 422, "image"),
    ],
)
def test_what_cannot_be_is_refused_by_field(
    client: TestClient, turned: Turned, body: dict[str, object], status: int, field: str
) -> None:
    """No images, a foreign reference, a gate that lets all through: refused, nothing stored."""
    path = f"{API}/viewports/{turned.viewport_id}/reregistrations"
    refused = client.post(path, json=body)
    assert refused.status_code == status, refused.text
    assert refused.json()["errors"][0]["field"] == field
    assert len(client.get(path).json()["items"]) == 1


def test_a_viewport_without_a_pose_is_no_reference(client: TestClient, turned: Turned) -> None:
    """There is nothing to turn where nothing was registered."""
    made = client.post(
        f"{API}/viewports",
        json={"camera_id": turned.camera_id, "name": "New", "valid_from": "2030-01-01T00:00:00Z"},
    )
    refused = client.post(f"{API}/viewports/{made.json()['id']}/reregistrations", json={})
    assert refused.status_code == 409
    assert "no camera pose" in refused.json()["detail"]


def test_images_and_pointings_are_listed(client: TestClient, turned: Turned) -> None:
    """Each image says how it is turned or why not; pages and filters work; pointings are dated."""
    path = f"{API}/reregistrations/{turned.reregistration_id}"
    first = client.get(f"{path}/images", params={"limit": 3}).json()
    rest = client.get(f"{path}/images", params={"cursor": first["next_cursor"]}).json()
    items = first["items"] + rest["items"]
    assert [item["passed"] for item in items] == [True, True, True, False]
    assert [item["moved"] for item in items] == [False, True, True, None]
    assert items[3]["message"].startswith("Too few points")
    refused = client.get(f"{path}/images", params={"passed": False}).json()["items"]
    assert [item["image_id"] for item in refused] == [turned.image_ids[4]]
    pointings = client.get(f"{path}/pointings").json()["items"]
    assert [pointing["moved"] for pointing in pointings] == [False, True]
    assert pointings[1]["first_at"] == "2026-11-22T15:00:00Z"
    overlay = client.get(f"{API}/pointings/{turned.moved_id}/overlay").json()
    assert len(overlay["before"]["horizon"]) == len(overlay["after"]["horizon"]) > 10
    assert overlay["before"]["horizon"] != overlay["after"]["horizon"]


def test_an_accepted_pointing_is_a_viewport(client: TestClient, turned: Turned) -> None:
    """Accepting makes a viewport with a turned registration that says what it rests on.

    Its images and those to come belong to it; accepting twice is refused.
    """
    accepted = client.post(f"{API}/pointings/{turned.moved_id}/accept", json={})
    assert accepted.status_code == 200, accepted.text
    viewport = client.get(f"{API}/viewports/{accepted.json()['viewport_id']}").json()
    assert viewport["valid_from"] == "2026-11-22T15:00:00Z"
    assert viewport["valid_until"] is None
    assert viewport["name"] == "North, from 2026-11-22 15:00"
    path = f"{API}/viewports/{viewport['id']}/registrations"
    (registration,) = client.get(path).json()["items"]
    assert registration["method"] == "rotation"
    assert registration["provenance"]["from_registration_id"] == turned.registration_id
    assert registration["provenance"]["inliers"] == 122
    before = matrix_from_rotvec([1.2, 0.1, -0.1])
    after = matrix_from_rotvec(registration["rotation"])
    assert np.allclose(after @ before.T, matrix_from_rotvec([0.0, 0.01, 0.0]))
    images = client.get(f"{API}/images", params={"viewport_id": viewport["id"]}).json()["items"]
    assert [image["id"] for image in images] == turned.image_ids[2:]
    again = client.post(f"{API}/pointings/{turned.moved_id}/accept")
    assert again.status_code == 409
    run = client.get(f"{API}/viewports/{viewport['id']}").json()
    assert run["registration_id"] == registration["id"]


def test_a_pointing_that_has_not_moved_widens_its_viewport(
    client: TestClient, turned: Turned
) -> None:
    """Images that look as registered join the viewport they look like, without a copy of it."""
    accepted = client.post(f"{API}/pointings/{turned.unmoved_id}/accept").json()
    assert accepted["viewport_id"] == turned.viewport_id
    viewport = client.get(f"{API}/viewports/{turned.viewport_id}").json()
    assert viewport["valid_until"] == "2026-11-22T15:00:00Z"
    assert viewport["registration_id"] == turned.registration_id
    image = client.get(f"{API}/images/{turned.image_ids[1]}").json()
    assert image["viewport_id"] == turned.viewport_id


def test_accepting_ends_the_viewport_that_held_the_images(
    client: TestClient, turned: Turned
) -> None:
    """Where an open viewport held the moved images, it ends where they begin, and the alarm too."""
    viewport = f"{API}/viewports/{turned.viewport_id}"
    etag = client.get(viewport).headers["etag"]
    client.patch(viewport, json={"valid_until": None}, headers={"If-Match": etag})
    page = client.get(f"/viewports/{turned.viewport_id}").text
    assert "The camera has moved" in page
    assert "0.57°" in page
    accepted = client.post(
        f"{API}/pointings/{turned.moved_id}/accept", json={"name": "After the storm"}
    )
    assert accepted.status_code == 200, accepted.text
    assert client.get(viewport).json()["valid_until"] == "2026-11-22T15:00:00Z"
    assert "The camera has moved" not in client.get(f"/viewports/{turned.viewport_id}").text


def test_times_that_others_hold_are_refused(client: TestClient, turned: Turned) -> None:
    """A pointing cannot take times of another viewport; nothing is half stored."""
    client.post(
        f"{API}/viewports",
        json={"camera_id": turned.camera_id, "name": "Mine", "valid_from": "2026-11-22T16:30:00Z"},
    )
    path = f"{API}/pointings/{turned.moved_id}"
    refused = client.post(f"{path}/accept", json={"valid_until": "2026-11-22T18:00:00Z"})
    assert refused.status_code == 409
    assert client.get(path).json()["state"] == "proposed"
    accepted = client.post(f"{path}/accept").json()
    viewport = client.get(f"{API}/viewports/{accepted['viewport_id']}").json()
    assert viewport["valid_until"] == "2026-11-22T16:30:00Z"


def test_a_pointing_is_put_aside(client: TestClient, turned: Turned) -> None:
    """A rejected pointing makes no viewport, and stays decided."""
    path = f"{API}/pointings/{turned.moved_id}"
    assert client.post(f"{path}/reject").json()["state"] == "rejected"
    assert client.post(f"{path}/accept").status_code == 409
    assert len(client.get(f"{API}/viewports").json()["items"]) == 1


def test_a_turned_registration_is_not_made_by_hand(client: TestClient, turned: Turned) -> None:
    """`rotation` is refused as a method, with where it comes from."""
    path = f"{API}/viewports/{turned.viewport_id}/registrations"
    refused = client.post(path, json={"method": "rotation"})
    assert refused.status_code == 422
    assert "pointings" in refused.json()["detail"]


def test_pages_start_show_and_decide(
    browser_of: Callable[[User], TestClient], admin: User, turned: Turned
) -> None:
    """The pages list, warn, start a job, show a pointing and accept it."""
    browser = browser_of(admin)
    here = f"/viewports/{turned.viewport_id}/reregistrations"
    assert "Re-registration 1" in browser.get(here).text
    assert "2 pointings wait for a decision" in browser.get(f"/cameras/{turned.camera_id}").text
    wrong = browser.post(here, data={"images": "unassigned", "from": "yesterday"})
    assert wrong.status_code == 422
    assert "must be a moment" in wrong.text
    started = browser.post(here, data={"images": "unassigned"})
    assert started.status_code == 303
    assert "Queued" in browser.get(started.headers["location"]).text
    shown = browser.get(f"/reregistrations/{turned.reregistration_id}").text
    assert "Too few points of the known scenery" in shown
    pointing = f"/pointings/{turned.moved_id}"
    assert "Waits for you" in browser.get(pointing).text
    accepted = browser.post(f"{pointing}/accept", data={"name": "Turned"})
    assert accepted.status_code == 303
    assert "Turned, by photographs" in browser.get(accepted.headers["location"]).text
