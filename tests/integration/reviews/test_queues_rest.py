"""Review queues over REST: orders, samples, leases, double review, progress."""

from collections.abc import Callable
from datetime import timedelta
from typing import Any, Protocol

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database, now
from app.tables.imagery import Image
from app.tables.queues import ReviewQueueItem
from app.tables.runs import Match, Pose, Run
from tests.factories.runs import Harbour, make_pose

API = "/api/v1"
QUEUES = f"{API}/review-queues"


class MakePoses(Protocol):
    """Stores a run; returns its id and those of its poses in order."""

    def __call__(self, *poses_per_image: int) -> tuple[int, list[int]]:
        """Put so many poses into each image."""


def queue_of(client: TestClient, run_id: int, **choice: object) -> dict[str, Any]:
    """Make a queue and return it."""
    answer = client.post(QUEUES, json={"run_id": run_id, **choice})
    assert answer.status_code in {200, 201}, answer.text
    found: dict[str, Any] = answer.json()
    return found


def take(client: TestClient, queue: dict[str, Any], **wanted: object) -> list[dict[str, Any]]:
    """Return what the queue gives next; nothing for 204."""
    answer = client.post(f"{QUEUES}/{queue['id']}/next", json=wanted)
    if answer.status_code == 204:
        return []
    assert answer.status_code == 200, answer.text
    found = answer.json()
    return found["items"] if "count" in wanted else [found]


def poses_of(items: list[dict[str, Any]]) -> list[int]:
    """Return which poses items are about."""
    return [item["pose_id"] for item in items]


def grade(client: TestClient, pose_id: int, grade: str = "good") -> dict[str, Any]:
    """Grade a pose."""
    answer = client.post(f"{API}/poses/{pose_id}/reviews", json={"grade": grade})
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def progress(client: TestClient, queue: dict[str, Any]) -> dict[str, int]:
    """Return how far a queue is."""
    found: dict[str, int] = client.get(f"{QUEUES}/{queue['id']}/progress").json()
    return found


def let_leases_run_out(database: Database) -> None:
    """Put the end of all leases into the past."""
    with database.writing() as session:
        session.execute(
            sa.update(ReviewQueueItem)
            .where(ReviewQueueItem.leased_until.is_not(None))
            .values(leased_until=now() - timedelta(seconds=1))
        )


def test_a_queue_leads_through_a_run_in_time(ada: TestClient, run_with: MakePoses) -> None:
    """Each call gives the next ungraded pose with all there is to see; at the end comes 204."""
    run_id, ids = run_with(2, 1)
    grade(ada, ids[1])
    answer = ada.post(QUEUES, json={"run_id": run_id})
    queue = answer.json()
    assert answer.status_code == 201
    assert answer.headers["location"] == f"{QUEUES}/{queue['id']}"
    assert (queue["seed"], queue["is_random_sample"]) == (None, False)
    assert (queue["progress"]["total"], queue["progress"]["done"]) == (3, 1)
    item = take(ada, queue)[0]
    assert (item["pose_id"], item["unit"], item["run_id"]) == (ids[0], "pose", run_id)
    assert item["pose"] == ada.get(f"{API}/poses/{ids[0]}").json()
    assert item["image"] == item["pose"]["image"]
    grade(ada, ids[0])
    assert poses_of(take(ada, queue)) == [ids[2]]
    assert take(ada, queue) == []
    shown = progress(ada, queue)
    assert (shown["done"], shown["leased"], shown["remaining"]) == (2, 1, 1)
    assert (shown["mine_done"], shown["mine_leased"], shown["units_done"]) == (2, 1, 2)


def test_two_people_never_hold_the_same(
    ada: TestClient, ben: TestClient, run_with: MakePoses, database: Database
) -> None:
    """What one holds the other does not get, until the lease has run out or was given up."""
    run_id, ids = run_with(3)
    queue = queue_of(ada, run_id)
    mine = take(ada, queue, count=2)
    assert poses_of(mine) == ids[:2]
    assert poses_of(take(ben, queue)) == ids[2:]
    assert take(ben, queue) == []
    released = ada.post(f"{QUEUES}/{queue['id']}/release", json={"items": [mine[0]["id"]]})
    assert released.status_code == 204
    assert poses_of(take(ben, queue)) == ids[:1]
    let_leases_run_out(database)
    assert poses_of(take(ben, queue, count=50)) == ids


