"""The images of a run over REST: missed vessels, completeness, what was heard and detected."""

from typing import Any, Protocol

import pytest
from starlette.testclient import TestClient

from app.db import Database
from tests.factories.runs import FIRST_MMSI, Harbour, make_vessel

API = "/api/v1"
BOX = {"x1_px": -0.5, "y1_px": 3, "x2_px": 20.25, "y2_px": 12}


class MakePoses(Protocol):
    """Stores a run; returns its id and those of its poses in order."""

    def __call__(self, *poses_per_image: int) -> tuple[int, list[int]]:
        """Put so many poses into each image."""


@pytest.fixture
def image_ids(harbour: Harbour) -> list[int]:
    """Give the ids of the images in time order."""
    return [image.id for image in harbour.images]


def images(client: TestClient, run_id: int, **wanted: object) -> list[dict[str, Any]]:
    """Return the listed images of a run."""
    answer = client.get(f"{API}/runs/{run_id}/images", params=wanted)
    assert answer.status_code == 200, answer.text
    found: list[dict[str, Any]] = answer.json()["items"]
    return found


def miss(client: TestClient, image_id: int, run_id: int, **changed: object) -> dict[str, Any]:
    """Mark a missed vessel."""
    body = {"run_id": run_id, **BOX, "reason": "no_ais", **changed}
    answer = client.post(f"{API}/images/{image_id}/missed-vessels", json=body)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def complete(client: TestClient, image_id: int, run_id: int) -> Any:
    """Say that an image is complete."""
    return client.post(f"{API}/images/{image_id}/complete", json={"run_id": run_id})


def grade(client: TestClient, pose_id: int) -> None:
    """Grade a pose."""
    answer = client.post(f"{API}/poses/{pose_id}/reviews", json={"grade": "good"})
    assert answer.status_code == 201


def test_images_without_poses_are_listed_too(
    ada: TestClient, run_with: MakePoses, image_ids: list[int]
) -> None:
    """All images of a run come in time order with their counts, and can be filtered."""
    run_id, ids = run_with(2, 0, 1)
    grade(ada, ids[0])
    miss(ada, image_ids[1], run_id)
    complete(ada, image_ids[1], run_id)
    listed = images(ada, run_id)
    assert [item["image"]["id"] for item in listed] == image_ids
    assert [(i["poses"], i["graded"], i["missed"]) for i in listed] == [
        (2, 1, 0),
        (0, 0, 1),
        (1, 0, 0),
    ]
    assert [item["complete"] is not None for item in listed] == [False, True, False]
    for wanted, expected in (
        ({"complete": True}, [1]),
        ({"complete": False}, [0, 2]),
        ({"has_poses": False}, [1]),
        ({"has_missed": False, "has_poses": True}, [0, 2]),
    ):
        assert [item["position"] for item in images(ada, run_id, **wanted)] == expected
    first = ada.get(f"{API}/runs/{run_id}/images", params={"limit": 2}).json()
    rest = images(ada, run_id, limit=2, cursor=first["next_cursor"])
    assert [item["position"] for item in rest] == [2]


