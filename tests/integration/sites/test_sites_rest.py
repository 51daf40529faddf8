"""Sites and cameras over REST: made, read, changed by version, removed when empty."""

from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database
from app.tables.identity import AuditEntry, Role
from tests.factories.imagery import make_image
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.integration.conftest import MakeUser

SITE = {
    "name": "Elbe",
    "origin": {"lat_deg": 53.5422, "lon_deg": 9.9835, "height_m": 40.0},
    "water_level_m": 39.6,
    "timezone": "Europe/Berlin",
}
K = [[6570.7, 0, 1187.0], [0, 6592.3, 935.2], [0, 0, 1]]
CAMERA = {"name": "East", "width_px": 2560, "height_px": 1920, "K": K}


def test_a_site_is_made_read_listed_and_changed(client: TestClient) -> None:
    """A site keeps what it was made with; an edit names its version and gets the next."""
    made = client.post("/api/v1/sites", json=SITE)
    assert made.status_code == 201
    assert made.headers["location"] == f"/api/v1/sites/{made.json()['id']}"
    read = client.get(made.headers["location"])
    assert read.json() == made.json()
    assert SITE.items() <= read.json().items()
    assert [site["name"] for site in client.get("/api/v1/sites").json()["items"]] == ["Elbe"]
    changed = client.patch(
        made.headers["location"],
        json={"water_level_m": 40.5},
        headers={"If-Match": read.headers["etag"]},
    )
    assert changed.status_code == 200
    assert changed.json()["water_level_m"] == 40.5
    assert changed.headers["etag"] != read.headers["etag"]


def test_an_edit_needs_the_present_version(client: TestClient) -> None:
    """Without If-Match the answer is 428, with a stale one 412, and nothing changes."""
    made = client.post("/api/v1/sites", json=SITE)
    address = made.headers["location"]
    assert client.patch(address, json={"name": "Weser"}).status_code == 428
    fresh = {"If-Match": made.headers["etag"]}
    assert client.patch(address, json={"name": "Weser"}, headers=fresh).status_code == 200
    assert client.patch(address, json={"name": "Ems"}, headers=fresh).status_code == 412
    assert client.get(address).json()["name"] == "Weser"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"name": ""}, "name"),
        ({"name": "bad\x00name"}, "name"),
        ({"timezone": "Mars/Olympus"}, "timezone"),
        ({"timezone": "../../etc/passwd"}, "timezone"),
        ({"origin": {"lat_deg": 91, "lon_deg": 0}}, "origin.lat_deg"),
        ({"watter_level_m": 1}, "watter_level_m"),
    ],
)
def test_a_wrong_field_is_named(client: TestClient, change: dict[str, object], field: str) -> None:
    """A field out of range, or misspelt, gives 422 naming it, and no site is stored."""
    answer = client.post("/api/v1/sites", json=SITE | change)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]
    assert client.get("/api/v1/sites").json()["items"] == []


def test_a_taken_name_conflicts(client: TestClient) -> None:
    """A second site of the same name gives 409 naming the field."""
    client.post("/api/v1/sites", json=SITE)
    answer = client.post("/api/v1/sites", json=SITE)
    assert answer.status_code == 409
    assert answer.json()["errors"][0]["field"] == "name"


def test_an_origin_stays_once_registrations_rest_on_it(client: TestClient) -> None:
    """Moving the frame under solved poses would move them all, so it gives 409."""
    site = client.post("/api/v1/sites", json=SITE)
    camera = client.post("/api/v1/cameras", json=CAMERA | {"site_id": site.json()["id"]}).json()
    viewport = client.post(
        "/api/v1/viewports", json={"camera_id": camera["id"], "name": "East"}
    ).json()
    given = {"method": "given", "rotation": [1.2, -1.2, 1.2], "center": [53.5423, 9.9836, 70]}
    path = f"/api/v1/viewports/{viewport['id']}/registrations"
    assert client.post(path, json=given).status_code == 201
    moved = client.patch(
        site.headers["location"],
        json={"origin": {"lat_deg": 53.5, "lon_deg": 9.9, "height_m": 0}},
        headers={"If-Match": site.headers["etag"]},
    )
    assert moved.status_code == 409


def test_intrinsics_come_as_a_matrix_or_one_by_one(client: TestClient) -> None:
    """Both ways give the same camera; distortion is filled up to five terms."""
    site_id = client.post("/api/v1/sites", json=SITE).json()["id"]
    single = {"fx_px": 6570.7, "fy_px": 6592.3, "cx_px": 1187.0, "cy_px": 935.2}
    first = client.post("/api/v1/cameras", json=CAMERA | {"site_id": site_id})
    second = client.post(
        "/api/v1/cameras",
        json={"site_id": site_id, "name": "West", "width": 2560, "height": 1920}
        | single
        | {"distortion": [-0.2, 0.1, 0, 0]},
    )
    assert (first.status_code, second.status_code) == (201, 201)
    assert first.json()["K"] == second.json()["K"] == K
    assert first.json()["distortion"] == [0, 0, 0, 0, 0]
    assert second.json()["distortion"] == [-0.2, 0.1, 0, 0, 0]
    assert first.json()["timezone"] == "Europe/Berlin"