def test_a_lease_is_extended_while_it_lasts(
    ada: TestClient, ben: TestClient, run_with: MakePoses, database: Database
) -> None:
    """Who is active holds on; who comes too late learns that the item is no longer theirs."""
    run_id, _ = run_with(2)
    queue = queue_of(ada, run_id)
    item = take(ada, queue)[0]
    url = f"{QUEUES}/{queue['id']}/extend"
    held = ada.post(url, json={"items": [item["id"]]}).json()["items"]
    assert held[0]["id"] == item["id"]
    assert held[0]["leased_until"] > item["leased_until"]
    assert ben.post(url).json() == {"items": []}
    let_leases_run_out(database)
    assert ada.post(url).json() == {"items": []}


def test_after_a_reload_one_resumes(ada: TestClient, run_with: MakePoses) -> None:
    """What one holds comes first when asked for, and new items fill it up."""
    run_id, ids = run_with(4)
    queue = queue_of(ada, run_id)
    take(ada, queue, count=2)
    assert poses_of(take(ada, queue, count=3, resume=True)) == ids[:3]
    assert poses_of(take(ada, queue, count=3)) == ids[3:]


def test_a_late_grade_counts_if_nobody_was_faster(
    ada: TestClient, ben: TestClient, run_with: MakePoses, database: Database
) -> None:
    """With the lease lost it is still taken: as the verdict, or else as a second opinion."""
    run_id, ids = run_with(2)
    queue = queue_of(ada, run_id)
    take(ada, queue, count=2)
    let_leases_run_out(database)
    take(ben, queue, count=2)
    assert grade(ada, ids[0])["second_opinion"] is False
    assert grade(ben, ids[0], "bad")["second_opinion"] is True
    assert grade(ben, ids[1])["second_opinion"] is False
    assert grade(ada, ids[1])["second_opinion"] is True
    assert progress(ada, queue)["remaining"] == 0


def test_undo_gives_the_item_back_to_its_person(
    ada: TestClient, ben: TestClient, run_with: MakePoses
) -> None:
    """What was taken back is open again, and held by who took it back."""
    run_id, ids = run_with(1)
    queue = queue_of(ada, run_id)
    take(ada, queue)
    ada.delete(f"{API}/decisions/{grade(ada, ids[0])['decision']}")
    assert progress(ada, queue)["mine_leased"] == 1
    assert take(ben, queue) == []
    assert poses_of(take(ada, queue, count=1, resume=True)) == ids


def test_double_review_needs_two_people(
    ada: TestClient, ben: TestClient, client: TestClient, run_with: MakePoses
) -> None:
    """Every pose goes to two people and to nobody twice; a third gets nothing."""
    run_id, ids = run_with(2)
    queue = queue_of(ada, run_id, double=True)
    assert (queue["progress"]["total"], queue["progress"]["units"]) == (4, 2)
    assert poses_of(take(ada, queue, count=9)) == ids
    assert take(ada, queue) == []
    assert poses_of(take(ben, queue, count=9)) == ids
    assert take(client, queue) == []
    for pose_id in ids:
        grade(ada, pose_id)
    assert take(ada, queue) == []
    grade(ben, ids[0])
    shown = progress(ben, queue)
    assert (shown["done"], shown["units_done"], shown["mine_done"]) == (3, 1, 1)


def test_double_review_counts_who_graded_before(
    ada: TestClient, ben: TestClient, run_with: MakePoses
) -> None:
    """A pose that one person has graded already wants another person only."""
    run_id, ids = run_with(1)
    grade(ada, ids[0])
    queue = queue_of(ada, run_id, double=True)
    assert (queue["progress"]["done"], queue["progress"]["total"]) == (1, 2)
    assert take(ada, queue) == []
    assert poses_of(take(ben, queue)) == ids


