"""Deleting takes along what belongs to a thing, hides it everywhere, and is undone exactly."""

import os
import re
from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.auth.declared import routes_of
from app.config import Settings
from app.db import Base, Database, now
from app.deletions import service
from app.storage import Storage
from app.tables.identity import Role, User
from app.tables.imagery import Image
from app.tables.runs import Run, RunStatus
from tests.factories.runs import make_harbour, make_run
from tests.factories.world import make_world
from tests.integration.conftest import MakeUser

# These tell what was done, also to what is deleted, or do not end, or compute for long.
NOT_WALKED = re.compile(
    "audit|deletions|events|openapi|docs|metrics|readyz|healthz|static|/file|preview"
)


def read_lists(app: FastAPI, client: TestClient) -> dict[str, tuple[int, str]]:
    """Read every route that reads and names nothing: lists and pages, with status and body."""
    paths = {
        route.path or ""
        for route in routes_of(app)
        if "GET" in (route.methods or ()) and "{" not in (route.path or "{")
    }
    answers = {}
    for path in sorted(paths):
        if not NOT_WALKED.search(path):
            answer = client.get(path, follow_redirects=False)
            assert answer.status_code < 500, path
            answers[path] = (answer.status_code, answer.text)
    return answers


def test_no_list_tells_of_a_deleted_site(
    app: FastAPI, client: TestClient, database: Database
) -> None:
    """Every list and page is as if the site had never been; restored, each is as it was."""
    with database.writing() as session:
        make_world(session, "Elbe", 211_000_001)
        ids = make_world(session, "Zorn", 211_000_002)
        session.execute(sa.update(Run).values(status=RunStatus.SUCCEEDED))
    before = read_lists(app, client)
    told = {path for path, (_, text) in before.items() if "Zorn" in text}
    assert len(told) > 8

    assert client.delete(f"/api/v1/sites/{ids['site_id']}").status_code == 204

    after = read_lists(app, client)
    # A vessel is heard everywhere; its name is not a site's.
    assert {path for path in told if "Zorn" in after[path][1].replace("Zorn ship", "")} == set()
    for path in ("sites", "cameras", "viewports", "images", "runs"):
        assert client.get(f"/api/v1/{path}/{ids[path[:-1] + '_id']}").status_code == 404
    deletion = client.get("/api/v1/deletions").json()["items"][-1]
    assert deletion["label"] == "Zorn harbour"
    assert deletion["counts"]["poses"] == 1
    assert client.post(f"/api/v1/deletions/{deletion['id']}/restore").status_code == 204
    again = read_lists(app, client)
    # Feeds tell how long they have been silent.
    rest = {path for path in told if path.startswith("/api/")} - {"/api/v1/ais/feeds"}
    assert {path for path in rest if again[path] != before[path]} == set()


def test_deleted_images_and_runs_leave_figures_and_lists(
    client: TestClient, database: Database
) -> None:
    """Poses on a deleted image, and those of a deleted run, are in no list and no count."""
    with database.writing() as session:
        harbour = make_harbour(session, images=2)
        first = make_run(session, harbour, [1, 2])
        second = make_run(session, harbour, [1, 1])
    poses = "/api/v1/poses"
    runs = "/api/v1/runs"
    assert len(client.get(poses).json()["items"]) == 5

    assert client.delete(f"/api/v1/images/{harbour.images[1].id}").status_code == 204
    assert len(client.get(poses).json()["items"]) == 2
    shown = client.get(f"{runs}/{first.id}").json()
    assert (shown["images_total"], shown["images_done"], shown["poses"]) == (1, 1, 1)

    asked = client.get("/api/v1/deletions/preview", params={"entity": "run", "id": second.id})
    assert asked.json()["counts"] == {"poses": 1}
    assert client.delete(f"{runs}/{second.id}").status_code == 204
    assert [run["id"] for run in client.get(runs).json()["items"]] == [first.id]
    assert len(client.get(poses).json()["items"]) == 1

    for deletion in client.get("/api/v1/deletions").json()["items"]:
        client.post(f"/api/v1/deletions/{deletion['id']}/restore")
    assert len(client.get(poses).json()["items"]) == 5


def test_what_was_deleted_first_comes_back_last(client: TestClient, database: Database) -> None:
    """A run deleted before its site stays deleted with it, and comes back only after it."""
    with database.writing() as session:
        harbour = make_harbour(session)
        run = make_run(session, harbour, [1])
    client.delete(f"/api/v1/runs/{run.id}")
    client.delete(f"/api/v1/sites/{harbour.site.id}")
    of_run, of_site = client.get("/api/v1/deletions").json()["items"]

    refused = client.post(f"/api/v1/deletions/{of_run['id']}/restore")
    assert refused.status_code == 409
    assert "restore that first" in refused.json()["detail"]
    assert client.post(f"/api/v1/deletions/{of_site['id']}/restore").status_code == 204
    assert client.get(f"/api/v1/runs/{run.id}").status_code == 404
    assert client.post(f"/api/v1/deletions/{of_run['id']}/restore").status_code == 204
    assert client.get(f"/api/v1/runs/{run.id}").status_code == 200


