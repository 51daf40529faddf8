"""Landmarks, models, queues and the like are deleted for a while too, and come back exactly."""

from collections.abc import Callable
from datetime import timedelta
from typing import Any

import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Base, Database, now
from app.deletions import service
from app.storage import Storage
from app.tables.detection import DetectionSet, Model, ModelStatus
from app.tables.identity import Role, User
from app.tables.water import WaterLevel
from tests.factories.world import make_world
from tests.integration.conftest import MakeUser

# Kind of thing, its place in REST, and the name of its id in the world.
THINGS = (
    ("calibration_set", "calibration-sets/{}", "set_id"),
    ("comment", "comments/{}", "comment_id"),
    ("feed", "ais/feeds/{}", "feed_id"),
    ("ground_truth_file", "ground-truth/files/{}", "ground_truth_file_id"),
    ("landmark", "landmarks/{}", "landmark_id"),
    ("missed_vessel", "missed-vessels/{}", "missed_id"),
    ("model", "models/{}", "unused_model_id"),
    ("retention_rule", "retention-rules/{}", "rule_id"),
    ("review_queue", "review-queues/{}", "queue_id"),
    ("standing_run", "standing-runs/{}", "standing_id"),
    ("watched_folder", "watched-folders/{}", "folder_id"),
    ("water_levels", "sites/{}/water-levels", "site_id"),
)
DETECTOR: dict[str, Any] = {"family": "x", "size_bytes": 0, "status": ModelStatus.READY}
# They tell of the deleting, or of the last change, and so differ.
NOT_COMPARED = {"audit_log", "deletions", "idempotency_keys", "api_tokens", "login_sessions"}
COUNTERS = {"version", "changed_at"}


