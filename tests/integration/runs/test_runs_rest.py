"""Runs over REST: starting, listing, reading, cancelling, and who may."""

from collections.abc import Callable
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database, now
from app.tables.detection import Model, ModelStatus
from app.tables.identity import AuditEntry, User
from app.tables.runs import Run, RunImage, RunStatus
from tests.factories.detectors import make_model
from tests.factories.runs import Harbour, make_harbour, make_registration, make_run
from tests.factories.sites import make_camera, make_site, make_viewport

RUNS = "/api/v1/runs"


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a viewport with three images, ready to be run."""
    with database.writing() as session:
        return make_harbour(session, images=3)


def count(database: Database, table: type[Any]) -> int:
    """Count a table's rows."""
    with database.reading() as session:
        return session.scalar(sa.select(sa.func.count()).select_from(table)) or 0


def test_a_run_freezes_what_it_is_about(client: TestClient, harbour: Harbour) -> None:
    """A run started with nothing but its viewport shows the defaults it froze, and its address."""
    answer = client.post(RUNS, json={"viewport_id": harbour.viewport.id})
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert answer.headers["location"] == f"{RUNS}/{run['id']}"
    assert client.get(answer.headers["location"]).json() == run
    expected = {
        "viewport_id": harbour.viewport.id,
        "site_id": harbour.site.id,
        "registration_id": harbour.registration.id,
        "detector": harbour.model.name,
        "preset": "waterline",
        "status": "queued",
        "images_total": 3,
        "images_done": 0,
        "poses": 0,
        "remaining_s": None,
    }
    assert {key: run[key] for key in expected} == expected
    assert run["parameters"]["score_threshold"] == 0.25
    assert run["parameters"]["maximum_cost"] == 0.5
    assert run["created_at"].endswith("Z")


def test_a_run_takes_the_newest_of_registrations_and_detectors(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """By default the newest ready detector that looks at pixels, and the newest camera pose."""
    with database.writing() as session:
        newest = make_registration(session, harbour.viewport)
        make_model(session, "newer", family="yolox")
        make_model(session, "refused", status=ModelStatus.REFUSED)
        make_model(session, "boxes of others", family="imported")
    run = client.post(RUNS, json={"viewport_id": harbour.viewport.id}).json()
    assert (run["registration_id"], run["detector"]) == (newest.id, "newer")
    named = {"viewport_id": harbour.viewport.id, "detector": "boxes of others"}
    assert client.post(RUNS, json=named).json()["detector"] == "boxes of others"


def test_parameters_replace_defaults(client: TestClient, harbour: Harbour) -> None:
    """A given number replaces its default and leaves the others."""
    body = {"viewport_id": harbour.viewport.id, "parameters": {"score_threshold": 0.4}}
    parameters = client.post(RUNS, json=body).json()["parameters"]
    assert parameters["score_threshold"] == 0.4
    assert parameters["nms_iou"] == 0.45


def test_images_are_run_in_the_order_they_were_taken(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """Positions follow the time of capture; deleted images take no part."""
    with database.writing() as session:
        for image, minute in zip(harbour.images, (30, 10, 20), strict=True):
            image.captured_at = image.captured_at.replace(minute=minute)
            session.merge(image)
        deleted = session.merge(harbour.images[2])
        deleted.deleted_at = now()
    run_id = client.post(RUNS, json={"viewport_id": harbour.viewport.id}).json()["id"]
    with database.reading() as session:
        rows = session.execute(
            sa.select(RunImage.image_id, RunImage.position)
            .where(RunImage.run_id == run_id)
            .order_by(RunImage.position)
        ).all()
    assert [tuple(row) for row in rows] == [
        (harbour.images[1].id, 0),
        (harbour.images[0].id, 1),
    ]


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        ({"detector": "nobody"}, 422, "detector"),
        ({"preset": "magic"}, 422, "preset"),
        ({"parameters": {"speed": 9}}, 422, "parameters.speed"),
        ({"parameters": {"score_threshold": 1.5}}, 422, "parameters.score_threshold"),
        ({"parameters": {"score_threshold": "high"}}, 422, "parameters.score_threshold"),
        ({"parameters": {"maximum_range_m": 1e12}}, 422, "parameters.maximum_range_m"),
        ({"parameters": {"maximum_report_age_s": 1e12}}, 422, "parameters.maximum_report_age_s"),
        ({"parameters": {"class_ids": []}}, 422, "parameters.class_ids"),
        ({"parameters": {"class_ids": [-1]}}, 422, "parameters.class_ids"),
        ({"parameters": {"class_ids": [8, "x"]}}, 422, "parameters.class_ids.1"),
        ({"parameters": {"preset": "paper"}}, 422, "parameters.preset"),
        ({"parameters": {"maximum_cost": 0.3}}, 422, "parameters.maximum_cost"),
        ({"name": "a\x00b"}, 422, "name"),
        ({"detector": "a\x00b"}, 422, "detector"),
        ({"name": "x" * 201}, 422, "name"),
        ({"viewport_id": 999_999}, 404, "viewport_id"),
        ({"viewport_id": 2**80}, 404, "viewport_id"),
        ({"viewport_id": "south"}, 422, "viewport_id"),
        ({"speed": 1}, 422, "speed"),
    ],
)
def test_a_wrong_field_is_named_and_nothing_is_stored(
    client: TestClient,
    database: Database,
    harbour: Harbour,
    body: dict[str, Any],
    status: int,
    field: str,
) -> None:
    """Each mistake is answered with the field it is in, and leaves no run and no job."""
    answer = client.post(RUNS, json={"viewport_id": harbour.viewport.id} | body)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert [error["field"] for error in answer.json()["errors"]] == [field]
    assert count(database, Run) == 0


