"""Grading poses over REST."""

from collections.abc import Callable
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database
from app.domain.grading import GUIDELINE_VERSION
from app.reviews import grading, service
from app.reviews.grading import Verdict
from app.tables.identity import User
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose
from tests.factories.runs import Harbour, make_run


@pytest.fixture
def pose_id(database: Database, harbour: Harbour) -> int:
    """Give a pose that nobody has graded."""
    with database.writing() as session:
        make_run(session, harbour, [1])
        return session.scalars(sa.select(Pose.id)).one()


def reviews(client: TestClient, pose_id: int) -> list[dict[str, Any]]:
    """Return all verdicts on a pose."""
    items: list[dict[str, Any]] = client.get(f"/api/v1/poses/{pose_id}/reviews").json()["items"]
    return items


def newest(client: TestClient, pose_id: int) -> dict[str, Any] | None:
    """Return the verdict that stands for a pose."""
    review: dict[str, Any] | None = client.get(f"/api/v1/poses/{pose_id}").json()["review"]
    return review


def test_a_verdict_is_stored_with_its_circumstances(
    client: TestClient, admin: User, pose_id: int
) -> None:
    """A verdict keeps grade, reasons once each, comment, time, person and guideline."""
    answer = client.post(
        f"/api/v1/poses/{pose_id}/reviews",
        json={
            "grade": "ok",
            "reasons": ["heading", "height", "heading"],
            "comment": "skewed\n<script>alert(1)</script>",
            "seconds": 1.8,
        },
    )
    assert answer.status_code == 201, answer.text
    assert answer.headers["location"] == f"/api/v1/poses/{pose_id}/reviews"
    review = answer.json()
    expected = {
        "pose_id": pose_id,
        "grade": "ok",
        "reasons": ["heading", "height"],
        "comment": "skewed\n<script>alert(1)</script>",
        "seconds": 1.8,
        "guideline_version": GUIDELINE_VERSION,
        "inherited": False,
        "user": admin.name,
        "replaced_at": None,
    }
    assert {key: review[key] for key in expected} == expected
    assert newest(client, pose_id) == review
    assert reviews(client, pose_id) == [review]


def test_grading_again_replaces_and_keeps(client: TestClient, pose_id: int) -> None:
    """One's newer verdict stands; the older ones stay readable, with the moment they ended."""
    for grade in ("bad", "ok", "good"):
        client.post(f"/api/v1/poses/{pose_id}/reviews", json={"grade": grade})
    history = reviews(client, pose_id)
    assert [review["grade"] for review in history] == ["bad", "ok", "good"]
    assert [review["replaced_at"] is None for review in history] == [False, False, True]
    standing = newest(client, pose_id)
    assert standing is not None
    assert standing["grade"] == "good"


def test_a_second_persons_verdict_stands_beside(
    pose_id: int, client_of: Callable[..., TestClient], make_user: Callable[..., User]
) -> None:
    """Each person replaces their own verdict only."""
    ada, ben = client_of(make_user("reviewer")), client_of(make_user("reviewer"))
    for client, grade in ((ada, "good"), (ben, "bad"), (ada, "ok")):
        answer = client.post(f"/api/v1/poses/{pose_id}/reviews", json={"grade": grade})
        assert answer.status_code == 201
    standing = [review for review in reviews(ada, pose_id) if review["replaced_at"] is None]
    assert [review["grade"] for review in standing] == ["bad", "ok"]


@pytest.mark.parametrize(
    ("grade", "reasons"),
    [
        ("good", []),
        ("ok", ["position", "heading", "height", "size", "other"]),
        ("bad", ["size"]),
        ("wrong", ["missing_ais", "false_positive", "cost_function", "subvessel", "other"]),
    ],
)
def test_reasons_that_go_with_a_grade_are_taken(
    client: TestClient, pose_id: int, grade: str, reasons: list[str]
) -> None:
    """Each grade takes the reasons of the guideline."""
    answer = client.post(
        f"/api/v1/poses/{pose_id}/reviews", json={"grade": grade, "reasons": reasons}
    )
    assert (answer.status_code, answer.json()["reasons"]) == (201, reasons)


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"grade": "superb"}, "grade"),
        ({}, "grade"),
        ({"grade": "good", "reasons": ["heading"]}, "reasons"),
        ({"grade": "ok", "reasons": ["subvessel"]}, "reasons"),
        ({"grade": "wrong", "reasons": ["heading"]}, "reasons"),
        ({"grade": "bad", "reasons": ["x" * 100_000]}, "reasons.0"),
        ({"grade": "bad", "reasons": ["size"] * 11}, "reasons"),
        ({"grade": "bad", "reasons": "size"}, "reasons"),
        ({"grade": "bad", "comment": "x" * 4001}, "comment"),
        ({"grade": "bad", "comment": "a\x00b"}, "comment"),
        ({"grade": "bad", "seconds": -1}, "seconds"),
        ({"grade": "bad", "seconds": 86401}, "seconds"),
        ({"grade": "bad", "user_id": 1}, "user_id"),
    ],
)
def test_a_wrong_field_is_named_and_nothing_is_stored(
    client: TestClient, pose_id: int, body: dict[str, Any], field: str
) -> None:
    """Each mistake is answered with its field, in few words, and leaves no verdict."""
    answer = client.post(f"/api/v1/poses/{pose_id}/reviews", json=body)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]
    assert len(answer.content) < 2000
    assert reviews(client, pose_id) == []