def test_a_missed_vessel_is_marked_changed_and_unmarked(
    ada: TestClient, run_with: MakePoses, image_ids: list[int]
) -> None:
    """It keeps box, reason and person; edits carry versions."""
    run_id, _ = run_with(1)
    missed = miss(ada, image_ids[0], run_id, comment="barge <b>")
    assert missed | BOX == missed
    assert (missed["reason"], missed["comment"], missed["user"]) == (
        "no_ais",
        "barge <b>",
        "Test Person",
    )
    listed = ada.get(f"{API}/images/{image_ids[0]}/missed-vessels", params={"run_id": run_id})
    assert listed.json()["items"] == [missed]
    url = f"{API}/missed-vessels/{missed['id']}"
    tag = ada.get(url).headers["etag"]
    changes = {"x2_px": 30, "reason": "neither", "comment": None}
    assert ada.patch(url, json=changes).status_code == 428
    changed = ada.patch(url, json=changes, headers={"If-Match": tag})
    assert changed.json() | changes == changed.json()
    assert ada.patch(url, json=changes, headers={"If-Match": tag}).status_code == 412
    assert ada.get(url).json() == changed.json()
    assert ada.delete(url).status_code == 204
    assert ada.get(url).status_code == 404


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"x1_px": -0.6}, "x1_px"),
        ({"x2_px": 100_000}, "x2_px"),
        ({"y2_px": 3}, "y2_px"),
        ({"x1_px": 25}, "x2_px"),
        ({"reason": "fog"}, "reason"),
        ({"run_id": 999_999}, "run_id"),
    ],
)
def test_a_missed_vessel_lies_in_the_image(
    ada: TestClient,
    run_with: MakePoses,
    image_ids: list[int],
    changed: dict[str, object],
    field: str,
) -> None:
    """A box outside the image, an empty one or a wrong reason is refused by name."""
    run_id, _ = run_with(1)
    body = {"run_id": run_id, **BOX, "reason": "no_ais", **changed}
    answer = ada.post(f"{API}/images/{image_ids[0]}/missed-vessels", json=body)
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, field)
    assert images(ada, run_id)[0]["missed"] == 0


def test_an_image_is_complete_once_its_poses_are_graded(
    ada: TestClient, ben: TestClient, run_with: MakePoses, image_ids: list[int]
) -> None:
    """What is missing is told; completing twice is as once; it can be taken back."""
    run_id, ids = run_with(2)
    grade(ada, ids[0])
    refused = complete(ada, image_ids[0], run_id)
    assert (refused.status_code, refused.json()["ungraded"]) == (409, [ids[1]])
    assert refused.json()["errors"][0]["field"] == "poses"
    grade(ben, ids[1])
    first, again = (complete(ada, image_ids[0], run_id) for _ in range(2))
    assert (first.status_code, again.status_code) == (201, 200)
    assert first.json() == again.json()
    url = f"{API}/images/{image_ids[0]}/complete"
    for _ in range(2):
        assert ada.delete(url, params={"run_id": run_id}).status_code == 204
    assert images(ada, run_id)[0]["complete"] is None


def test_completing_does_the_item_of_an_image_queue(
    ada: TestClient, ben: TestClient, run_with: MakePoses, image_ids: list[int]
) -> None:
    """The item of an image is done by completing it, and open again when that is taken back."""
    run_id, _ = run_with(0, 0)
    queue = ada.post(f"{API}/review-queues", json={"run_id": run_id, "unit": "image"}).json()
    url = f"{API}/review-queues/{queue['id']}"
    assert ada.post(f"{url}/next").json()["image_id"] == image_ids[0]
    complete(ada, image_ids[0], run_id)
    assert ada.get(f"{url}/progress").json()["mine_done"] == 1
    assert ben.post(f"{url}/next").json()["image_id"] == image_ids[1]
    ada.delete(f"{API}/images/{image_ids[0]}/complete", params={"run_id": run_id})
    shown = ada.get(f"{url}/progress").json()
    assert (shown["mine_done"], shown["mine_leased"]) == (0, 1)
    assert ben.post(f"{url}/next").status_code == 204


def test_what_was_heard_and_detected_is_told(
    ada: TestClient, run_with: MakePoses, image_ids: list[int], database: Database
) -> None:
    """Around an image stand the vessels with their outcome and the boxes, each with its pose."""
    run_id, ids = run_with(1)
    with database.writing() as session:
        make_vessel(session)
    params = {"run_id": run_id}
    vessel = ada.get(f"{API}/images/{image_ids[0]}/vessels", params=params).json()["items"][0]
    assert (vessel["mmsi"], vessel["name"], vessel["pose_id"]) == (FIRST_MMSI, "ANNEGRET", ids[0])
    assert (vessel["length_m"], len(vessel["segments"]["reported"])) == (80.0, 4)
    answer = ada.get(f"{API}/images/{image_ids[0]}/detections", params=params)
    assert answer.json()["items"] == []  # the factory names no detection set for the image