def test_a_sample_can_be_drawn_again(ada: TestClient, run_with: MakePoses) -> None:
    """The same seed and run give the same sample, whatever was graded; a chosen seed is told."""
    run_id, ids = run_with(20, 20)
    first = queue_of(ada, run_id, order="random", sample=10)
    assert 0 <= first["seed"] < 2**31
    assert first["is_random_sample"] is True
    assert first["description"] == f"Random sample of 10 poses, seed {first['seed']}"
    drawn = poses_of(take(ada, first, count=50))
    for pose_id in drawn[:5]:
        grade(ada, pose_id)
    again = queue_of(ada, run_id, order="random", sample=10, seed=first["seed"])
    assert (again["progress"]["total"], again["progress"]["done"]) == (10, 5)
    assert poses_of(take(ada, again, count=50)) == drawn[5:]
    in_time = queue_of(ada, run_id, order="time", sample=10, seed=first["seed"])
    assert poses_of(take(ada, in_time, count=50)) == sorted(drawn[5:])
    other = queue_of(ada, run_id, order="random", sample=10, seed=first["seed"] ^ 1)
    assert poses_of(take(ada, other, count=50)) != drawn
    assert set(drawn) < set(ids)


def test_a_sample_of_images_has_those_without_poses(
    ada: TestClient, run_with: MakePoses, harbour: Harbour
) -> None:
    """Images come with all their poses, also with none; they are done when they are complete."""
    run_id, ids = run_with(2, 0, 1)
    queue = queue_of(ada, run_id, unit="image", order="time")
    items = take(ada, queue, count=9)
    assert [item["image_id"] for item in items] == [image.id for image in harbour.images]
    assert [poses_of([{"pose_id": p["id"]} for p in item["poses"]]) for item in items] == [
        ids[:2],
        [],
        ids[2:],
    ]
    assert items[1]["image"]["file_name"] == harbour.images[1].file_name
    assert {item["pose_id"] for item in items} == {None}


def test_doubtful_poses_come_first(
    ada: TestClient, run_with: MakePoses, database: Database
) -> None:
    """A pose of high cost and one with a grave flag come before the others."""
    run_id, ids = run_with(4)
    with database.writing() as session:
        dear, flagged = session.get_one(Pose, ids[2]), session.get_one(Pose, ids[3])
        session.get_one(Match, dear.match_id).cost = 0.45
        flagged.flags = ["no_height"]
    queue = queue_of(ada, run_id, order="uncertain")
    assert poses_of(take(ada, queue, count=9)) == [ids[3], ids[2], ids[0], ids[1]]
    short = queue_of(ada, run_id, order="uncertain", sample=1)
    assert (short["is_random_sample"], short["progress"]["total"]) == (False, 1)


def test_disagreements_are_settled_through_their_queue(
    ada: TestClient, ben: TestClient, client: TestClient, run_with: MakePoses
) -> None:
    """Only poses in dispute are in it, and a grade given there ends the dispute."""
    run_id, ids = run_with(3)
    for pose_id, grades in zip(ids, (("good", "bad"), ("ok", "ok"), ("bad", "ok")), strict=True):
        grade(ada, pose_id, grades[0])
        grade(ben, pose_id, grades[1])
    queue = queue_of(client, run_id, order="disagreement")
    assert poses_of(take(client, queue, count=9)) == [ids[0], ids[2]]
    assert grade(client, ids[0], "bad")["settles"] is True
    assert client.get(f"{API}/poses/{ids[0]}").json()["review"]["grade"] == "bad"
    left = client.get(f"{API}/poses", params={"run_id": run_id, "state": "disagreement"}).json()
    assert [pose["id"] for pose in left["items"]] == [ids[2]]


def test_second_opinions_come_from_others(
    ada: TestClient, ben: TestClient, run_with: MakePoses
) -> None:
    """Poses graded by one person are offered to anybody else; a second thought is none."""
    run_id, ids = run_with(3)
    for pose_id in ids[:2]:
        grade(ada, pose_id)
    queue = queue_of(ben, run_id, order="second_opinion")
    assert take(ada, queue) == []
    grade(ada, ids[0], "bad")
    assert poses_of(take(ben, queue, count=9)) == ids[:2]
    assert grade(ben, ids[0])["second_opinion"] is True
    assert progress(ben, queue)["done"] == 1


