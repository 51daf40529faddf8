"""Decisions over REST: words added later, undo, the rest of an image, second opinions."""

from typing import Any, Protocol

import pytest
from starlette.testclient import TestClient

API = "/api/v1"


class MakePoses(Protocol):
    """Stores a run; returns its id and those of its poses in order."""

    def __call__(self, *poses_per_image: int) -> tuple[int, list[int]]:
        """Put so many poses into each image."""


@pytest.fixture
def pose_id(run_with: MakePoses) -> int:
    """Give a pose that nobody has graded."""
    return run_with(1)[1][0]


def grade(client: TestClient, pose_id: int, grade: str, **body: object) -> dict[str, Any]:
    """Grade a pose and return the answer."""
    answer = client.post(f"{API}/poses/{pose_id}/reviews", json={"grade": grade, **body})
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def pose(client: TestClient, pose_id: int) -> dict[str, Any]:
    """Return a pose as somebody sees it."""
    found: dict[str, Any] = client.get(f"{API}/poses/{pose_id}").json()
    return found


def grades(client: TestClient, pose_id: int) -> tuple[str | None, str | None]:
    """Return the grade that counts and one's own."""
    shown = pose(client, pose_id)
    review, mine = shown["review"], shown["mine"]
    return review and review["grade"], mine and mine["grade"]


def test_the_idempotency_key_names_the_decision(ada: TestClient, pose_id: int) -> None:
    """A client may speak of its decision by the key it sent, before it has any answer."""
    answer = ada.post(
        f"{API}/poses/{pose_id}/reviews",
        json={"grade": "ok"},
        headers={"Idempotency-Key": "key-1"},
    )
    assert answer.json()["decision"] == "key-1"
    added = ada.patch(f"{API}/decisions/key-1", json={"reasons": ["heading", "size", "size"]})
    assert added.json()["reviews"][0]["reasons"] == ["heading", "size"]
    assert pose(ada, pose_id)["review"]["reasons"] == ["heading", "size"]


def test_reasons_stay_with_the_decision_they_were_for(ada: TestClient, pose_id: int) -> None:
    """Reasons that arrive after the pose was graded again do not touch the new verdict."""
    grade(ada, pose_id, "ok", decision="first")
    grade(ada, pose_id, "bad", decision="second")
    late = ada.patch(f"{API}/decisions/first", json={"reasons": ["heading"]})
    assert late.json()["reviews"][0]["grade"] == "ok"
    assert pose(ada, pose_id)["review"]["reasons"] == []
    for _ in range(2):
        ada.patch(f"{API}/decisions/second", json={"reasons": ["size"], "comment": "far off"})
    review = pose(ada, pose_id)["review"]
    assert (review["reasons"], review["comment"]) == (["size"], "far off")
    ada.patch(f"{API}/decisions/second", json={"reasons": []})
    assert pose(ada, pose_id)["review"]["comment"] == "far off"


def test_words_must_fit_and_be_ones_own(ada: TestClient, ben: TestClient, pose_id: int) -> None:
    """A reason of another grade is refused by name; others' decisions are unknown."""
    grade(ada, pose_id, "ok", decision="mine")
    refused = ada.patch(f"{API}/decisions/mine", json={"reasons": ["missing_ais"]})
    assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "reasons")
    for answer in (
        ben.patch(f"{API}/decisions/mine", json={"comment": "x"}),
        ben.delete(f"{API}/decisions/mine"),
        ada.delete(f"{API}/decisions/never-made"),
    ):
        assert answer.status_code == 404
    assert grades(ada, pose_id) == ("ok", "ok")


def test_undo_brings_back_what_one_had_said_before(ada: TestClient, pose_id: int) -> None:
    """Taking a decision back lets the earlier one stand; twice is as once; then there is none."""
    grade(ada, pose_id, "ok", decision="first")
    grade(ada, pose_id, "bad", decision="second")
    first, again = (ada.delete(f"{API}/decisions/second").json() for _ in range(2))
    assert first == again
    assert first["poses"][0]["mine"]["decision"] == "first"
    assert grades(ada, pose_id) == ("ok", "ok")
    assert ada.delete(f"{API}/decisions/first").json()["poses"][0]["review"] is None
    assert grades(ada, pose_id) == (None, None)
    kept = ada.get(f"{API}/poses/{pose_id}/reviews").json()["items"]
    assert [review["withdrawn_at"] is not None for review in kept] == [True, True]


