"""An AIS recording can be deleted: nobody sees its reports, and all of them can come back."""

from collections.abc import Callable
from datetime import timedelta
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.ais.doubts import doubts_of
from app.config import Settings
from app.db import Database, now
from app.deletions import service
from app.storage import Storage
from app.tables.ais import AisFile, AisPosition, AisStatic
from app.tables.identity import Role, User
from app.tables.imagery import Image
from tests.factories.runs import make_harbour, make_run
from tests.integration.conftest import MakeUser

FILES = "/api/v1/ais/files"
LINES = b"""\
mmsi,time,lat,lon,sog,cog,heading,rot,to_bow,to_stern,to_port,to_starboard,name
211000001,2024-05-01T12:00:00Z,53.50,9.98,10,0,0,0,80,20,8,8,ELBE ONE
211000001,2024-05-01T12:00:10Z,53.90,9.98,10,0,0,0,80,20,8,8,ELBE ONE
211000001,2024-05-01T12:00:20Z,53.50,9.98,10,0,0,0,80,20,8,8,ELBE ONE
"""
OTHER = b"""\
mmsi,time,lat,lon,sog,cog
211000001,2024-05-01T12:00:12Z,53.50,9.98,10,0
211000001,2024-05-01T12:00:14Z,53.50,9.98,10,0
211000001,2024-05-01T12:00:16Z,53.50,9.98,10,0
"""


def send(client: TestClient, content: bytes, name: str = "a.csv") -> dict[str, Any]:
    """Import a recording for all sites and return the answer."""
    answer = client.post(FILES, files={"file": (name, content)})
    assert answer.status_code in {200, 201}, answer.text
    told: dict[str, Any] = answer.json()
    return told


def told(client: TestClient) -> list[str]:
    """Return all that is told of vessels, in lists and on pages."""
    paths = (
        "/api/v1/ais/positions",
        "/api/v1/ais/vessels",
        "/ais",
        "/ais/vessels/211000001",
        "/api/v1/ais/vessels/211000001/track",
    )
    return [client.get(path).text for path in paths]


def test_nobody_sees_the_reports_of_a_deleted_recording(
    client: TestClient, database: Database
) -> None:
    """Lists, pages and doubts are as if it had never come; restored, they are as they were."""
    before = told(client)
    file = send(client, LINES)
    while_there = told(client)
    asked = client.get("/api/v1/deletions/preview", params={"entity": "ais_file", "id": file["id"]})
    assert asked.json()["counts"] == {"positions": 3, "static reports": 1}

    page = client.get(f"/ais/files/{file['id']}/delete").text
    assert "<dd>3</dd>" in page
    gone = client.post(f"/ais/files/{file['id']}/delete", follow_redirects=False)
    assert gone.headers["location"] == "/deletions"
    assert client.get(f"{FILES}/{file['id']}").status_code == 404
    assert client.get(f"{FILES}/{file['id']}/rejected").status_code == 404
    assert client.get(FILES).json()["items"] == []
    assert told(client)[:2] == before[:2]
    assert told(client)[3:] == before[3:]

    send(client, OTHER, "b.csv")
    with database.reading() as session:
        ids = session.scalars(sa.select(AisPosition.id)).all()
        assert [*doubts_of(session, None, ids).values()] == [[]] * 3
    (deletion,) = client.get("/api/v1/deletions").json()["items"]
    assert (deletion["label"], deletion["site_id"]) == ("Recording 1 of 2024-05-01", None)
    assert client.post(f"/api/v1/deletions/{deletion['id']}/restore").status_code == 204
    client.delete(f"{FILES}/2")
    assert told(client)[:2] == while_there[:2]
    assert client.get("/deletions").text.count("AIS recording") == 1


def test_a_deleted_recording_can_come_again_and_goes_for_good(
    client: TestClient, database: Database, settings: Settings
) -> None:
    """Its fixes are not known any more; while it is back the old one stays; purged, rows go."""
    first = send(client, LINES)
    client.delete(f"{FILES}/{first['id']}")
    again = send(client, LINES)
    assert again["id"] != first["id"]
    assert again["accounting"] == first["accounting"]
    refused = client.post("/api/v1/deletions/1/restore")
    assert refused.status_code == 409
    assert "imported again" in refused.json()["detail"]

    storage = Storage(settings.storage_url)
    assert service.purge(database, storage, now() + timedelta(days=1)) == {"ais_files": 1}
    with database.reading() as session:
        counts = [
            session.scalar(sa.select(sa.func.count()).select_from(table.__table__))
            for table in (AisFile, AisPosition, AisStatic)
        ]
    assert counts == [1, 3, 1]
    with storage.open(str(again["sha256"])) as kept:
        assert kept.read() == LINES


def test_runs_of_its_time_go_stale(client: TestClient, database: Database) -> None:
    """The preview counts them, they say why while it is deleted, and are fresh once it is back."""
    with database.writing() as session:
        harbour = make_harbour(session, images=2)
        run = make_run(session, harbour, [1, 1])
        at = session.scalars(sa.select(Image.captured_at)).first()
    assert at is not None
    line = f"211000001,{at:%Y-%m-%dT%H:%M:%SZ},53.5,9.98,10,0\n"
    file = send(client, b"mmsi,time,lat,lon,sog,cog\n" + line.encode())
    asked = client.get("/api/v1/deletions/preview", params={"entity": "ais_file", "id": file["id"]})
    assert asked.json()["stale_runs"] == 1
    assert f'href="/runs/{run.id}"' in client.get(f"/ais/files/{file['id']}/delete").text
    client.delete(f"{FILES}/{file['id']}")
    assert client.get(f"/api/v1/runs/{run.id}").json()["is_stale"]
    assert "recording of its time was deleted" in client.get(f"/runs/{run.id}").text
    client.post("/api/v1/deletions/1/restore")
    assert not client.get(f"/api/v1/runs/{run.id}").json()["is_stale"]


@pytest.mark.parametrize("role", [Role.REVIEWER, Role.OPERATOR])
def test_a_recording_of_all_sites_needs_the_role_on_all(
    client: TestClient,
    database: Database,
    make_user: MakeUser,
    client_of: Callable[[User], TestClient],
    role: Role,
) -> None:
    """An operator of one site reads a shared recording and may not delete it."""
    with database.writing() as session:
        site_id = make_harbour(session).site.id
    file = send(client, LINES)
    person = client_of(make_user(role, site_id))
    refused = person.delete(f"{FILES}/{file['id']}")
    assert refused.status_code == 403
    assert person.get(f"{FILES}/{file['id']}").status_code == 200
