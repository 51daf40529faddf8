"""Pages of viewports: from a pasted table to a solved camera."""

import re
from collections.abc import Callable

from starlette.testclient import TestClient

from app.db import Database
from app.domain.rotations import rotvec_from_matrix
from app.registration.keypoint_csv import write_table
from app.tables.identity import Role, User
from app.tables.sites import Camera
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser
from tests.integration.registration.conftest import Scene

Browse = Callable[[User], TestClient]


def _table(scene: Scene) -> str:
    return write_table([point | {"role": "control"} for point in scene.keypoints])


def test_a_pasted_table_is_solved_and_judged(browser_of: Browse, admin: User, scene: Scene) -> None:
    """Keypoints from a table, PnP and a homography beside it; the best stands first, in use."""
    browser = browser_of(admin)
    page = f"/viewports/{scene.viewport.id}"
    assert "Needs keypoints" in browser.get(page).text
    saved = browser.post(f"{page}/keypoints", data={"table": _table(scene), "version": "1"})
    assert saved.status_code == 303
    assert "Not solved" in browser.get(page).text
    for method in ("homography_water", "pnp"):
        assert browser.post(f"{page}/registrations", data={"method": method}).status_code == 303
    solved = browser.get(page).text
    methods = re.findall(r'<th scope="row">(PnP|Homography, water plane)', solved)
    assert methods == ["PnP", "Homography, water plane"]
    assert "in use" in solved
    assert "Needs images" in solved
    assert f"/runs/new?viewport_id={scene.viewport.id}" in solved


def test_a_changed_camera_makes_its_registration_stale(
    browser_of: Browse, admin: User, scene: Scene, database: Database
) -> None:
    """A refined focal length alarms nobody; intrinsics that a person changed do."""
    browser = browser_of(admin)
    page = f"/viewports/{scene.viewport.id}"
    browser.post(f"{page}/keypoints", data={"table": _table(scene), "version": "1"})
    browser.post(f"{page}/registrations", data={"method": "pnp"})
    stale = "intrinsics were changed since"
    assert stale not in browser.get(page).text
    with database.writing() as session:
        session.get_one(Camera, scene.viewport.camera_id).cx_px += 2.0
    assert stale in browser.get(page).text


def test_an_uploaded_table_may_be_wrong(browser_of: Browse, admin: User, scene: Scene) -> None:
    """A wrong line is named at the table, which keeps its text; a stale page is refused."""
    browser = browser_of(admin)
    page = f"/viewports/{scene.viewport.id}/keypoints"
    lines = _table(scene).replace("Landmark 2,", "Landmark 2,9")
    file = {"file": ("points.csv", lines.encode("utf-8-sig"), "text/csv")}
    refused = browser.post(page, data={"version": "1", "table": ""}, files=file)
    assert refused.status_code == 422
    assert "keypoint 2: (u_px, v_px)" in refused.text
    assert "Landmark 14" in refused.text
    binary = {"file": ("points.xlsx", b"PK\x03\x04\xff\xfe", "text/csv")}
    assert "UTF-8" in browser.post(page, data={"version": "1"}, files=binary).text
    assert browser.post(page, data={"table": _table(scene), "version": "9"}).status_code == 412
    assert browser.post(page, data={"table": "", "version": "1"}).status_code == 422


def test_unsolvable_keypoints_say_why(browser_of: Browse, admin: User, scene: Scene) -> None:
    """Too few keypoints give the reason and the fix on the page."""
    browser = browser_of(admin)
    page = f"/viewports/{scene.viewport.id}/registrations"
    refused = browser.post(page, data={"method": "pnp"})
    assert refused.status_code == 422
    assert "mark more landmarks" in refused.text


def test_a_known_pose_is_given_by_form(browser_of: Browse, admin: User, scene: Scene) -> None:
    """Three numbers and a place register the viewport; wrong ones come back at their fields."""
    browser = browser_of(admin)
    page = f"/viewports/{scene.viewport.id}"
    rotation = rotvec_from_matrix(scene.camera.R_cam_from_world)
    pose = {
        "method": "given",
        "rotation": ", ".join(str(number) for number in rotation),
        "center.lat_deg": "53.5422",
        "center.lon_deg": "9.9835",
        "center.height_m": "70",
    }
    refused = browser.post(f"{page}/registrations", data=pose | {"center.lat_deg": "95"})
    assert refused.status_code == 422
    assert 'id="field-center-lat_deg-error"' in refused.text
    assert 'value="70"' in refused.text
    short = browser.post(f"{page}/registrations", data=pose | {"rotation": "1 2"})
    assert short.status_code == 422
    assert browser.post(f"{page}/registrations", data=pose).status_code == 303
    assert "Given, unchecked" in browser.get(page).text


def test_a_viewport_is_made_and_ended_by_form(
    browser_of: Browse, admin: User, scene: Scene
) -> None:
    """An overlapping viewport names the other; once that one is ended, the new one begins."""
    browser = browser_of(admin)
    new = f"/cameras/{scene.viewport.camera_id}/viewports"
    entered = {"name": "South", "valid_from": "2026-11-22T12:00:00Z", "valid_until": ""}
    refused = browser.post(new, data=entered)
    assert refused.status_code == 409
    assert "North-west" in refused.text
    assert 'value="South"' in refused.text
    edit = f"/viewports/{scene.viewport.id}"
    values = {"name": "North-west", "valid_until": "2026-11-22 13:00:00", "version": "1"}
    assert browser.post(edit, data=values).status_code == 303
    assert "2026-11-22T12:00:00Z" in browser.get(f"{edit}/edit").text
    made = browser.post(new, data=entered)
    assert made.status_code == 303
    assert browser.post(f"{made.headers['location']}/delete").status_code == 303
    assert browser.get(made.headers["location"]).status_code == 404


def test_a_stranger_sees_no_viewport(
    browser_of: Browse, make_user: MakeUser, database: Database, scene: Scene
) -> None:
    """Pages and forms of another site's viewport give 404."""
    with database.writing() as session:
        own = make_site(session)
    browser = browser_of(make_user(Role.OPERATOR, own.id))
    page = f"/viewports/{scene.viewport.id}"
    assert browser.get(page).status_code == 404
    assert browser.get(f"{page}/edit").status_code == 404
    assert browser.post(page, data={"name": "X", "version": "1"}).status_code == 404
    assert browser.post(f"{page}/keypoints", data={"table": _table(scene)}).status_code == 404
    assert browser.post(f"{page}/registrations", data={"method": "pnp"}).status_code == 404
    assert browser.post(f"{page}/delete").status_code == 404
