"""The pages of AIS show what REST tells, to people."""

from collections.abc import Callable
from pathlib import Path

from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from tests.factories.ais import MMSI, table
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser

Browsers = Callable[[User], TestClient]


def test_import_and_look(browser_of: Browsers, admin: User) -> None:
    """A recording that is here appears with its counts, its file page and its vessel."""
    browser = browser_of(admin)
    assert "No recordings yet" in browser.get("/ais").text
    sent = {"file": ("elbe.csv", table())}
    assert browser.post("/api/v1/ais/files", files=sent).status_code == 201
    answer = browser.post("/ais", files=sent, data={"site_id": ""})
    assert answer.status_code == 303
    shown = browser.get(answer.headers["location"]).text
    assert "Here already: elbe.csv: 3 new positions, 0 static reports, 1 vessel." in shown
    assert "ELBE 3" in browser.get("/ais?q=elbe").text
    assert "No vessel has" in browser.get("/ais?q=nobody").text
    assert "Types not used" in browser.get("/ais/files/1").text
    vessel = browser.get(f"/ais/vessels/{MMSI}").text
    assert "<polyline" in vessel
    assert "53.54000" in vessel


def test_a_refused_upload_says_why(browser_of: Browsers, admin: User) -> None:
    """The form comes back with the reason beside the field, nothing stored."""
    browser = browser_of(admin)
    answer = browser.post("/ais", files={"file": ("x.png", b"\x89PNG" + bytes(9))})
    assert answer.status_code == 422
    assert "a PNG image" in answer.text
    assert "No recordings yet" in answer.text


def test_a_viewer_sees_no_form(
    browser_of: Browsers, make_user: MakeUser, database: Database
) -> None:
    """Who may not ingest gets the lists without the form, and 403 for sending one anyway."""
    with database.writing() as session:
        site = make_site(session)
    browser = browser_of(make_user(Role.VIEWER, site.id))
    assert "Import a recording" not in browser.get("/ais").text
    assert browser.post("/ais", files={"file": ("x.csv", table())}).status_code == 403


def test_a_real_recording_without_times_is_explained(
    browser_of: Browsers, admin: User, shared_dir: Path
) -> None:
    """Bare sentences cannot be dated; the file's page says so and what to do."""
    browser = browser_of(admin)
    data = (shared_dir / "real/ais/signalk_nais300_bare.log").read_bytes()
    answer = browser.post("/ais", files={"file": ("bare.log", data)})
    assert "No message can be dated" in browser.get(answer.headers["location"]).text
    browser.post("/api/v1/ais/files", files={"file": ("bare.log", data)})
    assert "No message of this recording could be dated" in browser.get("/ais/files/1").text
    assert browser.get("/ais").status_code == 200
