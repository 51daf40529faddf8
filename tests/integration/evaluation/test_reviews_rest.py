"""Figures of review, agreement and progress from database rows, over REST."""

import csv
import io
from collections.abc import Callable
from datetime import timedelta
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.db import Database, now
from app.tables.identity import Role, User
from app.tables.reviews import Grade
from app.tables.runs import Pose, Run
from tests.factories.many import complete_many, grade_many, make_large_run
from tests.factories.runs import (
    FIRST_MMSI,
    make_harbour,
    make_pose,
    make_review,
    make_run,
    make_vessel,
)
from tests.integration.conftest import MakeUser

REVIEWS = "/api/v1/evaluation/reviews"
PROGRESS = "/api/v1/evaluation/review-progress"
PLAIN: tuple[str, ...] = ()


def _graded_run(database: Database, reviewer: User) -> Run:
    """Store ten poses: 6 Good, 2 OK for their heading, 1 Bad, 1 not graded."""
    verdicts = [(Grade.GOOD, PLAIN)] * 6 + [(Grade.OK, ("heading",))] * 2 + [(Grade.BAD, PLAIN)]
    with database.writing() as session:
        run, _, pose_ids = make_large_run(session, images=5, poses=10)
        grade_many(session, pose_ids[:9], verdicts, reviewer.id)
    return run


def test_shares_come_with_counts_reasons_and_intervals(
    client: TestClient, database: Database, admin: User
) -> None:
    """Good is 6 of 9 and acceptable 8 of 9, each with Wilson's interval and its denominator."""
    run = _graded_run(database, admin)
    answer = client.get(REVIEWS, params={"run_id": run.id}).json()
    assert (answer["poses"], answer["graded"], answer["ungraded"]) == (10, 9, 1)
    assert answer["grades"] == {"good": 6, "ok": 2, "bad": 1, "wrong": 0}
    assert answer["reasons"] == {"ok": {"heading": 2}}
    assert (answer["good"]["count"], answer["good"]["total"]) == (6, 9)
    assert answer["good"]["interval"] == pytest.approx([0.3542, 0.8794], abs=5e-4)
    assert answer["acceptable"]["count"] == 8
    assert answer["guideline_versions"] == {"1": 9}
    assert answer["sample"] is None


def test_a_wanted_width_says_how_many_more(
    client: TestClient, database: Database, admin: User
) -> None:
    """A narrower interval needs more grades; of a finite run never more than it has left."""
    run = _graded_run(database, admin)
    wide, narrow = (
        client.get(REVIEWS, params={"run_id": run.id, "half_width": width}).json()["wanted"]
        for width in (0.1, 0.02)
    )
    assert 0 < wide["good"]["more_of_many"] < narrow["good"]["more_of_many"]
    assert narrow["good"]["more_of_these"] == 1
    assert client.get(REVIEWS, params={"half_width": 0.5}).status_code == 422


def test_poses_are_split_by_type_range_heading_and_run(
    client: TestClient, database: Database, admin: User
) -> None:
    """Groups hold every pose once and say what they are in words."""
    run = _graded_run(database, admin)
    with database.writing() as session:
        make_vessel(session, FIRST_MMSI)
    groups = {
        by: client.get(REVIEWS, params={"run_id": run.id, "by": by, "bin_m": 20}).json()["groups"]
        for by in ("type", "range", "heading", "run")
    }
    for found in groups.values():
        assert sum(group["poses"] for group in found) == 10
        assert sum(group["graded"] for group in found) == 9
    assert [group["label"] for group in groups["type"]] == ["Cargo", "Unknown"]
    assert [(group["label"], group["poses"]) for group in groups["range"]] == [
        (f"{start} to {start + 20} m", 2) for start in range(40, 140, 20)
    ]
    assert [group["label"] for group in groups["run"]] == [f"Run {run.id}"]


def _seen_from_the_south(heading_deg: float) -> dict[str, Any]:
    # 1 km north of the camera of `make_registration`.
    return {"lat_deg": 53.5422 + 0.008987, "lon_deg": 9.9835, "heading_deg": heading_deg}


