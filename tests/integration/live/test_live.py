"""Cameras that are live: folders are watched, photographs dropped, and fused as they come."""

import errno
import os
import threading
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database, now
from app.errors import StorageFull
from app.jobs import JobClient
from app.live import folders, standing
from app.storage import Storage
from app.tables.ais import AisPosition
from app.tables.identity import Role, User
from app.tables.imagery import Image
from app.tables.live import WatchedFile, WatchedFolder
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose, Run, RunImage, RunStatus
from tests.factories.imagery import make_image, photograph
from tests.factories.runs import make_harbour, make_pose
from tests.factories.sites import make_camera, make_site
from tests.integration.conftest import MakeUser
from worker.leases import Held, Leases
from worker.live.folders import FolderLoops

STOP = threading.Event()


@pytest.fixture
def watched(database: Database, tmp_path: Path) -> WatchedFolder:
    """Give a watched folder with a photograph in a subfolder, a bad one, and something else."""
    place = tmp_path / "camera"
    (place / "day").mkdir(parents=True)
    (place / "day" / "cam_20261122_100000.jpg").write_bytes(photograph(1))
    (place / "broken.jpg").write_bytes(b"no photograph")
    (place / "notes.txt").write_text("not looked at")
    (place / "link.jpg").symlink_to(place / "day" / "cam_20261122_100000.jpg")
    with database.writing() as session:
        camera = make_camera(session, make_site(session))
        return folders.add(session, camera, str(place), moves_files=False)


def lease_of(database: Database, settings: Settings, folder: WatchedFolder) -> Held:
    """Take the lease of a folder, as a worker's supervisor does."""
    taken = Leases(database, settings, "worker-1").take(f"folder:{folder.id}")
    assert taken is not None
    return taken


def statuses(database: Database) -> dict[str, str]:
    """Return what became of each file."""
    with database.reading() as session:
        return {row.path: row.status.value for row in session.scalars(sa.select(WatchedFile))}


def test_a_folder_is_taken_once_and_remembered(
    database: Database, settings: Settings, watched: WatchedFolder
) -> None:
    """Files are taken when they have stopped growing, bad ones told, and nothing is read twice."""
    lease = lease_of(database, settings, watched)
    loop = FolderLoops(database, settings)
    photo = "day/cam_20261122_100000.jpg"

    loop.look(watched.id, lease, STOP)
    assert statuses(database) == {photo: "waiting", "broken.jpg": "waiting"}
    growing = Path(watched.path) / "broken.jpg"
    growing.write_bytes(b"no photograph, and longer")
    loop.look(watched.id, lease, STOP)
    assert statuses(database) == {photo: "taken", "broken.jpg": "waiting"}
    loop.look(watched.id, lease, STOP)
    assert statuses(database) == {photo: "taken", "broken.jpg": "refused"}
    (Path(watched.path) / "copy.jpg").write_bytes(photograph(1))
    again = FolderLoops(database, settings)  # another worker, later
    for _ in range(2):
        again.look(watched.id, lease, STOP)
    assert statuses(database)["copy.jpg"] == "known"
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count(Image.id))) == 1
        assert session.scalars(sa.select(WatchedFolder.version)).one() == watched.version