def test_one_click_finds_the_same_queue_again(
    ada: TestClient, ben: TestClient, run_with: MakePoses, database: Database, harbour: Harbour
) -> None:
    """With `reuse` two people share one queue of a run, and poses made since are in it."""
    run_id, _ = run_with(1)
    first = queue_of(ada, run_id, reuse=True)
    grade(ada, take(ada, first)[0]["pose_id"])
    with database.writing() as session:
        run = session.get_one(Run, run_id)
        added = make_pose(session, run, harbour.images[1]).id
    second = ben.post(QUEUES, json={"run_id": run_id, "reuse": True})
    assert (second.status_code, second.json()["id"]) == (200, first["id"])
    assert (second.json()["progress"]["done"], second.json()["progress"]["total"]) == (1, 2)
    assert poses_of(take(ben, first)) == [added]
    assert queue_of(ben, run_id, reuse=True, order="uncertain")["id"] != first["id"]


def test_deleted_images_leave_the_queue(
    ada: TestClient, run_with: MakePoses, database: Database, harbour: Harbour
) -> None:
    """Poses of a deleted image are neither offered nor counted."""
    run_id, ids = run_with(1, 1)
    queue = queue_of(ada, run_id)
    with database.writing() as session:
        session.get_one(Image, harbour.images[0].id).deleted_at = now()
    assert poses_of(take(ada, queue, count=9)) == ids[1:]
    assert progress(ada, queue)["total"] == 1


@pytest.mark.parametrize(
    ("choice", "field"),
    [
        ({"order": "newest"}, "order"),
        ({"sample": 0}, "sample"),
        ({"seed": -1}, "seed"),
        ({"unit": "vessel"}, "unit"),
        ({"order": "disagreement", "double": True}, "double"),
        ({"surplus": 1}, "surplus"),
    ],
)
def test_a_wrong_choice_is_named(
    ada: TestClient, run_with: MakePoses, choice: dict[str, object], field: str
) -> None:
    """A queue that cannot be is refused with the field at fault."""
    run_id, _ = run_with(1)
    answer = ada.post(QUEUES, json={"run_id": run_id, **choice})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, field)


def test_queues_are_listed_and_removed_by_who_may(
    ada: TestClient, ben: TestClient, client: TestClient, run_with: MakePoses
) -> None:
    """A run's queues are listed; their maker and an administrator remove them, nobody else."""
    run_id, ids = run_with(1)
    mine, other = queue_of(ada, run_id), queue_of(ada, run_id, order="random", seed=4)
    grade(ada, ids[0])
    listed = ben.get(QUEUES, params={"run_id": run_id}).json()["items"]
    assert [queue["id"] for queue in listed] == [mine["id"], other["id"]]
    assert ben.delete(f"{QUEUES}/{mine['id']}").status_code == 403
    assert ada.delete(f"{QUEUES}/{mine['id']}").status_code == 204
    assert client.delete(f"{QUEUES}/{other['id']}").status_code == 204
    assert ben.get(f"{QUEUES}/{mine['id']}").status_code == 404
    assert ben.get(f"{API}/poses/{ids[0]}").json()["review"]["grade"] == "good"


def test_who_only_looks_gets_no_lease(
    ada: TestClient, client_of: Callable[..., TestClient], make_user: Any, run_with: MakePoses
) -> None:
    """A viewer sees queues and their progress, and takes nothing."""
    run_id, _ = run_with(1)
    queue = queue_of(ada, run_id)
    viewer = client_of(make_user("viewer"))
    assert viewer.get(f"{QUEUES}/{queue['id']}").json()["id"] == queue["id"]
    assert viewer.post(f"{QUEUES}/{queue['id']}/next").status_code == 403
    assert viewer.post(QUEUES, json={"run_id": run_id}).status_code == 403