def test_range_and_heading_are_as_the_camera_sees_them(
    client: TestClient, database: Database, admin: User
) -> None:
    """A vessel 1 km north of the camera that heads south comes bow on; westward is broadside."""
    with database.writing() as session:
        harbour = make_harbour(session)
        run = make_run(session, harbour)
        for mmsi, heading in ((1, 185.0), (2, 268.0), (3, 359.0)):
            pose = make_pose(session, run, harbour.images[0], mmsi, **_seen_from_the_south(heading))
            make_review(session, pose, admin.id, Grade.GOOD)
    ask = {"run_id": run.id, "by": "heading"}
    headings = client.get(REVIEWS, params=ask).json()["groups"]
    assert [group["label"] for group in headings] == [
        "0 to 30°, bow on",
        "60 to 90°, broadside",
        "150 to 180°, stern on",
    ]
    ranges = client.get(REVIEWS, params=ask | {"by": "range"}).json()["groups"]
    assert [(group["label"], group["graded"]) for group in ranges] == [("1000 to 1200 m", 3)]


def _double_reviewed(database: Database, first: User, second: User) -> Run:
    """Store 40 poses of which two people judged 20; they agree on 15 (5 Good are OK to one)."""
    with database.writing() as session:
        run, _, pose_ids = make_large_run(session, images=20, poses=40)
        grade_many(
            session,
            pose_ids,
            [(Grade.GOOD, PLAIN)] * 10 + [(Grade.BAD, PLAIN)] * 10 + [(Grade.GOOD, PLAIN)] * 20,
            first.id,
        )
        grade_many(
            session,
            pose_ids[:20],
            [(Grade.GOOD, PLAIN)] * 5 + [(Grade.OK, PLAIN)] * 5 + [(Grade.BAD, PLAIN)] * 10,
            second.id,
            second_opinion=True,
        )
    return run


def test_agreement_is_that_of_the_double_reviewed_part(
    client: TestClient, database: Database, admin: User, make_user: MakeUser
) -> None:
    """Percent, kappa and both alphas come from the 20 poses two people judged, and say so."""
    run = _double_reviewed(database, admin, make_user(Role.REVIEWER))
    answer = client.get(REVIEWS, params={"run_id": run.id}).json()
    assert answer["grades"]["good"] == 30
    assert answer["second_opinions"] == 20
    agreement = answer["agreement"]
    assert (agreement["units"], agreement["reviewers"], agreement["share"]) == (20, 2, 0.75)
    (pair,) = agreement["pairs"]
    assert (pair["units"], pair["agreed"]) == (20, 15)
    # Seen .75, by chance .5 * .25 + .5 * .5 = .375.
    assert pair["kappa"] == pytest.approx(0.6)
    alphas = {alpha["scale"]: alpha for alpha in agreement["alphas"]}
    assert 0 < alphas["nominal"]["value"] < alphas["ordinal"]["value"] < 1
    for alpha in alphas.values():
        assert alpha["interval"][0] < alpha["value"] < alpha["interval"][1]


def test_a_verdict_that_settles_is_no_second_measurement(
    client: TestClient, database: Database, admin: User, make_user: MakeUser
) -> None:
    """Whoever settles knows of the others: their verdict counts for the pose, not for agreement."""
    second, third = make_user(Role.REVIEWER), make_user(Role.REVIEWER)
    with database.writing() as session:
        harbour = make_harbour(session)
        run = make_run(session, harbour, (1,))
        pose = session.query(Pose).one()
        make_review(session, pose, admin.id, Grade.GOOD, second_opinion=True)
        make_review(session, pose, second.id, Grade.BAD, second_opinion=True)
        make_review(session, pose, third.id, Grade.OK, settles=True)
    answer = client.get(REVIEWS, params={"run_id": run.id}).json()
    assert answer["grades"] == {"good": 0, "ok": 1, "bad": 0, "wrong": 0}
    assert (answer["agreement"]["opinions"], answer["agreement"]["share"]) == (2, 0.0)


