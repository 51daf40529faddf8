"""Recordings come in over REST: exactly accounted for, once, all or nothing."""

import gzip
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.ais.service import inspect
from app.auth.access import Scope
from app.config import Settings
from app.db import Database
from app.main import create_app
from app.tables.ais import AisFile, AisPosition, AisStatic, Vessel
from app.tables.identity import AuditEntry, Role, User
from tests.factories.ais import MMSI, NOON, table
from tests.factories.nmea_text import (
    POSITION,
    VOYAGE,
    encoded,
    payload_of,
    sentence,
    tag_block,
)
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser

Clients = Callable[..., TestClient]


def send(client: TestClient, data: bytes, **form: object) -> Any:
    """Upload a recording; returns the response."""
    return client.post("/api/v1/ais/files", files={"file": ("harbour.ais", data)}, data={**form})


def count(database: Database, table_class: type) -> int:
    """Count the rows of a table."""
    with database.reading() as session:
        return session.scalar(select(func.count()).select_from(table_class)) or 0


def test_a_real_recording_is_accounted_for_exactly(
    client: TestClient, database: Database, shared_dir: Path
) -> None:
    """Every line, sentence and message of five minutes of real traffic is in one bucket."""
    path = shared_dir / "real/ais/dma_5min_2013-11-12_pghp.nmea.gz"
    answer = send(client, path.read_bytes())
    assert answer.status_code == 201
    body = answer.json()
    assert body["format"] == "nmea+gzip"
    assert body["size_bytes"] == path.stat().st_size
    assert (body["first"], body["last"]) == ("2013-11-12T11:59:56Z", "2013-11-12T12:05:00Z")
    lines, sentences, messages = (
        body["accounting"][part] for part in ("lines", "sentences", "messages")
    )
    text = gzip.decompress(path.read_bytes())
    assert lines["total"] == text.count(b"\n") + (not text.endswith(b"\n"))
    assert lines["total"] == sum(lines[k] for k in ("sentence", "time_only", "other", "dropped"))
    assert sentences["total"] == (
        sentences["assembled"] + sum(sentences["rejected"].values()) + sentences["orphaned"]
    )
    assert messages["assembled"] == sum(messages["rejected"].values()) + sum(
        messages[k] for k in ("positions", "statics", "duplicates", "ignored_type")
    )
    assert count(database, AisPosition) == messages["positions"] > 20_000
    assert count(database, AisStatic) >= messages["statics"] > 100
    assert count(database, Vessel) == body["vessels"] > 1_000
    told = inspect([path])
    assert {**body["accounting"], "vessels": body["vessels"]} == {
        key: told[key] for key in ("lines", "sentences", "messages", "vessels")
    }
    assert (body["first"], body["last"]) == (told["first"], told["last"])


def test_the_same_bytes_again_change_nothing(client: TestClient, database: Database) -> None:
    """A second upload answers 200 with the first one's body, and adds no row."""
    first, second = send(client, table()), send(client, table())
    assert (first.status_code, second.status_code) == (201, 200)
    assert first.json() == second.json()
    assert first.headers["location"] == f"/api/v1/ais/files/{first.json()['id']}"
    assert count(database, AisPosition) == 3
    assert count(database, AuditEntry) == 1
    assert client.get(first.headers["location"]).json() == first.json()
    assert client.get("/api/v1/ais/files").json()["items"] == [first.json()]


def test_25_at_once_are_one_file(app: FastAPI, client: TestClient, database: Database) -> None:
    """The same upload sent 25 times at once makes one file: one 201, else 200, never an error."""
    data = table(200)

    def upload(_: int) -> tuple[int, int]:
        answer = send(TestClient(app, headers=client.headers), data)
        return answer.status_code, answer.json()["id"]

    with ThreadPoolExecutor(25) as pool:
        answers = list(pool.map(upload, range(25)))
    assert sorted(status for status, _ in answers) == [200] * 24 + [201]
    assert len({identifier for _, identifier in answers}) == 1
    assert count(database, AisFile) == 1
    assert count(database, AisPosition) == 200