def test_a_name_is_free_again_and_a_busy_run_stays(client: TestClient, database: Database) -> None:
    """A new site may take a deleted one's name, which then cannot come back under it."""
    with database.writing() as session:
        harbour = make_harbour(session, name="Elbe")
        busy = make_run(session, harbour, [1], status=RunStatus.RUNNING)
    site = f"/api/v1/sites/{harbour.site.id}"
    assert client.delete(f"/api/v1/runs/{busy.id}").status_code == 409
    assert "cancel it" in client.delete(site).json()["detail"]
    with database.writing() as session:
        session.merge(busy).status = RunStatus.CANCELLED
    assert client.delete(site).status_code == 204
    body = {"name": "Elbe", "origin": {"lat_deg": 53.5, "lon_deg": 9.9, "height_m": 40.0}}
    other = client.post("/api/v1/sites", json=body | {"water_level_m": 39.0, "timezone": "UTC"})
    assert other.status_code == 201
    deletion = client.get("/api/v1/deletions").json()["items"][0]

    refused = client.post(f"/api/v1/deletions/{deletion['id']}/restore")
    assert refused.status_code == 409
    assert "name" in refused.json()["detail"]
    assert client.get(site).status_code == 404
    client.delete(f"/api/v1/sites/{other.json()['id']}")
    assert client.post(f"/api/v1/deletions/{deletion['id']}/restore").status_code == 204


def test_after_thirty_days_rows_and_files_go(
    client: TestClient, database: Database, settings: Settings
) -> None:
    """What was deleted long ago is removed with its files, but not those another image needs."""
    storage = Storage(settings.storage_url)
    shared, own = storage.put(b"seen twice").sha256, storage.put(b"seen once").sha256
    for sha256 in (shared, own):
        os.utime(storage.local_path(sha256) or "", (1e9, 1e9))
    with database.writing() as session:
        gone, stays = make_harbour(session, images=2), make_harbour(session, images=1)
        make_run(session, gone, [1, 1])
        for image, sha256 in ((gone.images[0], own), (gone.images[1], shared)):
            session.execute(sa.update(Image).where(Image.id == image.id).values(sha256=sha256))
        session.execute(
            sa.update(Image).where(Image.id == stays.images[0].id).values(sha256=shared)
        )
    client.delete(f"/api/v1/cameras/{gone.camera.id}")

    assert service.purge(database, storage) == {}
    removed = service.purge(database, storage, now() + timedelta(seconds=1))

    assert removed == {"runs": 1, "images": 2, "viewports": 1, "cameras": 1, "files": 1}
    assert (storage.exists(own), storage.exists(shared)) == (False, True)
    with database.reading() as session:
        left = {
            name: session.scalar(sa.select(sa.func.count()).select_from(Base.metadata.tables[name]))
            for name in ("cameras", "images", "poses", "vessel_states", "deletions", "sites")
        }
    assert left == {
        "cameras": 1,
        "images": 1,
        "poses": 0,
        "vessel_states": 0,
        "deletions": 0,
        "sites": 2,
    }


def test_a_person_is_asked_first_and_can_undo(
    browser_of: Callable[[User], TestClient], make_user: MakeUser, database: Database
) -> None:
    """The page says what goes along; Recently deleted brings it back, for those who may."""
    with database.writing() as session:
        harbour = make_harbour(session)
        make_run(session, harbour, [2])
    operator = browser_of(make_user(Role.OPERATOR, harbour.site.id))
    viewer = browser_of(make_user(Role.VIEWER, harbour.site.id))
    address = f"/cameras/{harbour.camera.id}"

    asked = operator.get(f"{address}/delete").text
    assert re.search(r"<dt>Poses</dt>\s*<dd>2</dd>", asked)
    assert viewer.post(f"{address}/delete").status_code == 403
    assert operator.post(f"{address}/delete").headers["location"] == "/deletions"
    assert operator.get(address).status_code == 404
    shown = operator.get("/deletions").text
    restore = re.findall(r"/deletions/\d+/restore", shown)[0]
    assert "/restore" not in viewer.get("/deletions").text
    assert viewer.post(restore).status_code == 403
    assert operator.post(restore).status_code == 303
    assert operator.get(address).status_code == 200


def test_viewports_of_one_time_do_not_both_stand(client: TestClient, database: Database) -> None:
    """Images leave a deleted viewport; it cannot come back into another one's time."""
    with database.writing() as session:
        harbour = make_harbour(session)
    image = f"/api/v1/images/{harbour.images[0].id}"
    assert client.delete(f"/api/v1/viewports/{harbour.viewport.id}").status_code == 204
    assert client.get(image).json()["viewport_id"] is None
    body = {"camera_id": harbour.camera.id, "name": "New"}
    other = client.post("/api/v1/viewports", json=body).json()["id"]
    assert client.get(image).json()["viewport_id"] == other
    deletion = client.get("/api/v1/deletions").json()["items"][0]["id"]
    assert client.post(f"/api/v1/deletions/{deletion}/restore").status_code == 409
    client.delete(f"/api/v1/viewports/{other}")
    assert client.post(f"/api/v1/deletions/{deletion}/restore").status_code == 204
    assert client.get(image).json()["viewport_id"] == harbour.viewport.id
