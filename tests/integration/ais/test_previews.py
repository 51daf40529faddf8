"""A recording is looked at before it is imported, and what was not taken can be had afterwards."""

import csv
import gzip
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.ais import service, uploads
from app.ais.importing import Importer
from app.ais.uploads import StoppedError
from app.config import Settings
from app.db import Database
from app.storage import Storage
from app.tables.ais import AisFile, AisPosition
from app.tables.ais_uploads import AisUpload, UploadState
from app.tables.identity import Role, User
from tests.factories.ais import MMSI, table
from tests.factories.nmea_text import POSITION, VOYAGE, encoded, tag_block
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser

Browsers = Callable[[User], TestClient]
ODD = b"wer;wann;hoch;quer;v (m/s)\n211000001;31.05.2024 12:00:00;53,54;9,98;5\n"
TIME = tag_block("c:1714564806")


def look(client: TestClient, data: bytes, **form: object) -> Any:
    """Ask for a preview; returns the response."""
    return client.post("/api/v1/ais/previews", files={"file": ("a.log", data)}, data={**form})


def rows(database: Database, table_class: type) -> int:
    """Count the rows of a table."""
    with database.reading() as session:
        return session.scalar(select(func.count()).select_from(table_class)) or 0


def rejected(client: TestClient, file_id: int) -> list[dict[str, str]]:
    """Download what was not taken of a file."""
    answer = client.get(f"/api/v1/ais/files/{file_id}/rejected")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/csv")
    return list(csv.DictReader(io.StringIO(answer.text)))


def test_a_preview_of_a_real_recording_tells_what_the_import_will(
    client: TestClient, database: Database, shared_dir: Path
) -> None:
    """Accounting, vessels and times are those of the import; nothing is stored by looking."""
    data = (shared_dir / "real/ais/dma_aislib_stream_29s_pghp.txt").read_bytes()
    seen = look(client, data).json()
    assert (rows(database, AisFile), rows(database, AisPosition)) == (0, 0)
    assert seen["texts"] == [{"entry": "", "format": "nmea"}]
    assert seen["is_whole"]
    assert len(seen["reports"]) == 10
    assert {reject["reason"] for reject in seen["rejects"]} == {"mmsi_kind", "position"}
    file = client.post("/api/v1/ais/files", files={"file": ("a.log", data)}).json()
    assert seen["accounting"] == file["accounting"]
    assert (seen["vessels"], seen["first"], seen["last"]) == (
        file["vessels"],
        file["first"],
        file["last"],
    )
    told = rejected(client, file["id"])
    lines = data.decode().splitlines()
    assert len(told) == sum(file["accounting"]["messages"]["rejected"].values()) == 61
    assert all(lines[int(row["line"]) - 1] == row["text"] for row in told)


def test_only_the_first_lines_are_read(client: TestClient) -> None:
    """Of a long recording a portion is shown, and said to be one."""
    seen = look(client, gzip.compress(table(30_000))).json()
    assert not seen["is_whole"]
    assert seen["accounting"]["lines"]["total"] == 20_000
    assert seen["table"]["kind"] == "plain"


def test_a_table_nobody_knows_is_mapped_over_rest(client: TestClient) -> None:
    """The preview proposes what it can; with the columns said, the same table is imported."""
    seen = look(client, ODD.replace(b"12:00", b"24:00")).json()
    assert seen["problem"].startswith("No column is known as time")
    assert seen["table"]["header"][0] == "wer"
    seen = look(client, ODD).json()
    mapping = seen["table"]["mapping"]
    assert mapping["columns"] == {"mmsi": 0, "time": 1, "lat": 2, "lon": 3}
    assert len(seen["table"]["doubts"]) == 4
    mapping["columns"]["sog"] = 4
    mapping |= {"speed_unit": "m/s", "timezone": "Europe/Berlin"}
    told = look(client, ODD, mapping=json.dumps(mapping)).json()["reports"]
    assert [(each["at"], round(each["sog_kn"], 2)) for each in told] == [
        ("2024-05-31T10:00:00Z", 9.72)
    ]
    answer = client.post(
        "/api/v1/ais/files", files={"file": ("x", ODD)}, data={"mapping": json.dumps(mapping)}
    )
    assert answer.json()["first"] == "2024-05-31T10:00:00Z"
    bad = look(client, ODD, mapping='{"columns": {"mmsi": 0}}')
    assert bad.status_code == 422
    assert bad.json()["errors"][0]["field"] == "mapping.columns"


def test_dates_that_may_be_meant_in_two_ways(client: TestClient, database: Database) -> None:
    """One decisive row anywhere settles the order; without one nothing is stored untold."""
    rows_ = [f"211000001,05/01/2024 00:{n // 60:02}:{n % 60:02},53.5,9.98" for n in range(300)]
    text = "\n".join(["mmsi,time,lat,lon", *rows_])
    seen = look(client, text.encode()).json()
    assert seen["problem"].startswith("05/01/2024 00:00:00 may have the day or the month first")
    mapping = seen["table"]["mapping"]
    assert mapping["time_format"] == ""

    def send(data: str, **form: str) -> Any:
        files = {"file": ("a.csv", data.encode())}
        return client.post("/api/v1/ais/files", files=files, data=form)

    refused = [send(text), send(text, mapping=json.dumps(mapping))]
    assert [each.status_code for each in refused] == [422, 422]
    fields = [each.json()["errors"][0]["field"] for each in refused]
    assert fields == ["mapping", "mapping.time_format"]
    assert "05/01/2024" in refused[0].json()["detail"]
    assert rows(database, AisPosition) == 0
    told = send(text, mapping=json.dumps(mapping | {"time_format": "month_first"}))
    assert told.json()["first"] == "2024-05-01T00:00:00Z"
    settled = send(f"{text}\n211000001,05/13/2024 00:00:00,53.5,9.98")
    assert (settled.json()["first"], settled.json()["last"]) == (
        "2024-05-01T00:00:00Z",
        "2024-05-13T00:00:00Z",
    )


