"""A site that shows pseudonyms: every GET there is, by a reviewer, tells no vessel.

What is added to the application is covered by itself. Vessels are looked for by number, name and
call sign, in answers, their headers and their addresses.
"""

import re
from collections.abc import Callable
from typing import Any

import pytest
import sqlalchemy as sa
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.auth.declared import routes_of
from app.db import Database, now
from app.domain.pseudonyms import PSEUDONYM, pseudonym
from app.tables.ais import AisFile, AisStatic, Vessel
from app.tables.identity import User
from app.tables.sites import Site
from tests.factories.world import make_world

MMSI, OTHER = 219_876_543, 265_112_233
NAMES = {MMSI: "ZEPHYRINE", OTHER: "QUOKKAPRINS"}
CALLSIGN, IMO = "OXZQ7", 9_074_729
TELLING = (str(MMSI), str(OTHER), *NAMES.values(), CALLSIGN, str(IMO))
PLACE = re.compile(r"\{(\w+)(?::\w+)?\}")
MakeUser = Callable[..., User]


@pytest.fixture
def world(database: Database) -> dict[str, int]:
    """Store one of everything with vessels that say who they are; the site shows pseudonyms."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", MMSI)
        site = session.get_one(Site, ids["site_id"])
        site.shows_pseudonyms = True
        file = session.get_one(AisFile, ids["file_id"])
        file.sha256 = "ab" * 32
        file.file_name = f"{NAMES[MMSI]}-{MMSI}.nmea"
        vessel = session.get_one(Vessel, MMSI)
        vessel.name, vessel.callsign, vessel.imo = NAMES[MMSI], CALLSIGN, IMO
        moment = now()
        session.add(
            Vessel(mmsi=OTHER, name=NAMES[OTHER], first_seen_at=moment, last_seen_at=moment)
        )
        for mmsi, name in NAMES.items():
            session.add(
                AisStatic(
                    site_id=site.id,
                    mmsi=mmsi,
                    received_at=moment,
                    name=name,
                    callsign=CALLSIGN,
                    imo=IMO,
                    mothership_mmsi=OTHER,
                )
            )
        return ids


def key_of(database: Database, site_id: int) -> bytes:
    """Return a site's key."""
    with database.reading() as session:
        return session.scalars(sa.select(Site.pseudonym_key).where(Site.id == site_id)).one()


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # it walks every route
def test_no_answer_tells_a_vessel(
    app: FastAPI,
    database: Database,
    world: dict[str, int],
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
) -> None:
    """All pages and all of REST, asked by a reviewer with every id there is."""
    reviewer = client_of(make_user("reviewer", world["site_id"]))
    name = pseudonym(MMSI, key_of(database, world["site_id"]))
    ids: dict[str, Any] = {**world, "mmsi": name}
    answered = 0
    for route in routes_of(app):
        if route.path in {None, app.openapi_url} or "GET" not in (route.methods or ()):
            continue
        if route.path.endswith("/events"):
            continue  # goes on for as long as a run does, and tells counts only
        path = PLACE.sub(lambda match: str(ids.get(match[1], 1)), route.path)
        query = {"run_id": world["run_id"], "from": "2020-01-01T00:00:00Z"}
        for params in ({}, query):
            answer = reviewer.get(path, params=params)
            text = f"{answer.text}\n{answer.headers}\n{answer.url}"
            found = [word for word in TELLING if word in text]
            assert not found, f"{path} tells {found}"
            answered += answer.status_code == 200
    assert answered > 60


def test_who_may_ingest_sees_who_it_is(
    database: Database,
    world: dict[str, int],
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
) -> None:
    """An operator of the site gets MMSI and name, by either address."""
    operator = client_of(make_user("operator", world["site_id"]))
    name = pseudonym(MMSI, key_of(database, world["site_id"]))
    for reference in (str(MMSI), name):
        answer = operator.get(f"/api/v1/ais/vessels/{reference}").json()
        assert (answer["mmsi"], answer["name"]) == (MMSI, NAMES[MMSI])
    pose = operator.get(f"/api/v1/poses/{world['pose_id']}").json()
    assert pose["vessel"]["mmsi"] == MMSI