def test_there_is_no_league_table(
    database: Database,
    admin: User,
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
) -> None:
    """A reviewer sees themselves and all others together; the administrator sees everybody."""
    reviewer = make_user(Role.REVIEWER)
    run = _double_reviewed(database, admin, reviewer)
    ask = {"run_id": run.id, "by": "reviewer"}
    own = client_of(reviewer).get(REVIEWS, params=ask).json()
    assert [(group["label"], group["graded"]) for group in own["groups"]] == [
        ("You", 20),
        ("All others together", 40),
    ]
    assert {own["agreement"]["pairs"][0][side] for side in ("first", "second")} == {
        "You",
        "Reviewer 1",
    }
    everybody = client_of(admin).get(REVIEWS, params=ask).json()["groups"]
    assert [group["label"] for group in everybody] == ["You", reviewer.name or reviewer.email]


def test_figures_come_as_csv(client: TestClient, database: Database, admin: User) -> None:
    """The CSV has a line for the whole and one a group, with intervals."""
    run = _graded_run(database, admin)
    text = client.get(REVIEWS, params={"run_id": run.id, "by": "run", "format": "csv"}).text
    whole, group = csv.DictReader(io.StringIO(text))
    assert (whole["group"], whole["graded"], whole["good"]) == ("all", "9", "6")
    assert (group["by"], group["group"]) == ("run", f"Run {run.id}")
    assert float(group["share_good_low"]) == pytest.approx(0.3542, abs=5e-4)


def test_a_formula_in_a_name_stays_text(
    client: TestClient, database: Database, admin: User
) -> None:
    """A run called like a spreadsheet formula gets a leading quote in CSV, and none in JSON."""
    with database.writing() as session:
        harbour = make_harbour(session)
        run = make_run(session, harbour, (1,), name="=HYPERLINK(1)")
        make_review(session, session.query(Pose).one(), admin.id)
    ask = {"run_id": run.id, "by": "run"}
    assert "'=HYPERLINK(1)" in client.get(REVIEWS, params=ask | {"format": "csv"}).text
    assert client.get(REVIEWS, params=ask).json()["groups"][0]["label"] == "=HYPERLINK(1)"


def test_progress_tells_the_whole_and_ones_own_part(
    database: Database,
    admin: User,
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
) -> None:
    """Poses, images, the rate of the last ten minutes and what is left; undone grades are gone."""
    reviewer = make_user(Role.REVIEWER)
    good = (Grade.GOOD, PLAIN)
    with database.writing() as session:
        run, image_ids, pose_ids = make_large_run(session, images=10, poses=60)
        grade_many(session, pose_ids[:20], [good] * 20, admin.id)
        grade_many(session, pose_ids[20:30], [good] * 10, reviewer.id)
        grade_many(
            session,
            pose_ids[30:40],
            [good] * 10,
            reviewer.id,
            created_at=now() - timedelta(minutes=40),
        )
        grade_many(
            session, pose_ids[40:45], [good] * 5, admin.id, replaced_at=now(), withdrawn_at=now()
        )
        complete_many(session, run.id, image_ids[:4])
    answer = client_of(reviewer).get(PROGRESS, params={"run_id": run.id}).json()
    assert (answer["graded"], answer["poses"], answer["own_graded"]) == (40, 60, 20)
    assert (answer["complete_images"], answer["images"]) == (4, 10)
    assert (answer["grades_per_min"], answer["own_grades_per_min"]) == (3.0, 1.0)
    assert answer["remaining_s"] == 400
    assert sum(step["grades"] for step in answer["last_hour"]) == 40
    assert sum(step["own"] for step in answer["last_hour"]) == 20


def test_nothing_to_evaluate_is_no_error(client: TestClient) -> None:
    """An empty installation has figures of nothing, without a share."""
    answer = client.get(REVIEWS).json()
    assert (answer["poses"], answer["good"]["share"]) == (0, None)
    assert answer["agreement"]["units"] == 0
    assert client.get(PROGRESS).json()["remaining_s"] is None