def make_things(database: Database) -> dict[str, int]:
    """Insert one of everything, with a detector that no run uses and a series of water levels."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211_000_001)
        model = Model(name="Unused", sha256="f" * 64, **DETECTOR)
        session.add(model)
        session.add(
            DetectionSet(image_sha256="1" * 64, model_sha256="f" * 64, settings_sha256="0" * 64)
        )
        moment = now()
        session.add_all(
            WaterLevel(
                site_id=ids["site_id"], measured_at=moment + timedelta(minutes=at), level_m=39.0
            )
            for at in range(3)
        )
        session.flush()
        return ids | {"unused_model_id": model.id}


def rows(database: Database) -> dict[str, list[dict[str, Any]]]:
    """Return all rows of all tables, hidden ones too, that deleting and restoring leaves alone."""
    with database.reading() as session:
        return {
            table.name: [
                {name: value for name, value in row.items() if name not in COUNTERS}
                for row in session.execute(sa.select(table).order_by(*table.primary_key)).mappings()
            ]
            for table in Base.metadata.sorted_tables
            if table.name not in NOT_COMPARED
        }


def test_each_is_previewed_hidden_and_comes_back_exactly(
    client: TestClient, database: Database
) -> None:
    """Its address is 404 while it is deleted; restored, every row of every table is as before."""
    ids = make_things(database)
    before = rows(database)
    extents = {}
    for entity, place, name in THINGS:
        address = f"/api/v1/{place.format(ids[name])}"
        asked = client.get(
            "/api/v1/deletions/preview", params={"entity": entity, "id": ids[name]}
        ).json()
        extents[entity] = asked["counts"]

        assert client.delete(address).status_code == 204, entity

        (deletion,) = client.get("/api/v1/deletions").json()["items"][1:]
        assert (deletion["entity"], deletion["counts"]) == (entity, asked["counts"])
        if entity != "water_levels":
            assert client.delete(address).status_code == 404, entity
        restored = client.post(f"/api/v1/deletions/{deletion['id']}/restore")
        assert restored.status_code == 204, (entity, restored.text)
        assert rows(database) == before, entity
    assert extents["water_levels"] == {"readings": 3}
    assert extents["ground_truth_file"] == {"photographs": 1, "annotations": 1}
    assert extents["model"] == {"looked at photographs": 1}


def test_what_took_the_place_meanwhile_is_named(client: TestClient, database: Database) -> None:
    """A taken name, another series and the same detector stand in the way; the answer says so."""
    ids = make_things(database)
    site = f"/api/v1/sites/{ids['site_id']}"
    landmark = client.get(f"/api/v1/landmarks/{ids['landmark_id']}").json()
    series = "time,level_m\n2026-01-01T00:00:00Z,40\n"
    levels = f"{site}/water-levels"
    for address in (f"landmarks/{ids['landmark_id']}", f"models/{ids['unused_model_id']}"):
        assert client.delete(f"/api/v1/{address}").status_code == 204
    body = {name: landmark[name] for name in ("name", "lat_deg", "lon_deg", "height_m")}
    assert client.post(f"{site}/landmarks", json=body).status_code == 201
    with database.writing() as session:
        session.add(Model(name="Again", sha256="f" * 64, **DETECTOR))
    put = client.post(levels, content=series, headers={"Content-Type": "text/csv"})
    assert put.status_code == 200, put.text  # the series before was replaced, so deleted

    deletions = client.get("/api/v1/deletions").json()["items"][1:]

    assert [each["entity"] for each in deletions] == ["landmark", "model", "water_levels"]
    for each, word in zip(deletions, ("name", "detector", "series"), strict=True):
        refused = client.post(f"/api/v1/deletions/{each['id']}/restore")
        assert (refused.status_code, word in refused.json()["detail"]) == (409, True)
    assert client.delete(levels).status_code == 204
    old = deletions[-1]["id"]
    assert client.post(f"/api/v1/deletions/{old}/restore").status_code == 204
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count(WaterLevel.id))) == 3


def test_a_model_in_use_stays_and_after_thirty_days_all_goes(
    client: TestClient, database: Database, settings: Settings
) -> None:
    """A model is refused while a run uses it; purging leaves no row of what was deleted."""
    ids = make_things(database)
    assert client.delete(f"/api/v1/models/{ids['model_id']}").status_code == 409
    for _, place, name in THINGS:
        assert client.delete(f"/api/v1/{place.format(ids[name])}").status_code == 204
    storage = Storage(settings.storage_url)

    assert service.purge(database, storage) == {}
    removed = service.purge(database, storage, now() + timedelta(seconds=1))

    tables = {Base.metadata.tables[name] for name in removed if name in Base.metadata.tables}
    # Feeds keep their rows for the reports that came by them; the viewport is the world's own.
    assert len(tables) == len(THINGS) - 1 + len({"ground_truth_images", "viewports"})
    with database.reading() as session:
        left = session.scalars(sa.select(DetectionSet.model_sha256)).all()
        hidden = [
            table.name
            for table in Base.metadata.sorted_tables
            if "deletion_id" in table.c
            and session.scalar(sa.select(sa.func.count()).where(table.c.deletion_id.is_not(None)))
        ]
    assert "f" * 64 not in left
    assert hidden == []


def test_a_person_is_asked_on_a_page_and_others_queues_stay(
    browser_of: Callable[[User], TestClient],
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
    database: Database,
) -> None:
    """The page says what goes and stays; only who deleted a queue, or an admin, restores it."""
    ids = make_things(database)
    admin = make_user(Role.ADMIN)
    browser = browser_of(admin)
    for entity, _, name in THINGS:
        answer = browser.get("/deletions/ask", params={"entity": entity, "id": ids[name]})
        on_a_page = entity not in {"comment", "landmark", "missed_vessel", "review_queue"}
        assert answer.status_code == (200 if on_a_page else 404), entity
    assert (
        "reports that came by it stay"
        in browser.get(f"/deletions/ask?entity=feed&id={ids['feed_id']}").text
    )
    for action in (f"standing-runs/{ids['standing_id']}", f"retention-rules/{ids['rule_id']}"):
        assert browser.post(f"/{action}/delete").status_code == 303
    assert "standing run" in browser.get("/deletions").text

    assert client_of(admin).delete(f"/api/v1/review-queues/{ids['queue_id']}").status_code == 204
    reviewer = client_of(make_user(Role.REVIEWER, ids["site_id"]))
    queue = reviewer.get("/api/v1/deletions").json()["items"][-1]
    assert queue["entity"] == "review_queue"
    restore = f"/api/v1/deletions/{queue['id']}/restore"
    assert reviewer.post(restore).status_code == 403
    assert client_of(admin).post(restore).status_code == 204
