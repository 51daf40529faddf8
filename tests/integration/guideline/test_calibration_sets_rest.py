"""Calibration sets over REST: made by hand and from truth, gone through by a newcomer."""

from collections.abc import Callable, Sequence
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.groundtruth import VesselClass, VesselTruth
from app.tables.identity import Role, User
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose, Run
from tests.factories.runs import CORNERS_PX, make_harbour, make_pose, make_review, make_run
from tests.integration.conftest import MakeUser

SETS = "/api/v1/calibration-sets"
Client = Callable[..., TestClient]


def _run_of(database: Database, poses: int) -> tuple[Run, list[Pose]]:
    with database.writing() as session:
        harbour = make_harbour(session, is_simulated=True)
        run = make_run(session, harbour)
        made = [make_pose(session, run, harbour.images[0], mmsi) for mmsi in range(1, poses + 1)]
    return run, made


def _make_set(client: TestClient, run: Run, judged: Sequence[dict[str, Any]]) -> dict[str, Any]:
    answer = client.post(SETS, json={"run_id": run.id, "name": "Newcomers", "poses": list(judged)})
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    return made


def _judged_set(client: TestClient, database: Database) -> tuple[int, list[Pose]]:
    run, poses = _run_of(database, 4)
    grades = ("good", "ok", "bad", "wrong")
    judged = [
        {"pose_id": pose.id, "grade": grade, "note": f"because of {grade}"}
        for pose, grade in zip(poses, grades, strict=True)
    ]
    return _make_set(client, run, judged)["id"], poses


def test_a_newcomer_learns_the_judgement_after_each_grade(
    client: TestClient, database: Database, make_user: MakeUser, client_of: Client
) -> None:
    """Each answer tells the judged grade and its note; the result tells agreement and kappa."""
    set_id, poses = _judged_set(client, database)
    newcomer = client_of(make_user(Role.REVIEWER))
    given = ("good", "good", "bad", "wrong")
    for pose, grade in zip(poses, given, strict=True):
        body = {"pose_id": pose.id, "grade": grade, "seconds": 1.5}
        answer = newcomer.post(f"{SETS}/{set_id}/grades", json=body)
        assert answer.status_code == 201
    told = answer.json()
    assert (told["judged_grade"], told["note"], told["agrees"]) == (
        "wrong",
        "because of wrong",
        True,
    )
    assert (told["answered"], told["total"]) == (4, 4)
    result = newcomer.get(f"{SETS}/{set_id}/result").json()
    assert (result["agreed"], result["percent"]) == (3, 75.0)
    # Seen .75, by chance (2 * 1 + 0 * 1 + 1 * 1 + 1 * 1) / 16 = .25.
    assert result["kappa"] == pytest.approx(2 / 3)
    (difference,) = result["differences"]
    assert (difference["pose_id"], difference["grade"], difference["judged_grade"]) == (
        poses[1].id,
        "good",
        "ok",
    )


def test_practice_is_blind_and_leaves_no_review(
    client: TestClient, database: Database, admin: User
) -> None:
    """Poses come without anybody's verdict, and practising adds no review to the run."""
    set_id, poses = _judged_set(client, database)
    with database.writing() as session:
        make_review(session, poses[0], admin.id, Grade.BAD)
    shown = client.get(f"{SETS}/{set_id}/poses").json()["items"]
    assert [pose["id"] for pose in shown] == [pose.id for pose in poses]
    assert {pose["review"] for pose in shown} == {None}
    client.post(f"{SETS}/{set_id}/grades", json={"pose_id": poses[0].id, "grade": "ok"})
    shown = client.get(f"{SETS}/{set_id}/poses").json()["items"]
    assert shown[0]["review"]["grade"] == "ok"
    with database.reading() as session:
        assert session.query(Review).count() == 1


def test_the_first_grade_counts(client: TestClient, database: Database) -> None:
    """Whoever has seen the judgement cannot mend the answer; a new attempt begins empty."""
    set_id, poses = _judged_set(client, database)
    grades = f"{SETS}/{set_id}/grades"
    assert client.post(grades, json={"pose_id": poses[0].id, "grade": "bad"}).status_code == 201
    again = client.post(grades, json={"pose_id": poses[0].id, "grade": "good"})
    assert (again.status_code, again.json()["grade"], again.json()["agrees"]) == (200, "bad", False)
    fresh = client.post(f"{SETS}/{set_id}/restart").json()
    assert (fresh["attempt"], fresh["answered"], fresh["percent"]) == (2, 0, None)
    better = client.post(grades, json={"pose_id": poses[0].id, "grade": "good"})
    assert (better.status_code, better.json()["agrees"]) == (201, True)


