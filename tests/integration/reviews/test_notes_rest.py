"""Bookmarks, comments and chosen keys over REST."""

from collections.abc import Callable
from typing import Any, Protocol

import pytest
from starlette.testclient import TestClient

from tests.factories.runs import Harbour

API = "/api/v1"


class MakePoses(Protocol):
    """Stores a run; returns its id and those of its poses in order."""

    def __call__(self, *poses_per_image: int) -> tuple[int, list[int]]:
        """Put so many poses into each image."""


def test_bookmarks_are_ones_own(
    ada: TestClient, ben: TestClient, run_with: MakePoses, harbour: Harbour
) -> None:
    """They mark poses and images for one person, filter the poses, and go as they came."""
    run_id, ids = run_with(2)
    image_id = harbour.images[0].id
    for _ in range(2):
        assert ada.put(f"{API}/poses/{ids[0]}/bookmark").status_code == 204
        assert ada.put(f"{API}/images/{image_id}/bookmark").status_code == 204
    listed = ada.get(f"{API}/bookmarks").json()["items"]
    assert [(one["image_id"], one["pose_id"]) for one in listed] == [
        (image_id, ids[0]),
        (image_id, None),
    ]
    in_run = ada.get(f"{API}/bookmarks", params={"run_id": run_id}).json()["items"]
    assert [one["pose_id"] for one in in_run] == [ids[0]]
    wanted = {"run_id": run_id, "bookmarked": True}
    found = ada.get(f"{API}/poses", params=wanted).json()["items"]
    assert [(pose["id"], pose["bookmarked"]) for pose in found] == [(ids[0], True)]
    assert ben.get(f"{API}/poses", params=wanted).json()["items"] == []
    assert ben.get(f"{API}/bookmarks").json()["items"] == []
    for place in (f"poses/{ids[0]}", f"images/{image_id}"):
        assert ada.delete(f"{API}/{place}/bookmark").status_code == 204
    assert ada.get(f"{API}/bookmarks").json()["items"] == []


def test_comments_are_for_all_to_read(
    ada: TestClient, ben: TestClient, client: TestClient, run_with: MakePoses, harbour: Harbour
) -> None:
    """A thread at a pose is part of its image's; only author and administrator remove a comment."""
    _, ids = run_with(2)
    image_id = harbour.images[0].id
    said = ada.post(f"{API}/poses/{ids[0]}/comments", json={"text": "  which tug? <b>  "})
    assert said.status_code == 201, said.text
    assert (said.json()["text"], said.json()["mine"]) == ("which tug? <b>", True)
    ben.post(f"{API}/poses/{ids[0]}/comments", json={"text": "the second"})
    ben.post(f"{API}/images/{image_id}/comments", json={"text": "fog"})
    thread = ben.get(f"{API}/poses/{ids[0]}/comments").json()["items"]
    assert [(one["text"], one["mine"]) for one in thread] == [
        ("which tug? <b>", False),
        ("the second", True),
    ]
    assert len(ben.get(f"{API}/images/{image_id}/comments").json()["items"]) == 3
    shown = [ada.get(f"{API}/poses/{pose_id}").json()["comments"] for pose_id in ids]
    assert shown == [2, 0]
    url = f"{API}/comments/{said.json()['id']}"
    assert ben.delete(url).status_code == 403
    assert client.delete(url).status_code == 204
    assert ada.delete(url).status_code == 404


@pytest.mark.parametrize("text", ["", "   ", "x" * 4001, "a\x00b"])
def test_a_comment_has_a_text(ada: TestClient, run_with: MakePoses, text: str) -> None:
    """Empty ones, endless ones and NUL are refused by name."""
    _, ids = run_with(1)
    answer = ada.post(f"{API}/poses/{ids[0]}/comments", json={"text": text})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "text")


def test_who_only_looks_says_nothing(
    client_of: Callable[..., TestClient], make_user: Any, run_with: MakePoses
) -> None:
    """A viewer reads comments and keeps own bookmarks, but does not comment."""
    _, ids = run_with(1)
    viewer = client_of(make_user("viewer"))
    assert viewer.post(f"{API}/poses/{ids[0]}/comments", json={"text": "x"}).status_code == 403
    assert viewer.get(f"{API}/poses/{ids[0]}/comments").json()["items"] == []
    assert viewer.put(f"{API}/poses/{ids[0]}/bookmark").status_code == 204


def test_keys_are_a_persons_own(ada: TestClient, ben: TestClient) -> None:
    """Chosen keys come back on any machine, replace the earlier choice, and are nobody else's."""
    url = f"{API}/me/keys"
    assert ada.get(url).json() == {"bindings": {}}
    for code in ("KeyG", "Digit9"):
        chosen = {"bindings": {"review.good": [code, "Numpad1"]}}
        assert ada.put(url, json=chosen).json() == chosen
        assert ada.get(url).json() == chosen
    assert ben.get(url).json() == {"bindings": {}}
    for wrong in ({"review.good": ["<script>"]}, {"Bad Name": ["KeyA"]}, {"a": ["KeyA"] * 6}):
        assert ada.put(url, json={"bindings": wrong}).status_code == 422
