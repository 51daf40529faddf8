"""Twenty people grade at once: no verdict is lost, none is doubled."""

from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import User
from app.tables.reviews import Review
from app.tables.runs import Pose
from tests.factories.runs import Harbour, make_run

PEOPLE = 20
POSES = 4
ROUNDS = 2
GRADES = ("good", "ok")


@pytest.fixture
def pose_ids(database: Database, harbour: Harbour) -> list[int]:
    """Give a few poses."""
    with database.writing() as session:
        make_run(session, harbour, [POSES])
        return list(session.scalars(sa.select(Pose.id).order_by(Pose.id)))


def test_twenty_people_lose_and_double_nothing(
    database: Database,
    pose_ids: list[int],
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Each grades every pose twice; each has one standing verdict on each, and both are kept."""
    clients = [client_of(make_user("reviewer")) for _ in range(PEOPLE)]

    def grade_all(client: TestClient) -> list[int]:
        return [
            client.post(
                f"/api/v1/poses/{pose_id}/reviews",
                json={"grade": grade},
                headers={"Idempotency-Key": f"{pose_id} {grade}"},
            ).status_code
            for grade in GRADES
            for pose_id in pose_ids
        ]

    with ThreadPoolExecutor(PEOPLE) as pool:
        answers = [status for statuses in pool.map(grade_all, clients) for status in statuses]
    assert Counter(answers) == {201: PEOPLE * POSES * ROUNDS}
    with database.reading() as session:
        rows = session.execute(
            sa.select(
                Review.user_id,
                Review.pose_id,
                sa.func.count(),
                sa.func.count(Review.replaced_at),
            ).group_by(Review.user_id, Review.pose_id)
        ).all()
    assert len(rows) == PEOPLE * POSES
    assert {(row[2], row[3]) for row in rows} == {(ROUNDS, ROUNDS - 1)}


def test_one_person_in_two_windows_never_conflicts(
    database: Database, pose_ids: list[int], client: TestClient
) -> None:
    """The same person's verdicts on one pose at the same time queue up instead of failing."""

    def grade(number: int) -> int:
        body = {"grade": GRADES[number % 2]}
        return client.post(f"/api/v1/poses/{pose_ids[0]}/reviews", json=body).status_code

    with ThreadPoolExecutor(8) as pool:
        assert Counter(pool.map(grade, range(16))) == {201: 16}
    with database.reading() as session:
        standing = session.scalars(sa.select(Review).where(Review.replaced_at.is_(None))).all()
    assert len(standing) == 1