def test_a_file_in_the_way_keeps_no_other_from_being_taken(
    database: Database, settings: Settings, watched: WatchedFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name in another encoding, and a file that cannot be read, are told; the others go on."""
    lease = lease_of(database, settings, watched)
    loop = FolderLoops(database, settings)
    place = Path(watched.path)
    Path(os.fsdecode(bytes(place) + b"/a\xff.jpg")).write_bytes(photograph(2))
    (place / "day" / "aa_20261122_090000.jpg").write_bytes(photograph(3))
    loop.look(watched.id, lease, STOP)
    reading = Path.open

    def unreadable(path: Path, *arguments: str) -> object:
        if path.name.startswith("aa"):
            raise PermissionError(errno.EACCES, "Permission denied")
        return reading(path, *arguments)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", unreadable)
        loop.look(watched.id, lease, STOP)
    with database.reading() as session:
        trouble = session.get_one(WatchedFolder, watched.id).trouble
    assert trouble == "day/aa_20261122_090000.jpg: Permission denied"
    taken = {path for path, status in statuses(database).items() if status == "taken"}
    assert taken == {"day/cam_20261122_100000.jpg"}
    loop.look(watched.id, lease, STOP)
    assert statuses(database)["day/aa_20261122_090000.jpg"] == "taken"
    with database.reading() as session:
        assert "rename" in (session.get_one(WatchedFolder, watched.id).trouble or "")


def test_a_full_disk_and_a_missing_folder_wait(
    database: Database,
    settings: Settings,
    watched: WatchedFolder,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """While the disk is full files stay and wait, told on the page; with room they are taken."""
    lease = lease_of(database, settings, watched)
    loop = FolderLoops(database, settings)
    loop.look(watched.id, lease, STOP)

    def full(_self: Storage, _data: bytes) -> None:
        raise StorageFull("there is no room left")

    with monkeypatch.context() as patched:
        patched.setattr(Storage, "put", full)
        assert loop.look(watched.id, lease, STOP) > 5
    assert "taken" not in statuses(database).values()
    with database.reading() as session:
        assert "no room" in (session.get_one(WatchedFolder, watched.id).trouble or "")
    loop.look(watched.id, lease, STOP)
    assert "taken" in statuses(database).values()
    Path(watched.path).rename(f"{watched.path}-gone")
    loop.look(watched.id, lease, STOP)
    with database.reading() as session:
        assert "no such folder" in (session.get_one(WatchedFolder, watched.id).trouble or "")


def test_files_are_moved_where_asked(
    database: Database, settings: Settings, watched: WatchedFolder
) -> None:
    """With `moves_files` they end below done and failed, and are not looked at there."""
    with database.writing() as session:
        session.get_one(WatchedFolder, watched.id).moves_files = True
    lease = lease_of(database, settings, watched)
    loop = FolderLoops(database, settings)
    for _ in range(3):
        loop.look(watched.id, lease, STOP)
    place = Path(watched.path)
    assert (place / "done" / "day" / "cam_20261122_100000.jpg").is_file()
    assert (place / "failed" / "broken.jpg").is_file()
    assert len(statuses(database)) == 2


def test_a_token_of_a_camera_drops_photographs_and_nothing_else(
    client: TestClient, database: Database
) -> None:
    """201, then 200 for the same bytes; every other address, and another camera's, is refused."""
    with database.writing() as session:
        camera = make_camera(session, make_site(session))
        other = make_camera(session, session.get_one(type(camera.site), camera.site_id))
    address = f"/api/v1/cameras/{camera.id}/drop"
    made = client.post(f"/api/v1/cameras/{camera.id}/drop-tokens")
    assert made.status_code == 201
    sender = TestClient(client.app, headers={"Authorization": f"Bearer {made.json()['token']}"})
    bytes_of = {"Content-Type": "application/octet-stream"}
    query = {"name": "cam_20261122_100000.jpg"}

    first = sender.post(address, params=query, content=photograph(2), headers=bytes_of)
    second = sender.post(address, params=query, content=photograph(2), headers=bytes_of)

    assert (first.status_code, second.status_code) == (201, 200)
    assert first.json()["id"] == second.json()["id"]
    assert first.json()["captured_at"] == "2026-11-22T09:00:00Z"  # the camera is in Berlin
    assert sender.post(address, content=b"<svg/>", headers=bytes_of).status_code == 415
    elsewhere = f"/api/v1/cameras/{other.id}/drop"
    assert sender.post(elsewhere, content=photograph(3), headers=bytes_of).status_code == 403
    assert sender.get("/api/v1/images").status_code == 403
    assert sender.post("/api/v1/tokens", json={}).status_code == 403


def test_a_standing_run_grows_and_fuses_again_what_was_heard_late(
    client: TestClient, database: Database, settings: Settings
) -> None:
    """New images join the same run; late reports undo poses, but none that a person judged."""
    jobs = JobClient(settings.database_url)
    at = now() - timedelta(minutes=10)
    with database.writing() as session:
        harbour = make_harbour(session, images=0)
        images = [
            make_image(session, harbour.camera, harbour.viewport, at + timedelta(seconds=second))
            for second in (0, 1)
        ]
    body = {"viewport_id": harbour.viewport.id, "detector": harbour.model.name}
    made = client.post("/api/v1/standing-runs", json=body)
    assert made.status_code == 201
    standing_id = made.json()["id"]

    def look() -> Run:
        with database.writing() as session:
            standing.look_after(session, jobs, standing_id)
            run_id = standing.get(session, standing_id).run_id
            assert run_id is not None
            return session.get_one(Run, run_id)

    def finish(run: Run) -> None:
        with database.writing() as session:
            session.get_one(Run, run.id).status = RunStatus.SUCCEEDED
            session.execute(sa.update(RunImage).values(done_at=now()))

    run = look()
    assert look().id == run.id  # a worker is at it: nothing to do
    with database.writing() as session:
        poses = [make_pose(session, run, image) for image in images]
        session.add(Review(pose_id=poses[1].id, grade=Grade.GOOD, reasons=[], guideline_version=1))
    finish(run)
    assert look().status is RunStatus.SUCCEEDED  # nothing came
    with database.writing() as session:
        make_image(session, harbour.camera, harbour.viewport, at + timedelta(seconds=9))
    grown = look()
    assert (grown.id, grown.status, grown.image_count) == (run.id, RunStatus.QUEUED, 3)
    finish(grown)
    with database.writing() as session:
        session.add(
            AisPosition(
                site_id=harbour.site.id,
                mmsi=211_000_009,
                fix_time=at,
                received_at=now(),
                lat_deg=53.5,
                lon_deg=9.9,
            )
        )
    assert look().status is RunStatus.QUEUED
    with database.reading() as session:
        assert list(session.scalars(sa.select(Pose.id))) == [poses[1].id]
        waiting = sa.select(RunImage.image_id).where(RunImage.done_at.is_(None))
        assert images[1].id not in set(session.scalars(waiting))
    finish(grown)
    assert look().status is RunStatus.SUCCEEDED  # that report was seen to
    jobs.destroy()


def test_the_live_page_starts_and_pauses(
    browser_of: Callable[[User], TestClient], make_user: MakeUser, admin: User, database: Database
) -> None:
    """An operator starts and pauses; only an administrator names folders of the server."""
    with database.writing() as session:
        harbour = make_harbour(session)
    operator = browser_of(make_user(Role.OPERATOR, harbour.site.id))
    page = f"/cameras/{harbour.camera.id}/live"
    form = {"viewport_id": str(harbour.viewport.id), "detector": harbour.model.name}
    started = operator.post(f"/cameras/{harbour.camera.id}/standing-runs", data=form)
    assert started.status_code == 303
    with database.reading() as session:
        standing_id = session.scalars(sa.text("SELECT id FROM standing_runs")).one()
    assert operator.post(f"/standing-runs/{standing_id}/pause").status_code == 303
    assert "paused" in operator.get(page).text
    watch = f"/cameras/{harbour.camera.id}/watched-folders"
    assert operator.post(watch, data={"path": "/etc"}).status_code == 403
    browser = browser_of(admin)
    assert "whole path" in browser.post(watch, data={"path": "photos"}).text
    assert browser.post(watch, data={"path": "/srv/photos"}).status_code == 303
    assert "/srv/photos" in operator.get(page).text
    made = operator.post(f"/cameras/{harbour.camera.id}/drop-tokens")
    assert "Copy the token now" in made.text
    assert "Copy the token now" not in operator.get(page).text
