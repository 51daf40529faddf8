"""Runs whose viewport was registered anew: marked, kept as they are, started again by one click."""

from collections.abc import Callable

from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from app.tables.runs import Pose
from tests.factories.world import make_world
from tests.integration.conftest import MakeUser

GIVEN = {"method": "given", "rotation": [1.5, 0, 0], "center": [54.0, 9.0, 21.0]}


def test_a_new_registration_marks_runs_and_again_uses_it(
    client: TestClient, database: Database
) -> None:
    """The old run keeps its registration and poses; the new one has its parameters and the new."""
    with database.writing() as session:
        ids = make_world(session, "Stale", 211000001)
    path = f"/api/v1/runs/{ids['run_id']}"
    old = client.get(path).json()
    assert not old["is_stale"]
    made = client.post(f"/api/v1/viewports/{ids['viewport_id']}/registrations", json=GIVEN)
    assert made.status_code == 201, made.text
    marked = client.get(path).json()
    assert marked["is_stale"]
    assert marked["registration_id"] == old["registration_id"]
    with database.reading() as session:
        assert session.get(Pose, ids["pose_id"]) is not None
    again = client.post(f"{path}/again")
    assert again.status_code == 201, again.text
    fresh = again.json()
    assert fresh["registration_id"] == made.json()["id"]
    assert not fresh["is_stale"]
    kept = ("detector", "preset", "viewport_id", "name")
    assert [fresh[name] for name in kept] == [old[name] for name in kept]
    assert client.get(again.headers["location"]).json()["id"] == fresh["id"]


def test_pages_say_so_and_start_it_again(
    browser_of: Callable[[User], TestClient],
    admin: User,
    make_user: MakeUser,
    client: TestClient,
    database: Database,
) -> None:
    """Run and viewport are marked on their pages; whoever may start runs gets a button."""
    with database.writing() as session:
        ids = make_world(session, "Stale", 211000002)
    browser = browser_of(admin)
    run, viewport = f"/runs/{ids['run_id']}", f"/viewports/{ids['viewport_id']}"
    assert "registered anew since" not in browser.get(run).text
    client.post(f"/api/v1{viewport}/registrations", json=GIVEN)
    assert "registered anew since" in browser.get(run).text
    assert "1 run rests on an older registration" in browser.get(viewport).text
    started = browser.post(f"{run}/again")
    assert started.status_code == 303
    assert started.headers["location"] != run
    viewer = browser_of(make_user(Role.VIEWER, ids["site_id"]))
    assert "Fuse again" not in viewer.get(run).text
    assert viewer.post(f"{run}/again").status_code == 403
