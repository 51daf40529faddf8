"""Batches over REST: sent, resumed, looked at, committed, undone, restored, moved."""

import hashlib
import os
from datetime import UTC, datetime

import pytest
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.errors import StorageFull
from app.storage import Storage
from app.storing_together import StoringTogether
from app.tables.clock import ClockOffset, OffsetSource
from app.tables.imagery import Image
from app.tables.imports import ImportFile
from app.tables.sites import Camera
from tests.factories.imagery import photograph
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.integration.imports.conftest import Sender, begin


def hour(number: int, **more: object) -> bytes:
    """Return a photograph taken at an hour of 1 July 2026 by the camera's clock."""
    return photograph(number, taken=f"2026:07:01 {number:02}:00:00", **more)  # type: ignore[arg-type]


def images(client: TestClient, camera: Camera) -> list[str]:
    """Return the moments of a camera's images."""
    answer = client.get("/api/v1/images", params={"camera_id": camera.id, "limit": 1000}).json()
    return sorted(image["captured_at"] for image in answer["items"])


def test_a_batch_becomes_images_only_when_it_is_committed(
    sender: Sender, client: TestClient, camera: Camera, database: Database
) -> None:
    """Before the commit there is no image; after it all are there, in UTC, at their viewport."""
    with database.writing() as session:
        noon = datetime(2026, 7, 1, 9, 30, tzinfo=UTC)
        viewport = make_viewport(session, camera, name="East", valid_from=noon)
    sender.send({f"a/{number}.jpg": hour(number) for number in (11, 12, 13)})
    preview = sender.preview()
    assert (preview["ready_count"], preview["left_out_count"]) == (3, 0)
    assert (preview["first_at"], preview["last_at"]) == (
        "2026-07-01T09:00:00Z",
        "2026-07-01T11:00:00Z",
    )
    shares = {share["name"]: share["count"] for share in preview["viewports"]}
    assert shares == {"East": 2, "no viewport": 1}
    assert images(client, camera) == []
    committed = sender.act("commit")
    assert committed.status_code == 200
    assert committed.json()["image_count"] == 3
    assert images(client, camera) == [f"2026-07-01T{number:02}:00:00Z" for number in (9, 10, 11)]
    with database.reading() as session:
        found = session.scalars(select(Image).order_by(Image.captured_at)).all()
        assert [image.viewport_id for image in found] == [None, viewport.id, viewport.id]
        assert {image.captured_at_raw == image.captured_at for image in found} == {True}
    assert client.get(f"/api/v1/images/{found[0].id}/file").content == hour(11)


def test_a_broken_connection_loses_nothing_and_sends_nothing_twice(sender: Sender) -> None:
    """Announced again, only what has not come is wanted, a large file from where it broke off."""
    files = {f"{number}.jpg": hour(number) for number in range(5, 10)}
    first = dict(list(files.items())[:2])
    assert [file["state"] for file in sender.send(first)] == ["staged", "staged"]
    large = photograph(1, taken="2026:07:01 01:00:00") + bytes(3000)
    (announced,) = sender.announce({"large.jpg": large})
    assert sender.piece(announced["id"], large[:1000]).json()["received_bytes"] == 1000
    again = sender.announce(files | {"large.jpg": large})
    assert [file["state"] for file in again] == ["staged"] * 2 + ["waiting"] * 4
    assert again[-1]["received_bytes"] == 1000
    twice = sender.piece(announced["id"], large[:1000])
    assert (twice.status_code, twice.json()["received_bytes"]) == (409, 1000)
    assert sender.piece(announced["id"], large[1000:], 1000).json()["state"] == "staged"
    assert len(sender.send(files)) == 3
    assert sender.preview()["ready_count"] == 6
    assert sender.preview()["waiting_count"] == 0


def test_what_the_camera_has_is_not_sent_again(
    sender: Sender, client: TestClient, camera: Camera
) -> None:
    """Contents known by their hash are not asked for; the same bytes twice become one image."""
    sender.send({"a.jpg": hour(1)})
    sender.act("commit")
    again = begin(client, camera)
    (known,) = again.announce({"b.jpg": hour(1)}, hashed=True)
    assert known["state"] == "known"
    again.send({"c.jpg": hour(1), "x/d.jpg": hour(2), "y/d.jpg": hour(2)})
    assert again.odd() == {"known": 2, "repeated": 1}
    assert again.act("commit").json()["image_count"] == 1
    assert len(images(client, camera)) == 2


def test_a_hash_is_no_key_to_the_images_of_others(
    client: TestClient, sender: Sender, database: Database
) -> None:
    """To know the hash of another camera's photograph is not enough to have it."""
    with database.writing() as session:
        other = make_camera(session, make_site(session))
    theirs = begin(client, other)
    theirs.send({"a.jpg": hour(1)})
    theirs.act("commit")
    (asked,) = sender.announce({"b.jpg": hour(1)}, hashed=True)
    assert asked["state"] == "waiting"


