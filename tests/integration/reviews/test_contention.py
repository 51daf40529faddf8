"""Many reviewers draw from one queue at once: no item twice, none lost, nobody stuck.

QUAYMARK_CONTENTION=full runs twenty people over five hundred grades each; the usual size proves the
same on the same code in a few seconds.
"""

import os
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import User
from app.tables.queues import ReviewQueueItem
from app.tables.reviews import Review
from app.tables.runs import Pose
from tests.factories.runs import FIRST_MMSI, Harbour, make_pose, make_run

API = "/api/v1"
FULL = os.environ.get("QUAYMARK_CONTENTION") == "full"
PEOPLE, EACH = (20, 500) if FULL else (8, 5)


@pytest.fixture
def people(
    client_of: Callable[..., TestClient], make_user: Callable[..., User]
) -> list[TestClient]:
    """Give many reviewers."""
    return [client_of(make_user("reviewer")) for _ in range(PEOPLE)]


def queue_of(
    database: Database, harbour: Harbour, client: TestClient, poses: int, **choice: Any
) -> str:
    """Make a run with so many poses and a queue of them; returns the queue's address."""
    with database.writing() as session:
        run = make_run(session, harbour, [])
        for number in range(poses):
            image = harbour.images[number % len(harbour.images)]
            make_pose(session, run, image, FIRST_MMSI + number)
    queue = client.post(f"{API}/review-queues", json={"run_id": run.id, **choice}).json()
    return f"{API}/review-queues/{queue['id']}"


def work(client: TestClient, url: str, at_once: int) -> list[tuple[int, int, bool]]:
    """Take and grade until nothing is free; returns (pose, item, second opinion) of each grade."""
    done = []
    while True:
        answer = client.post(f"{url}/next", json={"count": at_once})
        if answer.status_code == 204:
            return done
        assert answer.status_code == 200, answer.text
        for item in answer.json()["items"]:
            graded = client.post(
                f"{API}/poses/{item['pose_id']}/reviews",
                json={"grade": "good", "seconds": 1},
                headers={"Idempotency-Key": f"{item['id']} {item['leased_until']}"},
            )
            assert graded.status_code == 201, graded.text
            done.append((item["pose_id"], item["id"], graded.json()["second_opinion"]))


def standing(database: Database) -> list[tuple[int, int]]:
    """Return (pose, person) of all standing reviews."""
    with database.reading() as session:
        rows = session.execute(
            sa.select(Review.pose_id, Review.user_id).where(Review.replaced_at.is_(None))
        )
        return [(row[0], row[1]) for row in rows]


def test_nobody_gets_what_another_holds(
    database: Database, harbour: Harbour, people: list[TestClient]
) -> None:
    """Every pose is offered once, graded once, by nobody a second time, and the queue is done."""
    url = queue_of(database, harbour, people[0], PEOPLE * EACH)
    with ThreadPoolExecutor(PEOPLE) as pool:
        done = [part for parts in pool.map(lambda one: work(one, url, 3), people) for part in parts]
    poses = Counter(pose for pose, _, _ in done)
    assert len(poses) == PEOPLE * EACH
    assert set(poses.values()) == {1}
    assert not any(second for _, _, second in done)
    assert Counter(pose for pose, _ in standing(database)) == poses
    progress = people[0].get(f"{url}/progress").json()
    assert (progress["remaining"], progress["leased"]) == (0, 0)


def test_double_review_gives_everything_to_two(
    database: Database, harbour: Harbour, people: list[TestClient]
) -> None:
    """Every pose has the standing verdicts of two different people, one a second opinion."""
    url = queue_of(database, harbour, people[0], EACH * 2, double=True)
    with ThreadPoolExecutor(PEOPLE) as pool:
        done = [part for parts in pool.map(lambda one: work(one, url, 2), people) for part in parts]
    found = standing(database)
    assert len(set(found)) == len(found) == EACH * 4
    assert set(Counter(pose for pose, _ in found).values()) == {2}
    assert len({item for _, item, _ in done}) == EACH * 4
    assert Counter(second for _, _, second in done) == {False: EACH * 2, True: EACH * 2}
    with database.reading() as session:
        items = session.execute(sa.select(ReviewQueueItem.user_id, ReviewQueueItem.pose_id))
        assert sorted((row[1], row[0]) for row in items) == sorted(found)


def test_all_at_one_pose_stand_in_line(
    database: Database, harbour: Harbour, people: list[TestClient]
) -> None:
    """Of many who grade and undo the same poses at once, one comes first, none is lost or stuck."""
    with database.writing() as session:
        make_run(session, harbour, [2])
        ids = list(session.scalars(sa.select(Pose.id).order_by(Pose.id)))

    def grade(one: TestClient) -> None:
        for pose_id in (*ids, *reversed(ids)):
            url = f"{API}/poses/{pose_id}/reviews"
            first = one.post(url, json={"grade": "ok"}).json()
            assert one.post(url, json={"grade": "good"}).status_code == 201
            assert one.delete(f"{API}/decisions/{first['decision']}").status_code == 200

    with ThreadPoolExecutor(PEOPLE) as pool:
        list(pool.map(grade, people))
    found = standing(database)
    assert len(set(found)) == len(found) == PEOPLE * len(ids)
    with database.reading() as session:
        first = session.execute(
            sa.select(Review.pose_id, sa.func.count())
            .where(Review.replaced_at.is_(None), Review.second_opinion.is_(False))
            .group_by(Review.pose_id)
        )
        assert {row[0]: row[1] for row in first} == dict.fromkeys(ids, 1)
