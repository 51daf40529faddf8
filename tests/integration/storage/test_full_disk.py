"""A full disk and a store behind a URL, seen from outside."""

import uuid
from pathlib import Path

import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.main import create_app
from app.tables.identity import Role
from app.tables.imagery import Image
from tests.factories import identity
from tests.factories.imagery import photograph
from tests.factories.sites import make_camera, make_site
from tests.small_disk import fill, small_disk

MOMENT = "2026-11-22T12:00:00Z"


def signed_in(settings: Settings, database: Database) -> TestClient:
    """Return an administrator's client of an application with these settings."""
    with database.writing() as session:
        user = identity.make_user(session, Role.ADMIN)
        token = identity.make_token(session, user)
    return TestClient(create_app(settings), headers={"Authorization": f"Bearer {token}"})


def camera_id(database: Database) -> int:
    """Store a camera."""
    with database.writing() as session:
        return make_camera(session, make_site(session), width_px=640, height_px=480).id


def upload(client: TestClient, camera: int, data: bytes) -> tuple[int, dict[str, object]]:
    """Upload a photograph."""
    answer = client.post(
        "/api/v1/images",
        files={"file": ("a.jpg", data)},
        data={"camera_id": camera, "captured_at": MOMENT},
    )
    return answer.status_code, answer.json()


def test_an_upload_without_room_is_507_and_goes_well_later(
    database: Database, settings: Settings, tmp_path: Path
) -> None:
    """A full disk refuses the photograph whole; with room again the same process takes it."""
    data = photograph(1, 640, 480)
    camera = camera_id(database)
    with small_disk(tmp_path / "disk", 1 << 20) as disk:
        there = settings.model_copy(update={"storage_url": str(disk / "files")})
        with signed_in(there, database) as client:
            ballast = fill(disk, leave_bytes=len(data) // 2)
            status, problem = upload(client, camera, data)
            assert (status, problem["title"]) == (507, "The disk is full")
            with database.reading() as session:
                assert session.scalar(sa.select(sa.func.count()).select_from(Image)) == 0
            ballast.unlink()
            status, image = upload(client, camera, data)
            assert status == 201
            file = client.get(f"/api/v1/images/{image['id']}/file")
            assert file.content == data


def test_a_database_without_room_is_507_and_goes_on_later(tmp_path: Path) -> None:
    """Also when it is SQLite that finds no room, nothing is half stored and no restart needed."""
    from app.schema import upgrade  # noqa: PLC0415  only this test has a database of its own

    with small_disk(tmp_path / "disk", 6 << 20) as disk:
        url = f"sqlite:///{disk / 'quaymark.db'}"
        database = Database(url)
        upgrade(database)
        settings = Settings(
            data_dir=tmp_path, database_url=url, storage_url=str(tmp_path / "files")
        )
        with signed_in(settings, database) as client:
            ballast = fill(disk)
            sites: list[int] = []
            while sites.count(507) < 2:
                sites.append(_make_site(client, len(sites)))
                assert sites[-1] in {201, 507}
            shown = client.get("/api/v1/sites").json()["items"]
            assert len(shown) == sites.count(201)
            ballast.unlink()
            assert _make_site(client, 99) == 201
        database.dispose()


def _make_site(client: TestClient, number: int) -> int:
    place = {"lat_deg": 53.5, "lon_deg": 10.0, "height_m": 40.0}
    body = {"name": f"Site {number} " + "x" * 150, "origin": place}
    return client.post("/api/v1/sites", json=body).status_code


def test_a_store_behind_a_url_serves_whole_and_in_parts(
    database: Database, settings: Settings
) -> None:
    """An fsspec URL instead of a folder makes no difference to uploads, ranges and previews."""
    data = photograph(2, 640, 480)
    camera = camera_id(database)
    there = settings.model_copy(update={"storage_url": f"memory://bucket-{uuid.uuid4().hex}"})
    with signed_in(there, database) as client:
        status, image = upload(client, camera, data)
        again, same = upload(client, camera, data)
        assert (status, again, same["id"]) == (201, 200, image["id"])
        url = f"/api/v1/images/{image['id']}/file"
        assert client.get(url).content == data
        part = client.get(url, headers={"Range": "bytes=100-199"})
        assert (part.status_code, part.content) == (206, data[100:200])
        preview = client.get(f"/api/v1/images/{image['id']}/preview?width=320")
        assert preview.status_code == 200
        assert preview.headers["content-type"] == "image/jpeg"


def test_drafts_are_no_files_of_the_store(database: Database, settings: Settings) -> None:
    """Nothing but whole files stands in the folder after uploads."""
    root = Path(settings.storage_url)
    camera = camera_id(database)
    with signed_in(settings, database) as client:
        statuses = [upload(client, camera, photograph(seed, 640, 480))[0] for seed in range(3)]
    assert statuses == [201] * 3
    assert sorted(len(path.name) for path in root.rglob("*") if path.is_file()) == [64] * 3
