"""The matching table from database rows, over REST."""

import csv
import io
from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.db import Database, now
from app.domain.matching_table import LABELS, Result
from app.evaluation.published import PAPER_ROWS
from app.tables.identity import Role, User
from app.tables.queues import QueueOrder, QueueUnit, ReviewQueue, ReviewQueueItem
from app.tables.reviews import Grade, MissedReason
from tests.factories.many import complete_many, grade_many, make_large_run, miss_many
from tests.factories.runs import make_harbour, make_pose, make_review, make_run
from tests.integration.conftest import MakeUser

MATCHING = "/api/v1/evaluation/matching"


def _paper_review(database: Database, reviewer: User) -> int:
    """Store what the paper's reviewers found: 434 poses and 147 missed vessels in 500 images."""
    verdicts: list[tuple[Grade, tuple[str, ...]]] = []
    missed: dict[MissedReason, int] = {}
    for name, row in PAPER_ROWS.items():
        if name not in LABELS:
            continue
        if name.result is Result.CORRECT:
            verdicts += [(Grade(name.reason), ())] * row.count
        elif name.result is Result.WRONG:
            verdicts += [(Grade.WRONG, (name.reason,))] * row.count
        else:
            missed[MissedReason(name.reason)] = row.count
    with database.writing() as session:
        run, image_ids, pose_ids = make_large_run(session, images=500, poses=len(verdicts))
        grade_many(session, pose_ids, verdicts, reviewer.id)
        complete_many(session, run.id, image_ids)
        miss_many(session, run.id, image_ids[7], missed)
        return run.id


def test_the_papers_reviews_give_the_papers_table(
    client: TestClient, database: Database, admin: User
) -> None:
    """From rows of reviews and missed vessels come all counts and percentages of the paper."""
    run_id = _paper_review(database, admin)
    answer = client.get(MATCHING, params={"run_id": run_id}).json()
    assert answer["images_complete"] == answer["images"] == 500
    assert answer["denominators"]["visible_vessels"]["count"] == 581
    assert answer["denominators"]["annotations"]["count"] == 434
    for row in answer["rows"]:
        if row["paper"] is None:
            assert row["count"] == 0
        else:
            assert {key: row[key] for key in row["paper"]} == row["paper"]
    assert len([row for row in answer["rows"] if row["paper"]]) == len(PAPER_ROWS)
    assert answer["correct_of_visible"]["share"] == pytest.approx(410 / 581)
    assert answer["correct_without_false_positives"]["total"] == 579


def test_the_table_comes_as_csv_with_its_denominators(
    client: TestClient, database: Database, admin: User
) -> None:
    """The CSV has a line a row, the paper's figures beside ours, and both denominators."""
    run_id = _paper_review(database, admin)
    answer = client.get(MATCHING, params={"run_id": run_id, "format": "csv"})
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    lines = {
        (line["result"], line["reason"]): line for line in csv.DictReader(io.StringIO(answer.text))
    }
    correct = lines["correct", "total"]
    assert (correct["count"], correct["percent_of_visible"]) == ("410", "70.56")
    assert correct["paper_percent_of_annotations"] == "94.47"
    assert lines["no_match", "no_ais"]["percent_of_annotations"] == ""
    assert lines["denominator", "visible_vessels"]["count"] == "581"
    assert lines["denominator", "annotations"]["count"] == "434"


def test_only_complete_images_and_standing_verdicts_count(
    client: TestClient, database: Database, admin: User, make_user: MakeUser
) -> None:
    """Left out: images not complete, replaced verdicts, second opinions, poses made by hand."""
    other = make_user(Role.REVIEWER)
    with database.writing() as session:
        harbour = make_harbour(session, images=2)
        run = make_run(session, harbour, (3, 1))
        first, second = harbour.images
        poses = [
            make_pose(session, run, first, mmsi, person_made=mmsi == 4) for mmsi in (1, 2, 3, 4)
        ]
        make_review(session, poses[0], admin.id, Grade.BAD, replaced_at=now())
        make_review(session, poses[0], admin.id, Grade.GOOD)
        make_review(session, poses[0], other.id, Grade.WRONG, second_opinion=True)
        make_review(session, poses[1], admin.id, Grade.WRONG)
        make_review(
            session, poses[2], admin.id, Grade.WRONG, reasons=["subvessel", "cost_function"]
        )
        make_review(session, poses[3], admin.id, Grade.OK)
        make_review(session, make_pose(session, run, second, 9), admin.id, Grade.OK)
        complete_many(session, run.id, [first.id])
        miss_many(session, run.id, first.id, {MissedReason.NO_AIS: 2})
        miss_many(session, run.id, second.id, {MissedReason.NEITHER: 5})
    answer = client.get(MATCHING, params={"run_id": run.id}).json()
    counts = {(row["result"], row["reason"]): row["count"] for row in answer["rows"]}
    assert {name: count for name, count in counts.items() if count and name[1] != "total"} == {
        ("correct", "good"): 1,
        ("wrong", "not_given"): 1,
        ("wrong", "subvessel"): 1,
        ("no_match", "no_ais"): 2,
    }
    assert (answer["images_complete"], answer["images"], answer["poses_ungraded"]) == (1, 2, 3)