def test_undo_of_an_old_decision_leaves_the_newer_one(ada: TestClient, pose_id: int) -> None:
    """What was graded since stands; the old decision does not come back after it either."""
    grade(ada, pose_id, "ok", decision="first")
    grade(ada, pose_id, "bad", decision="second")
    ada.delete(f"{API}/decisions/first")
    assert grades(ada, pose_id) == ("bad", "bad")
    ada.delete(f"{API}/decisions/second")
    assert grades(ada, pose_id) == (None, None)


def test_the_second_person_gives_a_second_opinion(
    ada: TestClient, ben: TestClient, pose_id: int
) -> None:
    """It is told so, stands beside the first verdict, and the disagreement shows."""
    assert grade(ada, pose_id, "good")["second_opinion"] is False
    assert grade(ben, pose_id, "bad")["second_opinion"] is True
    assert grades(ben, pose_id) == ("good", "bad")
    shown = pose(ada, pose_id)
    assert (shown["opinions"], shown["disagreement"]) == (2, True)
    assert grade(ben, pose_id, "good")["second_opinion"] is True
    assert pose(ada, pose_id)["disagreement"] is False


def test_a_disagreement_can_be_settled(
    ada: TestClient, ben: TestClient, client: TestClient, pose_id: int
) -> None:
    """A settling verdict counts from then on, and nothing is in dispute any more."""
    grade(ada, pose_id, "good")
    grade(ben, pose_id, "bad")
    settled = grade(client, pose_id, "ok", settle=True)
    assert (settled["settles"], settled["second_opinion"]) == (True, False)
    assert grades(ada, pose_id) == ("ok", "good")
    assert pose(ada, pose_id)["disagreement"] is False


def test_when_the_first_leaves_the_second_counts(
    ada: TestClient, ben: TestClient, pose_id: int
) -> None:
    """After the first verdict is taken back, the oldest second opinion is the verdict."""
    grade(ada, pose_id, "good", decision="first")
    grade(ben, pose_id, "bad")
    ada.delete(f"{API}/decisions/first")
    assert grades(ben, pose_id) == ("bad", "bad")
    assert grade(ada, pose_id, "good")["second_opinion"] is True
    assert grades(ada, pose_id) == ("bad", "good")


def test_the_rest_of_an_image_is_graded_and_undone_as_one(
    ada: TestClient, ben: TestClient, run_with: MakePoses
) -> None:
    """All ungraded poses of the image and no others become Good; one undo takes all back."""
    run_id, ids = run_with(3, 1)
    grade(ben, ids[1], "bad")
    image_id = pose(ada, ids[0])["image"]["id"]
    answer = ada.post(
        f"{API}/images/{image_id}/reviews", json={"run_id": run_id, "decision": "rest"}
    )
    assert answer.status_code == 201, answer.text
    assert [review["pose_id"] for review in answer.json()["reviews"]] == [ids[0], ids[2]]
    assert answer.json()["skipped"] == [ids[1]]
    assert [grades(ada, i)[0] for i in ids] == ["good", "bad", "good", None]
    undone = ada.delete(f"{API}/decisions/rest").json()
    assert [part["pose_id"] for part in undone["poses"]] == [ids[0], ids[2]]
    assert [grades(ada, i)[0] for i in ids] == [None, "bad", None, None]


def test_the_rest_may_be_named(ada: TestClient, ben: TestClient, run_with: MakePoses) -> None:
    """Named poses are graded beside others' verdicts, one's own are kept, strangers refused."""
    run_id, ids = run_with(3, 1)
    grade(ben, ids[0], "bad")
    grade(ada, ids[1], "wrong")
    url = f"{API}/images/{pose(ada, ids[0])['image']['id']}/reviews"
    refused = ada.post(url, json={"run_id": run_id, "pose_ids": [ids[0], ids[3]]})
    assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "pose_ids")
    answer = ada.post(url, json={"run_id": run_id, "pose_ids": ids[:2]}).json()
    assert [(r["pose_id"], r["second_opinion"]) for r in answer["reviews"]] == [(ids[0], True)]
    assert answer["skipped"] == [ids[1]]
    other = ada.post(url, json={"run_id": 999_999})
    assert (other.status_code, other.json()["errors"][0]["field"]) == (422, "run_id")