@pytest.mark.parametrize("number", ["Infinity", "-Infinity", "NaN"])
def test_numbers_json_has_not_are_refused(
    client: TestClient, harbour: Harbour, number: str
) -> None:
    """Python's JSON reader takes them, so they must be refused by name, not stored for ever."""
    text = f'{{"viewport_id": {harbour.viewport.id}, "parameters": {{"maximum_cost": {number}}}}}'
    answer = client.post(RUNS, content=text, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "parameters.maximum_cost"


def test_a_viewport_that_is_not_ready_says_what_it_lacks(
    client: TestClient, database: Database
) -> None:
    """Without a camera pose, then without images, then without a detector, the fix is named."""
    with database.writing() as session:
        viewport = make_viewport(session, make_camera(session, make_site(session)))
    body = {"viewport_id": viewport.id}
    no_pose = client.post(RUNS, json=body)
    assert (no_pose.status_code, no_pose.json()["errors"][0]["field"]) == (409, "viewport_id")
    assert f"viewports/{viewport.id}/registrations" in no_pose.json()["detail"]
    with database.writing() as session:
        make_registration(session, viewport)
    no_detector = client.post(RUNS, json=body)
    assert (no_detector.status_code, no_detector.json()["errors"][0]["field"]) == (422, "detector")
    with database.writing() as session:
        make_model(session)
    no_images = client.post(RUNS, json=body)
    assert (no_images.status_code, no_images.json()["errors"][0]["field"]) == (409, "viewport_id")
    assert "images" in no_images.json()["detail"]
    assert count(database, Run) == 0


def test_lists_come_in_pages_of_one_viewport(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """The list pages by cursor, and keeps to a viewport when asked to."""
    with database.writing() as session:
        ours = [make_run(session, harbour, [2, 1]).id for _ in range(5)]
        other = make_harbour(session)
        theirs = make_run(session, other).id
    seen: list[dict[str, Any]] = []
    cursor: str | None = None
    while True:
        params = {"limit": 2} | ({"cursor": cursor} if cursor else {})
        body = client.get(RUNS, params=params).json()
        seen += body["items"]
        cursor = body["next_cursor"]
        if cursor is None:
            break
    assert [run["id"] for run in seen] == [*ours, theirs]
    assert [(run["images_done"], run["poses"], run["matches"]) for run in seen[:2]] == [
        (2, 3, 3)
    ] * 2
    assert (seen[-1]["images_done"], seen[-1]["poses"]) == (0, 0)
    only = client.get(RUNS, params={"viewport_id": other.viewport.id}).json()
    assert [run["id"] for run in only["items"]] == [theirs]
    assert client.get(RUNS, params={"viewport_id": 2**40}).status_code == 422


def test_another_sites_runs_are_not_there(
    database: Database,
    harbour: Harbour,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """A person of one site lists its runs alone and gets 404 for others, whatever the verb."""
    with database.writing() as session:
        other = make_harbour(session)
        theirs = make_run(session, other)
        ours = make_run(session, harbour)
    neighbour = client_of(make_user("operator", harbour.site.id))
    assert [run["id"] for run in neighbour.get(RUNS).json()["items"]] == [ours.id]
    for run_id in (theirs.id, 999_999, 2**80, 0):
        assert neighbour.get(f"{RUNS}/{run_id}").status_code == 404
        assert neighbour.get(f"{RUNS}/{run_id}/events").status_code == 404
        assert neighbour.post(f"{RUNS}/{run_id}/cancel").status_code == 404
    foreign = neighbour.post(RUNS, json={"viewport_id": other.viewport.id})
    unknown = neighbour.post(RUNS, json={"viewport_id": 999_999})
    assert (foreign.status_code, foreign.json()) == (404, unknown.json())
    assert neighbour.post(RUNS, json={"viewport_id": harbour.viewport.id}).status_code == 201


def test_a_viewer_watches_and_starts_nothing(
    database: Database,
    harbour: Harbour,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Reading needs the role of a viewer, starting and cancelling that of an operator."""
    with database.writing() as session:
        run = make_run(session, harbour, status=RunStatus.QUEUED)
    for role in ("viewer", "reviewer"):
        viewer = client_of(make_user(role, harbour.site.id))
        assert viewer.get(f"{RUNS}/{run.id}").status_code == 200
        assert viewer.post(RUNS, json={"viewport_id": harbour.viewport.id}).status_code == 403
        assert viewer.post(f"{RUNS}/{run.id}/cancel").status_code == 403
    reader = client_of(make_user("operator", harbour.site.id), Scope.READ)
    assert reader.post(f"{RUNS}/{run.id}/cancel").status_code == 403


def test_the_same_key_starts_one_run(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """A start repeated after a lost answer gets the first run, and there is no second."""
    body, key = {"viewport_id": harbour.viewport.id}, {"Idempotency-Key": "once"}
    first, second = (client.post(RUNS, json=body, headers=key) for _ in range(2))
    assert first.json()["id"] == second.json()["id"]
    assert count(database, Run) == 1


def test_a_queued_run_is_cancelled_once(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """Cancelling a queued run ends it; cancelling again changes and records nothing more."""
    run_id = client.post(RUNS, json={"viewport_id": harbour.viewport.id}).json()["id"]
    first = client.post(f"{RUNS}/{run_id}/cancel").json()
    second = client.post(f"{RUNS}/{run_id}/cancel")
    assert first["status"] == "cancelled"
    assert first["finished_at"] is not None
    assert (second.status_code, second.json()) == (200, first)
    with database.reading() as session:
        cancels = session.scalar(
            sa.select(sa.func.count())
            .select_from(AuditEntry)
            .where(AuditEntry.action == "cancel", AuditEntry.entity == "run")
        )
    assert cancels == 1


@pytest.mark.parametrize("status", [RunStatus.SUCCEEDED, RunStatus.FAILED])
def test_an_ended_run_stays_what_it_is(
    client: TestClient, database: Database, harbour: Harbour, status: RunStatus
) -> None:
    """Cancelling a run that has ended is no error and no change."""
    with database.writing() as session:
        run = make_run(session, harbour, [1], status=status, finished_at=now())
    answer = client.post(f"{RUNS}/{run.id}/cancel")
    assert (answer.status_code, answer.json()["status"]) == (200, status.value)


def test_rate_and_remaining_time_follow_the_rows(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """A running run tells images a second and what is left; a failed image counts as done."""
    with database.writing() as session:
        run = make_run(session, harbour, [1, 0], status=RunStatus.RUNNING)
        rows = session.scalars(sa.select(RunImage).where(RunImage.run_id == run.id))
        failed = next(row for row in rows if row.position == 1)
        failed.error = "the image cannot be decoded"
    shown = client.get(f"{RUNS}/{run.id}").json()
    assert (shown["images_done"], shown["images_failed"]) == (2, 1)
    assert shown["images_per_s"] > 0
    assert shown["remaining_s"] == pytest.approx(1 / shown["images_per_s"])


def test_a_model_in_use_stays(client: TestClient, database: Database, harbour: Harbour) -> None:
    """What a run refers to cannot be taken from under it."""
    with database.writing() as session:
        make_run(session, harbour, [1])
    assert client.delete(f"/api/v1/models/{harbour.model.id}").status_code == 409
    assert client.get(f"{RUNS}").json()["items"][0]["poses"] == 1
    with pytest.raises(sa.exc.IntegrityError), database.writing() as session:
        session.execute(sa.delete(Model))
