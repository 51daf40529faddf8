"""Archives and forms from people who mean harm, or whose disk was full: all refused as a whole."""

import io
import zipfile

import pytest
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.db import Database
from app.tables.imports import ImportFile
from app.tables.sites import Camera
from tests.factories.archives import HOSTILE, sharing_bytes, with_field, zipped
from tests.factories.imagery import photograph
from tests.integration.imports.conftest import API, Sender

PHOTO = photograph(1, taken="2026:07:01 10:00:00")
GOOD = zipped({"a.jpg": PHOTO, "b.jpg": photograph(2)}, method=zipfile.ZIP_STORED)


def _bad_checksum() -> bytes:
    at = GOOD.rindex(b"\xff\xd9") - 40  # within the second photograph
    return GOOD[:at] + bytes([GOOD[at] ^ 255]) + GOOD[at + 1 :]


BAD = {
    "ratio": (zipped({"a.jpg": PHOTO, "bomb.jpg": bytes(1 << 20)}), 413, "100 times"),
    "overlap": (sharing_bytes("a.jpg", PHOTO, 2), 413, "overlaps another"),
    "nested": (HOSTILE["nested"][0], 413, "is itself a zip archive"),
    "too many entries": (sharing_bytes("a", b"", 100_000), 413, "more than 50,000 entries"),
    "cut off": (GOOD[:-40], 422, "damaged or cut off"),
    "cut in the middle": (GOOD[: len(GOOD) // 2], 422, "damaged or cut off"),
    "bad checksum": (_bad_checksum(), 422, "'b.jpg' is damaged"),
    "wrong checksum": (with_field(GOOD, 16, "<L", 0), 422, "'a.jpg' is damaged"),
    "leads out": (zipped({"a.jpg": PHOTO, "../up.jpg": PHOTO}), 422, "'../up.jpg'"),
    "link": (HOSTILE["link"][0], 422, "symbolic link"),
}


def send_archive(sender: Sender, data: bytes) -> tuple[int, str]:
    """Send an archive in two pieces; returns the last answer."""
    (file,) = sender.announce({"day.zip": data})
    half = len(data) // 2
    assert sender.piece(file["id"], data[:half]).status_code == 200
    answer = sender.piece(file["id"], data[half:], half)
    return answer.status_code, answer.text


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
@pytest.mark.parametrize("kind", BAD)
def test_a_bad_archive_is_refused_as_a_whole(
    client: TestClient, camera: Camera, database: Database, kind: str
) -> None:
    """Bombs give 413, damage 422, with the entry named; no photograph of it comes in.

    It is so for an archive in a form, which then leaves no batch, and for one sent in pieces.
    """
    data, status, said = BAD[kind]
    form = {"camera_id": camera.id}
    answer = client.post(API, data=form, files={"file": ("day.zip", data)})
    assert (answer.status_code, said in answer.json()["detail"]) == (status, True)
    assert answer.headers["content-type"] == "application/problem+json"
    assert {row["status"] for row in client.get(API).json()["items"]} == {"discarded"}
    sender = Sender(client, client.post(API, json=form).headers["location"])
    code, text = send_archive(sender, data)
    assert (code, said in text) == (status, True)
    assert sender.preview()["ready_count"] == 0
    assert sender.odd() == {"refused": 1}
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(ImportFile)) == 1


def test_a_good_archive_is_unpacked(sender: Sender) -> None:
    """Its photographs are files of the batch, named after it; litter is counted, not imported."""
    packed = {"in/a.jpg": PHOTO, "in/again.jpg": PHOTO, "__MACOSX/in/._a.jpg": b"x"}
    code, _ = send_archive(sender, zipped(packed | {".DS_Store": b"x", "in/notes.txt": b"Moin"}))
    assert code == 200
    assert sender.odd() == {"repeated": 1, "skipped": 2, "refused": 1}
    assert sender.preview()["samples"][0]["path"] == "day.zip/in/a.jpg"
    # Announced again it is not asked for again.
    (again,) = sender.announce({"day.zip": zipped(packed | {".DS_Store": b"x"})[:1]})
    assert again["state"] == "waiting"  # another size: another archive


def test_a_form_brings_photographs_at_once(client: TestClient, camera: Camera) -> None:
    """One request begins a batch and brings its files, whatever their names, also one twice."""
    files = [
        ("file", ("IMG_1.jpg", photograph(3, taken="2026:07:01 12:00:00"))),
        ("file", ("IMG_1.jpg", photograph(4, taken="2026:07:02 12:00:00"))),
        ("file", ("C:\\card\\..\\1\r\n.jpg", PHOTO)),
        ("file", ("day.zip", zipped({"b.jpg": photograph(2, taken="2026:07:01 11:00:00")}))),
    ]
    answer = client.post(API, data={"camera_id": camera.id, "name": "Card"}, files=files)
    assert answer.status_code == 201
    preview = client.get(f"{answer.headers['location']}/preview").json()
    assert preview["ready_count"] == 4


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
@pytest.mark.parametrize(
    ("head", "size_bytes", "status"),
    [
        (b'name="camera_id"', 3 << 20, 400),
        (b'name="camera_id"; x="' + b"a" * 100_000 + b'"', 10, 400),
        (b'name="' + b"a" * 100_000 + b'"', 10, 400),
    ],
    ids=["field", "header", "name"],
)
def test_huge_fields_and_headers_of_a_form_are_refused(
    client: TestClient, head: bytes, size_bytes: int, status: int
) -> None:
    """A part that is no file may not be large, nor may its headers: 400, whatever follows."""

    def body() -> io.BytesIO:
        begin = b"--limit\r\nContent-Disposition: form-data; " + head + b"\r\n\r\n"
        return io.BytesIO(begin + b"1" * size_bytes + b"\r\n--limit--\r\n")

    answer = client.post(
        API,
        content=body().read(),
        headers={"Content-Type": "multipart/form-data; boundary=limit"},
    )
    assert answer.status_code in {status, 413}, answer.text
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_pack_must_be_what_was_announced(sender: Sender) -> None:
    """Bytes too many or too few, foreign ids and words give 4xx, and all is still waited for."""
    (file,) = sender.announce({"a.jpg": PHOTO})
    address = f"{sender.address}/pack"
    for ids, data, status in (
        (str(file["id"]), PHOTO + b"x", 422),
        (str(file["id"]), PHOTO[:-1], 422),
        ("4711", PHOTO, 404),
        (f"{file['id']},{file['id']}", PHOTO * 2, 422),
        ("one", PHOTO, 422),
    ):
        answer = sender.client.post(address, params={"files": ids}, content=data)
        assert answer.status_code == status, answer.text
    assert sender.piece(file["id"], PHOTO + b"x").status_code == 422
    assert sender.preview()["waiting_count"] == 1