def test_a_number_is_not_confirmed(
    world: dict[str, int], make_user: MakeUser, client_of: Callable[..., TestClient]
) -> None:
    """Asked for by MMSI, a vessel that is there and one that is not are the same: not found."""
    reviewer = client_of(make_user("reviewer", world["site_id"]))
    for path in (
        "/api/v1/ais/vessels/{}",
        "/api/v1/ais/vessels/{}/track",
        "/ais/vessels/{}",
        "/api/v1/poses?mmsi={}",
        "/api/v1/ais/positions?mmsi={}",
    ):
        there, absent = (reviewer.get(path.format(mmsi)) for mmsi in (MMSI, 244_000_001))
        assert (there.status_code, absent.status_code) == (404, 404), path
    found = reviewer.get("/api/v1/ais/vessels", params={"q": str(MMSI)[:6]}).json()["items"]
    assert found == []


def test_pseudonyms_are_the_way_to_everything(
    database: Database,
    world: dict[str, int],
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
) -> None:
    """The name in a pose leads to the vessel, its track, its poses; another site has another."""
    reviewer = client_of(make_user("reviewer", world["site_id"]))
    pose = reviewer.get(f"/api/v1/poses/{world['pose_id']}").json()
    name = pose["vessel"]["mmsi"]
    assert PSEUDONYM.fullmatch(name)
    assert pose["vessel"]["name"] is None
    assert reviewer.get(f"/api/v1/ais/vessels/{name}").json()["mmsi"] == name
    track = reviewer.get(f"/api/v1/ais/vessels/{name}/track").json()
    assert [piece["properties"]["mmsi"] for piece in track["features"]] == [name]
    poses = reviewer.get("/api/v1/poses", params={"mmsi": name}).json()["items"]
    assert [each["id"] for each in poses] == [world["pose_id"]]
    listed = reviewer.get("/api/v1/ais/vessels").json()["items"]
    assert name in [vessel["mmsi"] for vessel in listed]
    with database.writing() as session:
        elsewhere = Site(name="Weser", origin_lat_deg=53, origin_lon_deg=8, shows_pseudonyms=True)
        session.add(elsewhere)
        session.flush()
        other_key = elsewhere.pseudonym_key
    assert pseudonym(MMSI, other_key) != name


def test_identities_are_exported_by_who_sees_them(
    world: dict[str, int], make_user: MakeUser, client_of: Callable[..., TestClient]
) -> None:
    """A reviewer may export with pseudonyms only; an operator with identities too."""
    asked = {"format": "ndjson", "filters": {"run_id": world["run_id"]}, "anonymise": False}
    for role, status in (("reviewer", 403), ("operator", 202)):
        person = client_of(make_user(role, world["site_id"], email=f"{role}@harbour.example"))
        assert person.post("/api/v1/exports", json=asked).status_code == status
        hidden = {**asked, "anonymise": True}
        assert person.post("/api/v1/exports", json=hidden).status_code == 202


def test_the_setting_is_of_the_site(
    world: dict[str, int], make_user: MakeUser, client_of: Callable[..., TestClient]
) -> None:
    """Who may change the site changes what others see of its vessels, and the key is never told."""
    operator = client_of(make_user("operator", world["site_id"]))
    viewer = client_of(make_user("viewer", world["site_id"], email="viewer@harbour.example"))
    site = operator.get(f"/api/v1/sites/{world['site_id']}")
    assert site.json()["shows_pseudonyms"] is True
    assert "key" not in site.text
    changed = operator.patch(
        f"/api/v1/sites/{world['site_id']}",
        json={"shows_pseudonyms": False},
        headers={"If-Match": site.headers["ETag"]},
    )
    assert changed.json()["shows_pseudonyms"] is False
    assert viewer.get(f"/api/v1/ais/vessels/{MMSI}").json()["name"] == NAMES[MMSI]