def test_25_overlapping_recordings_at_once(
    app: FastAPI, client: TestClient, database: Database
) -> None:
    """Recordings that share fixes, imported at once, store each fix once and count the repeats."""

    def upload(number: int) -> dict[str, Any]:
        answer = send(TestClient(app, headers=client.headers), table(10 + number))
        assert answer.status_code == 201, answer.text
        counts: dict[str, Any] = answer.json()["accounting"]["messages"]
        return counts

    with ThreadPoolExecutor(25) as pool:
        counts = list(pool.map(upload, range(25)))
    assert count(database, AisPosition) == 34
    assert sum(entry["positions"] for entry in counts) == 34
    assert all(
        entry["positions"] + entry["duplicates"] == entry["assembled"] == 10 + number
        for number, entry in enumerate(counts)
    )


def test_what_an_earlier_recording_brought_counts_as_duplicates(
    client: TestClient, database: Database
) -> None:
    """A longer recording brings only what is new; the same one packed otherwise brings nothing."""
    send(client, table(3))
    messages = send(client, gzip.compress(table(5))).json()["accounting"]["messages"]
    assert (messages["positions"], messages["duplicates"], messages["assembled"]) == (2, 3, 5)
    time = tag_block("c:1714564806")
    said = "\n".join(time + line for line in (*encoded(VOYAGE), *encoded(POSITION))).encode()
    told = send(client, said).json()["accounting"]["messages"]
    assert (told["positions"], told["statics"], told["duplicates"]) == (1, 1, 0)
    statics = count(database, AisStatic)
    told = send(client, gzip.compress(said)).json()["accounting"]["messages"]
    assert (told["positions"], told["statics"], told["duplicates"]) == (0, 0, 2)
    assert count(database, AisStatic) == statics


def test_vessels_keep_the_latest_word(client: TestClient) -> None:
    """An older recording that comes in later fills gaps and overwrites nothing."""
    send(client, table())
    older = (
        f"mmsi,time,lat,lon,sog,cog,name,ship_type\n{MMSI},2020-01-01T00:00:00Z,53,10,0,0,OLD,52"
    )
    assert send(client, older.encode()).status_code == 201
    vessel = client.get(f"/api/v1/ais/vessels/{MMSI}").json()
    assert (vessel["name"], vessel["ship_type"]) == ("ELBE 3", 52)
    assert (vessel["length_m"], vessel["width_m"]) == (19.0, 7.0)
    assert vessel["first_seen_at"] == "2020-01-01T00:00:00Z"
    assert vessel["last_seen_at"] == "2024-05-01T12:00:20Z"
    assert vessel["latest_static"]["to_bow_m"] == 8.0


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"", "empty"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "a PNG image"),
        (b"PK\x03\x04" + bytes(50), "a zip archive"),
        (b"<!doctype html><p>a, b", "<!doctype html>"),
        (b"Dear harbour master,\nnothing to report.\n", "no column mmsi"),
        (b"mmsi,time,lat,lon,sog,cog\n", "without one AIS sentence or row"),
        (gzip.compress(table())[:-30], "damaged or cut off"),
        (gzip.compress(gzip.compress(table())), "gzip within gzip"),
        (table().decode().encode("utf-32"), "binary data"),
    ],
)
def test_what_is_no_recording_is_refused(
    client: TestClient, database: Database, data: bytes, found: str
) -> None:
    """The answer says what was found instead, and nothing is stored."""
    answer = send(client, data)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["errors"][0]["field"] == "file"
    assert found in answer.json()["errors"][0]["message"]
    assert count(database, AisFile) == 0


