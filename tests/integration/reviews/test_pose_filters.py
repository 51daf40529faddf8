"""What poses can be asked for by: every filter is part of the address and combines with others."""

from typing import Any, Protocol

import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.runs import Pose

API = "/api/v1"


class MakePoses(Protocol):
    """Stores a run; returns its id and those of its poses in order."""

    def __call__(self, *poses_per_image: int) -> tuple[int, list[int]]:
        """Put so many poses into each image."""


def grade(client: TestClient, pose_id: int, grade: str, **body: object) -> dict[str, Any]:
    """Grade a pose."""
    answer = client.post(f"{API}/poses/{pose_id}/reviews", json={"grade": grade, **body})
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


@pytest.fixture
def judged(
    ada: TestClient, ben: TestClient, client: TestClient, run_with: MakePoses, database: Database
) -> tuple[int, list[int]]:
    """Give five poses: ungraded, good, in dispute, settled, bad and flagged."""
    run_id, ids = run_with(5)
    grade(ada, ids[1], "good")
    for pose_id in ids[2:4]:
        grade(ada, pose_id, "ok")
        grade(ben, pose_id, "bad")
    grade(client, ids[3], "wrong", settle=True)
    grade(ben, ids[4], "bad")
    with database.writing() as session:
        session.get_one(Pose, ids[4]).flags = ["cut_left", "no_height"]
        session.get_one(Pose, ids[0]).flags = ["cut_leftish"]
    return run_id, ids


FILTERS: list[tuple[dict[str, object], list[int]]] = [
    ({"state": "ungraded"}, [0]),
    ({"state": "graded"}, [1, 2, 3, 4]),
    ({"state": "disagreement"}, [2]),
    ({"state": "settled"}, [3]),
    ({"state": "second_opinion"}, [2, 3]),
    ({"grade": "ok"}, [2]),
    ({"grade": "wrong"}, [3]),
    ({"grade": "ungraded"}, [0]),
    ({"reviewer": "me"}, [1, 2, 3]),
    ({"reviewer": "me", "state": "disagreement"}, [2]),
    ({"reviewer": "999999"}, []),
    ({"flag": "cut_left"}, [4]),
    ({"flag": "no_height", "grade": "bad"}, [4]),
    ({"corrected": False, "person_made": False, "bookmarked": False}, [0, 1, 2, 3, 4]),
]
WRONG: list[tuple[dict[str, object], str]] = [
    ({"state": "fine"}, "state"),
    ({"reviewer": "ada"}, "reviewer"),
    ({"reviewer": "9" * 12}, "reviewer"),
    ({"flag": '"%_'}, "flag"),
]


def test_filters_combine(ada: TestClient, judged: tuple[int, list[int]]) -> None:
    """Each filter selects what it says, and all given ones hold together."""
    run_id, ids = judged
    for wanted, expected in FILTERS:
        answer = ada.get(f"{API}/poses", params={"run_id": run_id, **wanted})
        assert answer.status_code == 200, answer.text
        found = [pose["id"] for pose in answer.json()["items"]]
        assert found == [ids[i] for i in expected], wanted


def test_a_wrong_filter_is_named(ada: TestClient) -> None:
    """A filter that cannot be is refused instead of giving everything."""
    for wanted, field in WRONG:
        answer = ada.get(f"{API}/poses", params=wanted)
        assert answer.status_code == 422, wanted
        assert answer.json()["errors"][0]["field"].endswith(field)