def _two_sites(database: Database, reviewer: User) -> tuple[int, int, int]:
    """Store a complete image of one Good pose on each of two sites; return sites and a run."""
    site_ids, run_ids = [], []
    with database.writing() as session:
        for _ in range(2):
            run, image_ids, pose_ids = make_large_run(session, images=1, poses=1)
            grade_many(session, pose_ids, [(Grade.GOOD, ())], reviewer.id)
            complete_many(session, run.id, image_ids)
            site_ids.append(run.site_id)
            run_ids.append(run.id)
    return site_ids[0], site_ids[1], run_ids[1]


def test_nobody_counts_what_they_may_not_read(
    database: Database, admin: User, make_user: MakeUser, client_of: Callable[..., TestClient]
) -> None:
    """A reader of one site gets that site's table, and another site's run is not there for them."""
    own, foreign, foreign_run = _two_sites(database, admin)
    reader = client_of(make_user(Role.VIEWER, own))
    assert reader.get(MATCHING).json()["denominators"]["visible_vessels"]["count"] == 1
    assert reader.get(MATCHING, params={"run_id": foreign_run}).status_code == 404
    assert reader.get(MATCHING, params={"site_id": foreign}).status_code == 404


def test_a_sample_of_images_says_its_seed(
    client: TestClient, database: Database, admin: User
) -> None:
    """Limited to a queue, only its images count, and a random one tells size and seed."""
    with database.writing() as session:
        run, image_ids, pose_ids = make_large_run(session, images=4, poses=4)
        grade_many(session, pose_ids, [(Grade.GOOD, ())] * 4, admin.id)
        complete_many(session, run.id, image_ids)
        queue = ReviewQueue(
            run_id=run.id,
            unit=QueueUnit.IMAGE,
            order=QueueOrder.RANDOM,
            sample=2,
            seed=4711,
            double=False,
        )
        session.add(queue)
        session.flush()
        session.add_all(
            ReviewQueueItem(queue_id=queue.id, position=position, image_id=image_id)
            for position, image_id in enumerate(image_ids[:2])
        )
    answer = client.get(MATCHING, params={"queue_id": queue.id}).json()
    assert (answer["images_complete"], answer["images"]) == (2, 2)
    assert answer["sample"]["is_random"] is True
    assert answer["sample"]["description"] == "random sample of 2 images, seed 4711"


def test_a_sample_of_poses_is_refused(client: TestClient, database: Database) -> None:
    """Visible vessels cannot be counted from a sample of poses; the answer names the field."""
    with database.writing() as session:
        run, _, _ = make_large_run(session, images=1, poses=1)
        queue = ReviewQueue(
            run_id=run.id, unit=QueueUnit.POSE, order=QueueOrder.RANDOM, seed=1, double=False
        )
        session.add(queue)
    answer = client.get(MATCHING, params={"queue_id": queue.id})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "queue_id"


def test_filters_narrow_by_time_and_refuse_nonsense(
    client: TestClient, database: Database, admin: User
) -> None:
    """`from` and `to` limit the images' times; a span without any time in it is refused."""
    with database.writing() as session:
        run, image_ids, pose_ids = make_large_run(session, images=3, poses=3)
        grade_many(session, pose_ids, [(Grade.GOOD, ())] * 3, admin.id)
        complete_many(session, run.id, image_ids)
    span = {"from": "2026-11-22T12:01:00Z", "to": "2026-11-22T12:02:00Z"}
    assert client.get(MATCHING, params=span).json()["images_complete"] == 1
    turned = client.get(MATCHING, params={"from": span["to"], "to": span["from"]})
    assert turned.status_code == 422
    assert turned.json()["errors"][0]["field"] == "to"


def test_the_table_follows_what_a_reviewer_does(client: TestClient, database: Database) -> None:
    """Grades, a missed vessel and "image complete" over REST make the table; undoing empties it."""
    with database.writing() as session:
        run, (image_id,), pose_ids = make_large_run(session, images=1, poses=2)
    api, on_run = "/api/v1", {"run_id": run.id}
    wrong = {"grade": "wrong", "reasons": ["missing_ais"]}
    for pose_id, verdict in zip(pose_ids, ({"grade": "ok"}, wrong), strict=True):
        client.post(f"{api}/poses/{pose_id}/reviews", json=verdict).raise_for_status()
    box = {"x1_px": 1, "y1_px": 2, "x2_px": 9, "y2_px": 8, "reason": "cost_too_high"}
    client.post(f"{api}/images/{image_id}/missed-vessels", json=on_run | box).raise_for_status()
    assert client.get(MATCHING, params=on_run).json()["images_complete"] == 0
    client.post(f"{api}/images/{image_id}/complete", json=on_run).raise_for_status()
    answer = client.get(MATCHING, params=on_run).json()
    counts = {row["reason"]: row["count"] for row in answer["rows"] if row["reason"] != "total"}
    assert {reason: count for reason, count in counts.items() if count} == {
        "ok": 1,
        "missing_ais": 1,
        "cost_too_high": 1,
    }
    assert answer["correct_of_visible"]["share"] == pytest.approx(1 / 3)
    client.delete(f"{api}/images/{image_id}/complete", params=on_run).raise_for_status()
    assert client.get(MATCHING, params=on_run).json()["denominators"]["annotations"]["count"] == 0