def test_damaged_sentences_are_counted_by_reason(client: TestClient, database: Database) -> None:
    """Bad checksums, orphans, short payloads and latitude 91 are told apart; the rest is stored."""
    time = tag_block("c:1714564806")
    (good,), (nowhere,) = encoded(POSITION), encoded(POSITION, lat=91.0)
    first_part, _ = encoded(VOYAGE)
    short = sentence(payload_of(good)[:-4])
    lines = [
        *(time + line for line in (good, nowhere, first_part, short)),
        time + good[:-1] + ("0" if good[-1] != "0" else "1"),
        "x" * 100_000,
    ]
    accounting = send(client, "\n".join(lines).encode()).json()["accounting"]
    assert accounting["lines"]["sentence"] == 5
    assert accounting["lines"]["other"] == 1
    assert accounting["sentences"]["rejected"] == {"checksum": 1}
    assert accounting["sentences"]["orphaned"] == 1
    assert accounting["messages"]["rejected"] == {"payload_length": 1, "position": 1}
    assert accounting["messages"]["positions"] == count(database, AisPosition) == 1


@pytest.mark.parametrize("packing", ["plain", "gzip"])
def test_too_much_text_is_refused(
    settings: Settings, make_user: MakeUser, client_of: Clients, packing: str
) -> None:
    """Beyond the limit the answer is 413, also for a small file that unfolds into a large one."""
    small = create_app(settings.model_copy(update={"max_ais_file_bytes": 100_000}))
    data = table(20_000)
    with TestClient(small, headers=client_of(make_user()).headers) as client:
        assert send(client, gzip.compress(data) if packing == "gzip" else data).status_code == 413


def test_the_site_of_an_upload(
    client: TestClient, make_user: MakeUser, client_of: Clients, database: Database
) -> None:
    """Without a word: all sites for who may there, else the only own site, else 422."""
    with database.writing() as session:
        one, other = make_site(session), make_site(session)
    assert send(client, table()).json()["site_id"] is None
    assert send(client, table(), site_id=one.id).json()["site_id"] == one.id
    operator = make_user(Role.OPERATOR, one.id)
    assert send(client_of(operator), table(4)).json()["site_id"] == one.id
    assert send(client_of(operator), table(4), site_id=other.id).status_code == 404
    with database.writing() as session:
        session.merge(operator).memberships.append(
            type(operator.memberships[0])(site_id=other.id, role=Role.OPERATOR)
        )
    answer = send(client_of(operator), table(5))
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "site_id"
    assert send(client, table(), site_id=99_999).status_code == 404
    assert (
        send(client_of(make_user(Role.VIEWER, one.id)), table(), site_id=one.id).status_code == 403
    )
    assert send(client_of(operator, Scope.READ), table(6)).status_code == 403


def test_strange_cells_of_a_table_are_stored_as_text(client: TestClient) -> None:
    """A name that is too long or holds control characters, a type beyond all bounds: no error."""
    name = "<b>" + "x" * 90 + "\x07"
    row = f"{MMSI},2024-05-01T12:00:00Z,53,10,0,0,{name},99999999999"
    answer = send(client, f"mmsi,time,lat,lon,sog,cog,name,ship_type\n{row}".encode())
    assert answer.status_code == 201, answer.text
    vessel = client.get(f"/api/v1/ais/vessels/{MMSI}").json()
    assert vessel["name"] == "<b>" + "x" * 61
    assert vessel["ship_type"] is None


def test_times_and_owners_of_stored_reports(
    client: TestClient, database: Database, admin: User
) -> None:
    """What bulk insertion wrote reads back as moments in UTC, with file and importer."""
    identifier = send(client, table(1)).json()["id"]
    with database.reading() as session:
        position = session.scalars(select(AisPosition)).one()
        file = session.get_one(AisFile, identifier)
    assert position.fix_time == position.received_at == NOON
    assert (position.file_id, position.site_id) == (identifier, None)
    assert (position.fix_time_source, position.message_type) == ("stated", 0)
    assert file.created_by_id == admin.id