def test_a_strangers_folder_is_told_apart(sender: Sender) -> None:
    """Litter is skipped, no photographs are told with their reasons, odd names do no harm."""
    sender.send(
        {
            ".DS_Store": b"x",
            "a/Thumbs.db": b"x",
            "__MACOSX/a/._1.jpg": b"x",
            "a/notes.txt": b"Moin",
            "a/möwe 鷗\r\n\0.jpg": hour(1),
            "b/1.jpg": hour(2),
            "a/1.jpg": hour(3),
            "a/2.jpg": hour(0),
            "a/cut.jpg": hour(4)[:-300],
            "a/page.jpg": b"<html>" * 20,
            "a/turned.png": hour(5, kind="PNG", orientation=6),
            "a/small.jpg": photograph(6, 32, 24, taken="2026:07:01 06:00:00"),
            "a/empty.jpg": b"",
            "a/untimed.jpg": photograph(7),
            "no-ending": hour(8),
        }
    )
    preview = sender.preview()
    assert sender.odd() == {"refused": 5, "wrong_size": 1, "no_time": 1, "skipped": 3} | {
        "clock_backwards": 1
    }
    refused = next(odd for odd in preview["odd"] if odd["kind"] == "refused")
    reasons = {example["path"]: example["detail"] for example in refused["examples"]}
    assert "exiftool" in reasons["a/turned.png"]
    assert "cut off" in reasons["a/cut.jpg"]
    assert "neither JPEG" in reasons["a/page.jpg"]
    assert preview["ready_count"] == 5
    assert sender.act("commit").json()["image_count"] == 5


def test_a_cameras_wrong_clock_is_set_right(
    sender: Sender, client: TestClient, camera: Camera, database: Database
) -> None:
    """The clock's offset counts in the preview and for the images; what was told is kept."""
    with database.writing() as session:
        session.add(ClockOffset(camera_id=camera.id, offset_s=-90.0, source=OffsetSource.GIVEN))
    sender.send({"1.jpg": hour(12)})
    assert sender.preview()["first_at"] == "2026-07-01T09:58:30Z"
    sender.act("commit")
    assert images(client, camera) == ["2026-07-01T09:58:30Z"]
    with database.reading() as session:
        raw = session.scalars(select(Image.captured_at_raw)).one()
    assert raw == datetime(2026, 7, 1, 10, tzinfo=UTC)


def test_undo_takes_all_along_and_restore_brings_it_back(
    sender: Sender, client: TestClient, camera: Camera
) -> None:
    """Undone, the batch's images are gone and no others; restored, they are there again."""
    begin(client, camera).send({"kept.jpg": hour(1)})
    sender.send({"2.jpg": hour(2), "3.jpg": hour(3)})
    sender.act("commit")
    single = client.post(
        "/api/v1/images",
        files={"file": ("4.jpg", hour(4))},
        data={"camera_id": camera.id},
    ).json()
    along = client.get(f"{sender.address}/takes-along").json()
    assert along == {"images": 2, "poses": 0, "runs": 0, "reviews": 0, "corrections": 0}
    stale = client.post(f"{sender.address}/undo", headers={"If-Match": '"1"'})
    assert stale.status_code == 412
    assert sender.act("undo").json()["status"] == "undone"
    assert images(client, camera) == [single["captured_at"]]
    assert sender.act("undo").status_code == 409
    assert sender.act("restore").json()["status"] == "committed"
    assert len(images(client, camera)) == 3


def test_an_undone_batch_stands_among_what_was_deleted_as_one_thing(
    sender: Sender, client: TestClient, camera: Camera
) -> None:
    """From there it is restored with its own status, but for an image that was deleted before."""
    sender.send({"1.jpg": hour(1), "2.jpg": hour(2), "3.jpg": hour(3)})
    sender.act("commit")
    (first, *_) = client.get("/api/v1/images", params={"camera_id": camera.id}).json()["items"]
    client.delete(f"/api/v1/images/{first['id']}")
    batch = sender.act("undo").json()
    shown = client.get("/api/v1/deletions").json()["items"][-1]
    assert (shown["entity"], shown["entity_id"], shown["label"]) == (
        "import",
        batch["id"],
        batch["name"],
    )
    assert shown["counts"] == {"images": 2}
    assert client.post(f"/api/v1/deletions/{shown['id']}/restore").status_code < 300
    again = client.get(sender.address).json()
    assert (again["status"], again["undone_at"]) == ("committed", None)
    assert again["image_count"] == 2
    assert len(images(client, camera)) == 2