def test_rejected_lines_of_an_archive_and_of_formulas(client: TestClient) -> None:
    """Every kind of reject is told where it stands; a spreadsheet finds no formula."""
    first, _ = encoded(VOYAGE)
    good = encoded(POSITION)[0]
    text = "\n".join([TIME + good, "=1+1 " + good[:-1] + "?", TIME + first, good])
    file = client.post("/api/v1/ais/files", files={"file": ("a.log", text.encode())}).json()
    told = {row["reason"]: row for row in rejected(client, file["id"])}
    assert {reason: int(row["line"]) for reason, row in told.items()} == {
        "checksum": 2,
        "orphaned": 3,
        "time": 4,
    }
    assert told["checksum"]["text"].startswith("'=1+1")


def test_the_way_of_an_upload(
    browser_of: Browsers,
    admin: User,
    database: Database,
    settings: Settings,
) -> None:
    """Sent once, looked at, its columns set right, imported by the worker, shown with its sums."""
    browser, storage = browser_of(admin), Storage(settings.storage_url)
    sent = browser.post("/ais", files={"file": ("odd.csv", ODD)}, data={"site_id": ""})
    assert sent.status_code == 303
    place = sent.headers["location"]
    assert "Column 3 (hoch) is taken as lat" in browser.get(place).text
    form = {
        "column.0": "mmsi",
        "column.1": "time",
        "column.2": "lat",
        "column.3": "lon",
        "shown_delimiter": ";",
        "delimiter": ";",
        "decimal": ",",
        "time_format": "day_first",
        "timezone": "UTC",
        "speed_unit": "m/s",
        "has_header": "true",
    }
    wrong = browser.post(f"{place}/mapping", data=form | {"column.3": "lat"})
    assert wrong.status_code == 422
    assert "is another column already" in wrong.text
    assert browser.post(f"{place}/mapping", data=form | {"column.4": "sog"}).status_code == 303
    assert "9.7" in browser.get(place).text
    started = browser.post(f"{place}/import")
    assert "Waiting for the worker" in browser.get(started.headers["location"]).text
    upload_id = int(place.rpartition("/")[2])
    uploads.run_import(database, storage, settings, upload_id)
    with database.reading() as session:
        upload = session.get_one(AisUpload, upload_id)
    assert (upload.state, upload.progress) == (UploadState.IMPORTED, 1.0)
    page = browser.get(f"/ais/files/{upload.file_id}").text
    assert "= all messages" in page
    again = browser.post("/ais", files={"file": ("odd.csv", ODD)}, data={"site_id": ""})
    assert again.headers["location"] == f"/ais?imported={upload.file_id}"


def test_an_upload_is_its_sites_own(
    browser_of: Browsers, make_user: MakeUser, database: Database
) -> None:
    """Others than those who may ingest at its site get 404 or 403; discarding removes it."""
    with database.writing() as session:
        site, other = make_site(session), make_site(session)
    operator = browser_of(make_user(Role.OPERATOR, site.id))
    place = operator.post("/ais", files={"file": ("a.csv", table())}).headers["location"]
    assert browser_of(make_user(Role.OPERATOR, other.id)).get(place).status_code == 404
    assert browser_of(make_user(Role.VIEWER, site.id)).get(place).status_code == 403
    assert operator.post(f"{place}/discard").headers["location"] == "/ais"
    assert operator.get(place).status_code == 404
    assert rows(database, AisUpload) == 0


def test_an_import_that_breaks_off_leaves_nothing(
    database: Database, settings: Settings, client: TestClient
) -> None:
    """While it is written nobody sees it and others write; stopped or killed, it is removed."""
    storage = Storage(settings.storage_url)
    lengths = []

    def stop(_: float) -> None:
        with database.writing() as session:  # nobody holds the writer's place
            make_site(session)
        lengths.append(len(client.get("/api/v1/ais/positions").json()["items"]))
        raise StoppedError("enough")

    with pytest.raises(StoppedError):
        service.import_recording(
            database,
            storage,
            service.Source(io.BytesIO(table(50)), "a.csv", 10**6),
            Importer(None, told=stop),
        )
    assert lengths == [0]
    assert (rows(database, AisPosition), rows(database, AisFile)) == (0, 0)
    with database.writing() as session:  # as a killed process leaves it
        left = AisFile(
            sha256="0" * 64,
            file_name="x",
            format="csv",
            size_bytes=1,
            accounting={},
            is_whole=False,
        )
        session.add(left)
        session.flush()
        session.add(
            AisPosition(
                file_id=left.id,
                mmsi=MMSI,
                fix_time=left.created_at,
                received_at=left.created_at,
                lat_deg=53.0,
                lon_deg=10.0,
            )
        )
    assert client.get("/api/v1/ais/files").json()["items"] == []
    assert client.get(f"/api/v1/ais/files/{left.id}").status_code == 404
    assert client.get("/api/v1/ais/positions").json()["items"] == []
    file = client.post("/api/v1/ais/files", files={"file": ("a.csv", table(3))}).json()
    assert file["accounting"]["messages"]["positions"] == rows(database, AisPosition) == 3
    assert rows(database, AisFile) == 1