@pytest.mark.parametrize(
    "intrinsics",
    [
        {},
        {"fx_px": 1000, "fy_px": 1000, "cx_px": 500},
        {"K": [[1, 2, 3], [0, 1, 3], [0, 0, 1]]},
        {"K": K, "fx_px": 1},
        {"K": K, "distortion": [1, 2]},
        {"K": K, "file_name_pattern": "cam_%Y%q"},
        {"K": K, "file_name_pattern": "cam_%Y"},
    ],
)
def test_wrong_intrinsics_are_refused(client: TestClient, intrinsics: dict[str, object]) -> None:
    """Missing, skewed or contradicting intrinsics and useless patterns give 422."""
    site_id = client.post("/api/v1/sites", json=SITE).json()["id"]
    size = {"site_id": site_id, "name": "East", "width_px": 2560, "height_px": 1920}
    answer = client.post("/api/v1/cameras", json=size | intrinsics)
    assert answer.status_code == 422
    assert answer.json()["errors"]


def test_a_camera_with_images_keeps_its_size(client: TestClient, database: Database) -> None:
    """A size its images do not have gives 409."""
    with database.writing() as session:
        camera = make_camera(session, make_site(session))
        make_image(session, camera)
    address = f"/api/v1/cameras/{camera.id}"
    version = {"If-Match": client.get(address).headers["etag"]}
    assert client.patch(address, json={"width_px": 65}, headers=version).status_code == 409
    assert client.patch(address, json={"fx_px": 61.0}, headers=version).json()["fx_px"] == 61.0


def test_a_site_goes_with_its_cameras(client: TestClient, database: Database) -> None:
    """Deleting a site takes along what hangs on it, and says so in the log."""
    with database.writing() as session:
        camera = make_camera(session, make_site(session))
        make_viewport(session, camera)
    assert client.delete(f"/api/v1/sites/{camera.site_id}").status_code == 204
    assert client.get(f"/api/v1/cameras/{camera.id}").status_code == 404
    with database.reading() as session:
        entry = session.query(AuditEntry).filter_by(action="delete", entity="site").one()
    assert entry.entity_id == camera.site_id


def test_lists_come_in_pages(client: TestClient, database: Database) -> None:
    """A cursor leads through all cameras once, in order; one that is not ours gives 422."""
    with database.writing() as session:
        site = make_site(session)
        for _ in range(5):
            make_camera(session, site)
    first = client.get("/api/v1/cameras?limit=3").json()
    second = client.get(f"/api/v1/cameras?limit=3&cursor={first['next_cursor']}").json()
    ids = [item["id"] for item in first["items"] + second["items"]]
    assert len(ids) == 5
    assert ids == sorted(ids)
    assert second["next_cursor"] is None
    assert client.get("/api/v1/cameras?cursor=nonsense").status_code == 422


def test_foreign_and_absurd_ids_are_not_found(
    client_of: Callable[..., TestClient], make_user: MakeUser, database: Database
) -> None:
    """An operator of one site gets 404 for another's site and camera on every verb."""
    with database.writing() as session:
        own, foreign = make_site(session), make_site(session)
        camera = make_camera(session, foreign)
    operator = client_of(make_user(Role.OPERATOR, own.id), *Scope)
    for path in (f"sites/{foreign.id}", f"cameras/{camera.id}", "cameras/99999999999999999999"):
        for verb in ("GET", "PATCH", "DELETE"):
            body = {"json": {}} if verb == "PATCH" else {}
            answer = operator.request(verb, f"/api/v1/{path}", headers={"If-Match": '"1"'}, **body)
            expected = 403 if verb == "DELETE" and path.startswith("sites") else 404
            assert answer.status_code == expected, (verb, path)
    for path in ("..%2fsites", "sites/..%2f..%2fetc", "cameras/x"):
        assert operator.get(f"/api/v1/{path}").status_code == 404
    lone = operator.post("/api/v1/cameras", json=CAMERA | {"site_id": foreign.id})
    assert lone.status_code == 404
    listed = operator.get("/api/v1/sites").json()["items"]
    assert [site["id"] for site in listed] == [own.id]


def test_a_viewer_changes_nothing(
    client_of: Callable[..., TestClient], make_user: MakeUser, database: Database
) -> None:
    """A viewer reads a site; making, changing and deleting give 403."""
    with database.writing() as session:
        site = make_site(session)
    viewer = client_of(make_user(Role.VIEWER, site.id))
    address = f"/api/v1/sites/{site.id}"
    assert viewer.get(address).status_code == 200
    assert viewer.patch(address, json={}, headers={"If-Match": '"1"'}).status_code == 403
    assert viewer.delete(address).status_code == 403
    assert viewer.post("/api/v1/sites", json=SITE).status_code == 403