def test_a_batch_moves_to_another_camera(
    sender: Sender, client: TestClient, camera: Camera, database: Database
) -> None:
    """Moved before or after the commit, all of it is at the other camera; sizes must agree."""
    with database.writing() as session:
        site = make_site(session)
        right = make_camera(session, site, name="Right")
        large = make_camera(session, site, name="Large", width_px=640, height_px=480)
    sender.send({"1.jpg": hour(1), "2.jpg": hour(2)})
    sender.act("commit")
    assert sender.act("move", camera_id=large.id).status_code == 409
    moved = sender.act("move", camera_id=right.id)
    assert (moved.status_code, moved.json()["camera_id"]) == (200, right.id)
    assert images(client, camera) == []
    assert len(images(client, right)) == 2
    sender.act("undo")
    assert images(client, right) == []
    sender.act("restore")
    assert sender.act("move", camera_id=camera.id).status_code == 200
    assert len(images(client, camera)) == 2
    assert images(client, right) == []


def test_a_batch_is_given_up_before_it_is_committed(
    sender: Sender, client: TestClient, camera: Camera, database: Database, settings: Settings
) -> None:
    """Discarded, nothing of it is left but the note that it was, and bytes that others need too.

    Bytes that came within the hour stay as well: somebody may be storing the same ones.
    """
    storage = Storage(settings.storage_url)
    begun = begin(client, camera)
    begun.send({"2.jpg": hour(2)})
    begun.act("commit")
    sender.send({"1.jpg": hour(1), "2.jpg": hour(2)})
    for address in (stored := list(storage.addresses())):
        path = storage.local_path(address)
        assert path is not None
        os.utime(path, (0, 0))
    assert len(stored) == 2
    assert sender.client.delete(sender.address).status_code == 204
    assert sender.client.get(sender.address).json()["status"] == "discarded"
    assert sender.act("commit").status_code == 409
    with database.reading() as session:
        of_it = ImportFile.import_id == int(sender.address.rpartition("/")[2])
        assert session.scalar(select(func.count()).where(of_it)) == 0
    assert list(storage.addresses()) == [hashlib.sha256(hour(2)).hexdigest()]


def test_nothing_is_committed_behind_ones_back(sender: Sender) -> None:
    """A commit waits for announced files unless told otherwise, and knows what was looked at."""
    sender.send({"1.jpg": hour(1)})
    sender.announce({"2.jpg": hour(2)})
    seen = sender.client.get(sender.address).headers["etag"]
    times = {"rule": "exif", "timezone": "UTC"}
    assert sender.client.put(f"{sender.address}/times", json=times).status_code == 428
    changed = sender.client.put(f"{sender.address}/times", json=times, headers={"If-Match": seen})
    assert changed.status_code == 200
    assert sender.preview()["first_at"] == "2026-07-01T01:00:00Z"
    stale = sender.client.post(f"{sender.address}/commit", headers={"If-Match": seen})
    assert stale.status_code == 412
    assert sender.act("commit").status_code == 409
    assert sender.act("commit", leave_out_waiting=True).json()["image_count"] == 1


def test_a_table_gives_the_times(sender: Sender, client: TestClient, camera: Camera) -> None:
    """Names with times in a CSV are matched to files by path or by name; a bad line takes none.

    Who looked at the batch before the table came is told so.
    """
    sender.send({"a/1.jpg": photograph(1), "b/2.jpg": photograph(2)})
    address = f"{sender.address}/times-table"
    bad = client.put(address, json={"times": "1.jpg,2026-07-01 10:00:00\n2.jpg,noon\n"})
    assert (bad.status_code, "line 2" in bad.json()["detail"]) == (422, True)
    rows = "1.jpg,2026-07-01 10:00:00.25\nb/2.jpg,2026-07-01T10:00:00Z\nc.jpg,2026-07-01 12:00\n"
    table = f"name,time\n{rows}"
    seen = {"If-Match": client.get(sender.address).headers["etag"]}
    answer = client.put(address, json={"times": table}, headers=seen).json()
    assert (answer["matched"], answer["unknown_names"]) == (2, ["c.jpg"])
    assert client.put(address, json={"times": table}, headers=seen).status_code == 412
    assert client.delete(sender.address, headers=seen).status_code == 412
    client.put(
        f"{sender.address}/times",
        json={"rule": "csv", "timezone": "Europe/Berlin"},
        headers={"If-Match": client.get(sender.address).headers["etag"]},
    )
    sender.act("commit")
    assert images(client, camera) == ["2026-07-01T08:00:00.250000Z", "2026-07-01T10:00:00Z"]
    sources = {
        image["captured_at_source"] for image in client.get("/api/v1/images").json()["items"]
    }
    assert sources == {"csv"}


def test_a_full_disk_leaves_all_files_waited_for(
    sender: Sender, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without room the answer is 507; with room again the same pack is taken."""

    def full(*_: object) -> None:
        raise StorageFull("there is no room left")

    (file,) = sender.announce({"1.jpg": hour(1)})
    pack = {"params": {"files": str(file["id"])}, "content": hour(1)}
    with monkeypatch.context() as without_room:
        without_room.setattr(StoringTogether, "settle", full)
        assert sender.client.post(f"{sender.address}/pack", **pack).status_code == 507
    assert sender.announce({"1.jpg": hour(1)})[0]["state"] == "waiting"
    assert sender.client.post(f"{sender.address}/pack", **pack).status_code == 200
