"""The paper's projection table over REST and as a page, from the keypoints that are there."""

import csv
import io
from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser
from tests.integration.registration.conftest import Scene


def _place(client: TestClient, scene: Scene) -> None:
    """Store the scene's keypoints, each some pixels off."""
    for number, point in enumerate(scene.keypoints):
        point["u_px"] += (-1) ** number * 3.0
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    assert client.put(path, json=scene.keypoints).status_code == 200


def test_the_table_is_what_the_registrations_say(client: TestClient, scene: Scene) -> None:
    """One viewport's means are those of its registrations, the paper's figures beside them."""
    _place(client, scene)
    table = client.get("/api/v1/evaluation/projection").json()
    methods = {row["method"]: row for row in table["methods"]}
    assert list(methods) == ["pnp", "homography_water", "homography_pca"]
    for method, row in methods.items():
        made = client.post(
            f"/api/v1/viewports/{scene.viewport.id}/registrations", json={"method": method}
        ).json()
        for figure in ("mae_px", "mae_pct_width", "mae_pct_height", "leave_one_out_px"):
            assert row[figure] == pytest.approx(made[figure])
        assert (row["keypoints"], row["viewports"]) == (14, 1)
    assert methods["pnp"]["paper"] == {
        "mae_px": 12.22,
        "mae_pct_width": 0.48,
        "mae_pct_height": 0.64,
    }
    assert methods["homography_water"]["mae_px"] > 3 * methods["pnp"]["mae_px"]


def test_the_same_table_comes_as_csv_and_as_a_page(
    client: TestClient, scene: Scene, browser_of: Callable[[User], TestClient], admin: User
) -> None:
    """A line a method with the paper beside; an empty page says what to do."""
    browser = browser_of(admin)
    assert "No viewport can be solved yet" in browser.get("/evaluation/projection").text
    _place(client, scene)
    text = client.get("/api/v1/evaluation/projection", params={"format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [row["method"] for row in rows] == ["pnp", "homography_water", "homography_pca"]
    assert float(rows[1]["paper_mae_px"]) == 61.88
    page = browser.get("/evaluation/projection").text
    assert "North-west" in page
    assert "61.88" in page


def test_viewports_are_filtered_and_those_that_cannot_be_solved_say_why(
    client: TestClient, scene: Scene, database: Database
) -> None:
    """Filters limit the table; too few keypoints leave figures empty and give the reason."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    assert client.put(path, json=scene.keypoints[:4]).status_code == 200
    with database.writing() as session:
        other = make_site(session)
    table = client.get("/api/v1/evaluation/projection").json()
    assert table["methods"][0]["mae_px"] is None
    assert "too few" in table["viewports"][0]["methods"][0]["reason"]
    empty = client.get("/api/v1/evaluation/projection", params={"site_id": other.id}).json()
    assert (empty["viewports"], empty["viewports_considered"]) == ([], 0)
    assert (
        client.get("/api/v1/evaluation/projection", params={"camera_id": 4711}).status_code == 404
    )


def test_a_stranger_sees_nothing_of_it(
    browser_of: Callable[[User], TestClient],
    make_user: MakeUser,
    database: Database,
    client: TestClient,
    scene: Scene,
) -> None:
    """Another site's viewports are in nobody else's table."""
    _place(client, scene)
    with database.writing() as session:
        own = make_site(session)
    browser = browser_of(make_user(Role.VIEWER, own.id))
    assert "North-west" not in browser.get("/evaluation/projection").text
    viewport = {"viewport_id": scene.viewport.id}
    assert browser.get("/evaluation/projection", params=viewport).status_code == 404