def test_bad_judgements_are_refused_by_field(client: TestClient, database: Database) -> None:
    """Foreign poses, doubled ones, wrong reasons, both ways at once: named, and nothing stored."""
    run, (pose,) = _run_of(database, 1)
    _, (foreign,) = _run_of(database, 1)
    good = {"pose_id": pose.id, "grade": "good"}
    for poses, field in (
        ([good, {"pose_id": foreign.id, "grade": "ok"}], "poses"),
        ([good, good], "poses"),
        ([good | {"reasons": ["heading"]}], "reasons"),
    ):
        answer = client.post(SETS, json={"run_id": run.id, "name": "x", "poses": poses})
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == field
    both = {"run_id": run.id, "name": "x", "poses": [good], "from_truth": True}
    assert client.post(SETS, json=both).status_code == 422
    assert client.get(SETS).json()["items"] == []


def test_a_set_can_be_mended(client: TestClient, database: Database) -> None:
    """A judgement is changed, a pose taken out, the set removed; results follow."""
    set_id, poses = _judged_set(client, database)
    client.post(f"{SETS}/{set_id}/grades", json={"pose_id": poses[0].id, "grade": "ok"})
    place = f"{SETS}/{set_id}/poses/{poses[0].id}"
    changed = client.put(place, json={"grade": "ok", "reasons": ["heading"], "note": "turned"})
    assert changed.status_code == 200
    assert client.get(f"{SETS}/{set_id}/result").json()["agreed"] == 1
    assert client.delete(f"{SETS}/{set_id}/poses/{poses[1].id}").status_code == 204
    assert client.get(f"{SETS}/{set_id}").json()["poses"] == 3
    assert client.delete(f"{SETS}/{set_id}").status_code == 204
    assert client.get(f"{SETS}/{set_id}").status_code == 404


def test_reviewers_practise_but_do_not_judge(
    client: TestClient, database: Database, make_user: MakeUser, client_of: Client
) -> None:
    """Making and changing a set is for operators; another site's set is not there."""
    set_id, poses = _judged_set(client, database)
    reviewer = client_of(make_user(Role.REVIEWER))
    judgement = {"grade": "good"}
    changed = reviewer.put(f"{SETS}/{set_id}/poses/{poses[0].id}", json=judgement)
    assert changed.status_code == 403
    with database.writing() as session:
        elsewhere = make_harbour(session).site.id
    stranger = client_of(make_user(Role.REVIEWER, elsewhere))
    assert stranger.get(f"{SETS}/{set_id}/poses").status_code == 404
    assert stranger.get(SETS).json()["items"] == []


def _truth(pose: Pose, mmsi: int | None, **columns: Any) -> VesselTruth:
    values = {
        "image_id": pose.image_id,
        "identifier": "tug",
        "mmsi": mmsi,
        "vessel_class": VesselClass.SHIP,
        "centroid_in_cam_m": pose.centroid_in_cam_m,
        "rotvec_cam_from_vessel": pose.rotvec_cam_from_vessel,
        "length_m": pose.length_m,
        "width_m": pose.width_m,
        "height_m": pose.height_m,
        "corners_in_image_px": CORNERS_PX,
        "visible_fraction": 1.0,
        "x1_px": 10.0,
        "y1_px": 12.0,
        "x2_px": 40.5,
        "y2_px": 30.0,
    }
    return VesselTruth(**(values | columns))


def test_a_simulated_site_gives_a_set_by_its_truth(client: TestClient, database: Database) -> None:
    """The true vessel makes Good, a height twice too large Bad, a silent one Wrong; seeded."""
    with database.writing() as session:
        harbour = make_harbour(session, images=3, is_simulated=True)
        run = make_run(session, harbour)
        poses = [make_pose(session, run, image) for image in harbour.images]
        session.add_all(
            [
                _truth(poses[0], poses[0].mmsi),
                _truth(poses[1], poses[1].mmsi, height_m=poses[1].height_m / 2),
                _truth(poses[2], None),
            ]
        )
    body = {"run_id": run.id, "name": "By truth", "from_truth": True, "size": 10, "seed": 3}
    made = client.post(SETS, json=body).json()
    assert (made["from_truth"], made["seed"], made["poses"]) == (True, 3, 3)
    told = {}
    for pose in poses:
        given = {"pose_id": pose.id, "grade": "good"}
        answer = client.post(f"{SETS}/{made['id']}/grades", json=given).json()
        told[pose.id] = (answer["judged_grade"], answer["judged_reasons"])
    assert told == {
        poses[0].id: ("good", []),
        poses[1].id: ("bad", ["height"]),
        poses[2].id: ("wrong", ["missing_ais"]),
    }


def test_without_a_truth_no_set_is_drawn(client: TestClient, database: Database) -> None:
    """A real site's run is refused with what to do instead."""
    run, _ = _run_of(database, 2)
    body = {"run_id": run.id, "name": "By truth", "from_truth": True}
    answer = client.post(SETS, json=body)
    assert answer.status_code == 409
    assert "poses" in answer.json()["detail"]