@pytest.mark.parametrize("seconds", ["NaN", "Infinity"])
def test_a_time_that_is_no_number_is_refused(
    client: TestClient, pose_id: int, seconds: str
) -> None:
    """Python's JSON reader takes NaN; a verdict does not."""
    answer = client.post(
        f"/api/v1/poses/{pose_id}/reviews",
        content=f'{{"grade": "good", "seconds": {seconds}}}',
        headers={"Content-Type": "application/json"},
    )
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "seconds")


def test_the_longest_comment_is_taken_whole(client: TestClient, pose_id: int) -> None:
    """4,000 characters of any script come back as they were sent; an empty comment is none."""
    comment = "Hafen 港 ⚓" * 400
    for sent, kept in ((comment, comment), ("", None)):
        body = {"grade": "bad", "comment": sent}
        answer = client.post(f"/api/v1/poses/{pose_id}/reviews", json=body)
        assert answer.json()["comment"] == kept


def test_the_same_key_gives_the_same_verdict(client: TestClient, pose_id: int) -> None:
    """A verdict sent again after a lost answer is one verdict; another under its key is refused."""
    url, key = f"/api/v1/poses/{pose_id}/reviews", {"Idempotency-Key": "pose-1"}
    first, second = (client.post(url, json={"grade": "good"}, headers=key) for _ in range(2))
    assert second.status_code == 201
    assert second.json() == first.json()
    assert second.headers["idempotency-replayed"] == "true"
    assert client.post(url, json={"grade": "bad"}, headers=key).status_code == 422
    assert len(reviews(client, pose_id)) == 1


def test_who_only_looks_does_not_grade(
    pose_id: int, client_of: Callable[..., TestClient], make_user: Callable[..., User]
) -> None:
    """A viewer, and a token without the scope, read verdicts and give none."""
    viewer = client_of(make_user("viewer"))
    token = client_of(make_user("admin"), Scope.READ)
    for client in (viewer, token):
        answer = client.post(f"/api/v1/poses/{pose_id}/reviews", json={"grade": "good"})
        assert answer.status_code == 403
        assert reviews(client, pose_id) == []


def test_verdicts_are_summed_up_by_those_that_count(
    database: Database, harbour: Harbour, make_user: Callable[..., User]
) -> None:
    """A run's summary counts each pose once; a second opinion does not overrule the first."""
    ada, ben = make_user("reviewer"), make_user("reviewer")
    with database.writing() as session:
        run, other = make_run(session, harbour, [4]), make_run(session, harbour, [1])
        poses = session.scalars(sa.select(Pose.id).where(Pose.run_id == run.id)).all()
        for person, pose, grade in (
            (ada, poses[0], Grade.GOOD),
            (ben, poses[0], Grade.GOOD),
            (ada, poses[1], Grade.GOOD),
            (ben, poses[1], Grade.OK),
            (ada, poses[2], Grade.BAD),
        ):
            grading.grade_pose(session, pose, person.id, Verdict(grade=grade))
    with database.reading() as session:
        found = service.verdicts_by_run(session, [run.id, other.id])
    verdicts = found[run.id]
    assert (verdicts.poses, verdicts.graded) == (4, 3)
    assert verdicts.counts == {Grade.GOOD: 2, Grade.BAD: 1}
    assert verdicts.good == pytest.approx(2 / 3)
    assert verdicts.acceptable == pytest.approx(2 / 3)
    assert verdicts.good_interval[0] < 2 / 3 < verdicts.good_interval[1]
    assert (found[other.id].poses, found[other.id].good) == (1, None)


def test_a_person_who_leaves_takes_no_verdict_along(
    client: TestClient, database: Database, pose_id: int, make_user: Callable[..., User]
) -> None:
    """Verdicts outlive the account they were given under, without a name."""
    people = [make_user("reviewer"), make_user("reviewer")]
    with database.writing() as session:
        for person in people:
            grading.grade_pose(session, pose_id, person.id, Verdict(grade=Grade.GOOD))
    with database.writing() as session:
        session.execute(sa.delete(User).where(User.id.in_([person.id for person in people])))
    left = reviews(client, pose_id)
    assert [(review["grade"], review["user"]) for review in left] == [("good", None)] * 2
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Review)) == 2
