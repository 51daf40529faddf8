"""Pages of sites and cameras: from nothing to a camera, with errors at their fields."""

from collections.abc import Callable

from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from tests.factories.sites import make_camera, make_site
from tests.integration.conftest import MakeUser

Browse = Callable[[User], TestClient]
SITE = {
    "name": "Elbe",
    "origin.lat_deg": "53.5422",
    "origin.lon_deg": "9.9835",
    "origin.height_m": "40",
    "water_level_m": "39.6",
    "timezone": "Europe/Berlin",
}
CAMERA = {
    "name": "East",
    "width_px": "2560",
    "height_px": "1920",
    "fx_px": "6570.7",
    "fy_px": "6592.3",
    "cx_px": "1187",
    "cy_px": "935.2",
    "distortion": "-0.2, 0.1 0 0",
    "timezone": "Europe/Berlin",
    "file_name_pattern": "",
}


def test_an_empty_installation_says_what_to_do(browser_of: Browse, admin: User) -> None:
    """Without sites the page leads to the form; the new site leads to its first camera."""
    browser = browser_of(admin)
    assert 'href="/sites/new"' in browser.get("/sites").text
    assert "New site" in browser.get("/sites/new").text
    made = browser.post("/sites", data=SITE)
    assert made.status_code == 303
    site = browser.get(made.headers["location"]).text
    assert "Add a camera" in site
    camera = browser.post(f"{made.headers['location']}/cameras", data=CAMERA)
    assert camera.status_code == 303
    shown = browser.get(camera.headers["location"]).text
    assert "No viewport yet" in shown
    assert "-0.2, 0.1, 0.0, 0.0, 0.0" in shown
    assert "Add a viewport" in browser.get(made.headers["location"]).text


def test_errors_stand_at_their_fields_with_what_was_entered(
    browser_of: Browse, admin: User
) -> None:
    """A refused form comes back (422, 409) with its values and each error at its field."""
    browser = browser_of(admin)
    wrong = {"origin.lat_deg": "north", "timezone": "Mars/Olympus"}
    refused = browser.post("/sites", data=SITE | wrong)
    assert refused.status_code == 422
    for field, text in wrong.items():
        assert f'id="field-{field.replace(".", "-")}-error"' in refused.text
        assert f'value="{text}"' in refused.text
    assert 'value="Elbe"' in refused.text
    browser.post("/sites", data=SITE)
    taken = browser.post("/sites", data=SITE)
    assert taken.status_code == 409
    assert "already a site named" in taken.text


def test_an_edit_of_an_old_version_is_refused(
    browser_of: Browse, admin: User, database: Database
) -> None:
    """Saving a form that was opened before somebody else's change gives 412 and changes nothing."""
    with database.writing() as session:
        camera = make_camera(session, make_site(session, "Weser"), "West")
    browser = browser_of(admin)
    for address, values in (
        (f"/sites/{camera.site_id}", SITE | {"name": "Ems"}),
        (f"/cameras/{camera.id}", CAMERA | {"name": "North", "file_name_pattern": "x_%s"}),
    ):
        form = browser.get(f"{address}/edit").text
        assert '<input type="hidden" name="version" value="1">' in form
        assert browser.post(address, data=values | {"version": "1"}).status_code == 303
        stale = browser.post(address, data=values | {"name": "Late", "version": "1"})
        assert stale.status_code == 412
        assert 'value="Late"' in stale.text
        assert "Late" not in browser.get(address).text
    assert "x_%s" in browser.get(f"/cameras/{camera.id}").text
    emptied = CAMERA | {"name": "North", "version": "2"}
    assert browser.post(f"/cameras/{camera.id}", data=emptied).status_code == 303
    assert "common patterns" in browser.get(f"/cameras/{camera.id}").text


def test_pages_show_only_what_one_may_see_and_do(
    browser_of: Browse, make_user: MakeUser, database: Database
) -> None:
    """A viewer of one site sees no other and no forms; strangers' pages give 404, forms 403."""
    with database.writing() as session:
        own, foreign = make_site(session, "Own harbour"), make_site(session, "Foreign harbour")
        camera = make_camera(session, foreign)
    browser = browser_of(make_user(Role.VIEWER, own.id))
    listed = browser.get("/sites").text
    assert "Own harbour" in listed
    assert "Foreign harbour" not in listed
    assert "/sites/new" not in listed
    assert "/edit" not in browser.get(f"/sites/{own.id}").text
    for path in (f"/sites/{foreign.id}", f"/cameras/{camera.id}", "/sites/99999999999999999999"):
        assert browser.get(path).status_code == 404
    assert browser.post("/sites", data=SITE).status_code == 403
    assert browser.get(f"/sites/{own.id}/edit").status_code == 403
    operator = browser_of(make_user(Role.OPERATOR, own.id))
    for path in (f"/sites/{foreign.id}", f"/cameras/{camera.id}"):
        assert operator.get(f"{path}/edit").status_code == 404
        assert operator.post(path, data=CAMERA | {"version": "1"}).status_code == 404
    assert operator.post(f"/sites/{foreign.id}/cameras", data=CAMERA).status_code == 404


def test_an_angle_of_view_is_enough_to_begin_with(
    browser_of: Browse, admin: User, database: Database
) -> None:
    """Without intrinsics the angle gives them; without either the form says what to give."""
    with database.writing() as session:
        form = f"/sites/{make_site(session).id}/cameras"
    browser = browser_of(admin)
    unknown = CAMERA | dict.fromkeys(("fx_px", "fy_px", "cx_px", "cy_px"), "")
    assert "or this angle" in browser.post(form, data=unknown | {"angle_deg": ""}).text
    assert "between 1 and 150" in browser.post(form, data=unknown | {"angle_deg": "190"}).text
    made = browser.post(form, data=unknown | {"angle_deg": "90"})
    shown = browser.get(f"{made.headers['location']}/edit").text
    assert (shown.count('value="1280.0"'), shown.count('value="1279.5"')) == (2, 1)


def test_names_are_text(browser_of: Browse, admin: User, database: Database) -> None:
    """Markup in a name is shown, never built into the page."""
    with database.writing() as session:
        make_camera(session, make_site(session, "<script>alert(1)</script>"), "<b>East</b>")
    browser = browser_of(admin)
    for path in ("/sites", "/sites/1", "/cameras/1", "/cameras/1/edit"):
        text = browser.get(path).text
        assert "&lt;script&gt;" in text
        assert "<script>alert" not in text
