"""Zip archives of recordings over REST: one file with the sum of all, or nothing of any."""

import gzip
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.ais.service import inspect
from app.config import Settings
from app.db import Base, Database
from app.main import create_app
from app.tables.ais import AisPosition, AisStatic
from app.tables.identity import User
from tests.factories.ais import table
from tests.factories.archives import HOSTILE, zipped
from tests.integration.conftest import MakeUser

TEXTS = ("dma_aislib_small_mixed_tagblocks.txt", "dma_219165000_22min_pghp_and_suffix.ais")


def send(client: TestClient, data: bytes) -> Any:
    """Upload an archive; returns the response."""
    return client.post("/api/v1/ais/files", files={"file": ("month.zip", data)})


def row_counts(database: Database) -> dict[str, int]:
    """Count the rows of all tables."""
    with database.reading() as session:
        return {
            name: session.scalar(select(func.count()).select_from(table_)) or 0
            for name, table_ in Base.metadata.tables.items()
        }


def stored_files(settings: Settings) -> set[Path]:
    """Return what is in the store, drafts included."""
    return {path for path in Path(settings.storage_url).rglob("*") if path.is_file()}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_archive_leaves_nothing(
    client: TestClient, database: Database, settings: Settings, case: str
) -> None:
    """It is answered with its status, the entry is named; tables and store stay as they were."""
    data, status, named = HOSTILE[case]
    assert send(client, table()).status_code == 201
    rows, files = row_counts(database), stored_files(settings)

    answer = send(client, data)

    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert named in answer.json()["detail"]
    assert row_counts(database) == rows
    assert stored_files(settings) == files


def test_an_archive_of_real_recordings_counts_their_sum(
    client: TestClient, database: Database, settings: Settings, shared_dir: Path
) -> None:
    """Every bucket of the archive is the sum of its recordings'; again, nothing changes."""
    paths = [shared_dir / "real/ais" / name for name in TEXTS]
    texts = [path.read_bytes() for path in paths]
    data = zipped(
        {
            "2012/": b"",
            f"2012/{TEXTS[0]}": texts[0],
            f"2012/{TEXTS[1]}.gz": gzip.compress(texts[1]),
            f"__MACOSX/2012/._{TEXTS[0]}": b"\0\5\x16\7",
            "2012/.DS_Store": b"\0\0\0\1Bud1",
        }
    )
    told = inspect(paths)

    first = send(client, data)

    assert first.status_code == 201, first.text
    body = first.json()
    assert (body["format"], body["size_bytes"]) == ("zip(nmea,nmea+gzip)", len(data))
    assert {**body["accounting"], "vessels": body["vessels"]} == {
        key: told[key] for key in ("lines", "sentences", "messages", "vessels")
    }
    assert (body["first"], body["last"]) == (told["first"], told["last"])
    with database.reading() as session:
        positions = session.scalar(select(func.count()).select_from(AisPosition))
        statics = session.scalar(select(func.count()).select_from(AisStatic))
    assert (positions, statics) == (told["messages"]["positions"], told["messages"]["statics"])
    assert {path.name for path in stored_files(settings)} == {hashlib.sha256(data).hexdigest()}

    rows, files = row_counts(database), stored_files(settings)
    again = send(client, data)
    assert (again.status_code, again.json()) == (200, body)
    assert (row_counts(database), stored_files(settings)) == (rows, files)


def test_parts_that_overlap_store_each_fix_once(client: TestClient, database: Database) -> None:
    """What two recordings of an archive both heard is one fix and a repeat, as if sent apart."""
    packed = {"a.csv": table(3), "b.csv.gz": gzip.compress(table(5)), "c.csv": table(4)}
    body = send(client, zipped(packed)).json()

    messages = body["accounting"]["messages"]
    assert body["format"] == "zip(csv,csv+gzip)"
    assert (messages["positions"], messages["duplicates"], messages["assembled"]) == (5, 7, 12)
    assert row_counts(database)["ais_positions"] == 5
    alone = send(client, table(5)).json()["accounting"]["messages"]
    assert (alone["positions"], alone["duplicates"]) == (0, 5)


def test_what_is_no_recording_is_left_out_and_told(client: TestClient, database: Database) -> None:
    """A readme, a picture and a table of something else cost nothing; all sums are the tables'."""
    packed = {
        "README.txt": b"Moin, this archive holds AIS.\nWith commas, too.\n",
        "LIES, BITTE.txt": b"Antenna at Teufelsbrueck, 12 m\nnothing else\n",
        "a.csv": table(3),
        "map.png": b"\x89PNG\r\n\x1a\n",
        "empty.log": b"",
        "header.csv": table(0),
    }
    body = send(client, zipped(packed)).json()
    assert body["left_out"]["count"] == 5
    told = {each["entry"]: each["reason"] for each in body["left_out"]["first"]}
    assert told.keys() == packed.keys() - {"a.csv"}
    assert told["map.png"] == "this is a PNG image"
    alone = send(client, table(3)).json()
    assert body["format"] == "zip(csv)"
    assert body["accounting"]["lines"] == alone["accounting"]["lines"]
    assert row_counts(database)["ais_positions"] == 3


@pytest.mark.parametrize("packing", ["plain", "gzip"])
def test_all_entries_share_one_allowance(
    settings: Settings,
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
    packing: str,
) -> None:
    """Recordings that are small enough each are refused when together they are too much text."""
    text = table(1_000)
    one = text if packing == "plain" else gzip.compress(text)
    limited = settings.model_copy(update={"max_ais_file_bytes": int(1.5 * len(text))})
    with TestClient(create_app(limited), headers=client_of(make_user()).headers) as client:
        assert send(client, zipped({"a.csv": one})).status_code == 201
        assert send(client, zipped({"a.csv": one, "b.csv": one})).status_code == 413


def test_the_page_names_the_entry(browser_of: Callable[[User], TestClient], admin: User) -> None:
    """Somebody who picked a bad archive reads which entry it was, on the page they sent it from."""
    data, _, _ = HOSTILE["text"]
    answer = browser_of(admin).post("/ais", files={"file": ("month.zip", data)})
    assert answer.status_code == 422
    assert "notes.txt" in answer.text
    assert "month.zip was not taken" in answer.text
