"""Images over REST: taken in by content, timed, found, served and hidden."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from io import BytesIO
from urllib.parse import quote

import pytest
import simplejpeg
from fastapi import FastAPI
from PIL import Image as Picture
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database
from app.tables.identity import Role
from app.tables.imagery import Image
from app.tables.sites import Camera
from tests.factories.archives import zipped
from tests.factories.imagery import make_image, photograph
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.integration.conftest import MakeUser
from tests.integration.imagery.conftest import Upload


def test_an_upload_is_stored_and_shown(client: TestClient, camera: Camera, upload: Upload) -> None:
    """What was uploaded comes back: its facts, its very bytes, and a preview."""
    data = photograph()
    made = upload(data)
    assert made.status_code == 201
    image = made.json()
    assert made.headers["location"] == f"/api/v1/images/{image['id']}"
    assert image["camera_id"] == camera.id
    assert image["captured_at"] == "2026-11-22T10:00:05Z"
    assert image["captured_at_source"] == "given"
    assert (image["width_px"], image["height_px"], image["size_bytes"]) == (64, 48, len(data))
    assert client.get(made.headers["location"]).json() == image
    file = client.get(image["file_url"])
    assert file.content == data
    preview = client.get(image["preview_url"])
    assert preview.headers["content-type"] == "image/jpeg"
    assert simplejpeg.decode_jpeg(preview.content).shape == (48, 64, 3)


def test_files_are_served_as_what_they_are(upload: Upload, client: TestClient) -> None:
    """The media type is found in the bytes, and the headers keep a browser from running them."""
    image = upload(photograph(kind="PNG"), "page.html", "text/html").json()
    file = client.get(image["file_url"])
    assert file.headers["content-type"] == "image/png"
    assert file.headers["x-content-type-options"] == "nosniff"
    assert file.headers["content-security-policy"] == "sandbox"
    assert file.headers["etag"] == f'"{image["sha256"]}"'
    assert file.headers["cache-control"] == "private, max-age=31536000, immutable"
    again = client.get(image["file_url"], headers={"If-None-Match": file.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_the_same_bytes_are_the_same_image(client: TestClient, upload: Upload) -> None:
    """A second upload of the same bytes answers 200 with the same id, even without a time."""
    first = upload(photograph())
    second = upload(photograph(), captured_at=None)
    assert (first.status_code, second.status_code) == (201, 200)
    assert first.json() == second.json()
    assert len(client.get("/api/v1/images").json()["items"]) == 1


def test_simultaneous_uploads_make_one_image(
    app: FastAPI, client: TestClient, camera: Camera, database: Database
) -> None:
    """Ten uploads of the same bytes at once: one is new, all have the same id, none fails."""
    data = photograph()

    def send(_: int) -> tuple[int, int]:
        answer = TestClient(app, headers=dict(client.headers)).post(
            "/api/v1/images",
            files={"file": ("a.jpg", data)},
            data={"camera_id": camera.id, "captured_at": "2026-11-22T10:00:05Z"},
        )
        return answer.status_code, answer.json()["id"]

    with ThreadPoolExecutor(10) as pool:
        answers = list(pool.map(send, range(10)))
    assert sorted(status for status, _ in answers) == [200] * 9 + [201]
    assert len({identifier for _, identifier in answers}) == 1
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 1


@pytest.mark.parametrize(
    ("data", "status"),
    [
        (b"<!doctype html><script>alert(1)</script>", 415),
        (b'<svg xmlns="http://www.w3.org/2000/svg" onload="alert(1)"/>', 415),
        (b"GIF89a" + b"\0" * 40, 415),
        (b"", 415),
        (photograph()[:-300], 422),
        (photograph()[:20], 422),
        (photograph(kind="PNG")[:-300], 422),
        (photograph(kind="WEBP")[:-300], 422),
        (photograph(width_px=48, height_px=64), 422),
        (photograph(orientation=6), 422),
        (photograph(kind="PNG", orientation=6), 422),
    ],
    ids=[
        "html",
        "svg",
        "gif",
        "empty",
        "cut jpeg",
        "cut header",
        "cut png",
        "cut webp",
        "other size",
        "lies on its side, so of other size",
        "turned png",
    ],
)
def test_what_is_no_photograph_of_the_camera_is_refused(
    upload: Upload, client: TestClient, data: bytes, status: int
) -> None:
    """Whatever type the sender claims, other formats give 415, broken pictures 422; no row."""
    answer = upload(data, "photo.jpg", "image/jpeg")
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert client.get("/api/v1/images").json()["items"] == []


def test_an_archive_of_photographs_is_no_photograph(upload: Upload, client: TestClient) -> None:
    """A zip gives 415, and the answer says what to do with it."""
    answer = upload(zipped({"a.jpg": photograph()}), "day.zip", "application/zip")
    assert answer.status_code == 415
    assert "is a zip archive; unpack it and upload the photographs" in answer.json()["detail"]
    assert client.get("/api/v1/images").json()["items"] == []


def test_a_wrong_size_names_both_sizes(upload: Upload) -> None:
    """The answer says the photograph's size and the camera's."""
    detail = upload(photograph(width_px=32, height_px=24)).json()["detail"]
    assert "32 x 24" in detail
    assert "64 x 48" in detail


def test_a_pixel_bomb_is_refused_by_its_header(upload: Upload) -> None:
    """A few bytes that claim a gigapixel give 413: nothing is decoded."""
    target = BytesIO()
    Picture.new("1", (40_000, 30_000)).save(target, "PNG")
    answer = upload(target.getvalue(), "bomb.png", "image/png")
    assert answer.status_code == 413


def test_a_file_beyond_the_limit_is_refused(
    app: FastAPI, client: TestClient, camera: Camera
) -> None:
    """More bytes than the installation takes give 413."""
    app.state.settings.max_upload_bytes = 1000
    answer = client.post(
        "/api/v1/images",
        files={"file": ("a.jpg", photograph())},
        data={"camera_id": camera.id, "captured_at": "2026-11-22T10:00:05Z"},
    )
    assert answer.status_code == 413


@pytest.mark.parametrize(
    ("name", "photo", "given", "captured_at", "source"),
    [
        ("a.jpg", {}, "2026-07-01T12:00:00", "2026-07-01T10:00:00Z", "given"),
        ("a.jpg", {}, "2026-07-01T12:00:00+05:00", "2026-07-01T07:00:00Z", "given"),
        ("a.jpg", {"taken": "2026:01:02 03:04:05"}, None, "2026-01-02T02:04:05Z", "exif"),
        (
            "20200101_000000.jpg",
            {"taken": "2026:01:02 03:04:05", "offset": "-03:30"},
            None,
            "2026-01-02T06:34:05Z",
            "exif",
        ),
        (
            "20260102_030405.jpg",
            {"taken": "0000:00:00 00:00:00"},
            None,
            "2026-01-02T02:04:05Z",
            "file_name",
        ),
        ("quay_31-12-2026_23.59.58 (2).jpg", {}, None, "2026-12-31T22:59:58Z", "file_name"),
        ("harbour-2026-01-02T03-04-05-7.jpg", {}, None, "2026-01-02T02:04:05Z", "file_name"),
    ],
)
def test_the_moment_comes_from_the_best_source(
    upload: Upload,
    name: str,
    photo: dict[str, str],
    given: str | None,
    captured_at: str,
    source: str,
) -> None:
    """Given before EXIF before the file's name; without a zone it is the camera's."""
    image = upload(photograph(**photo), name, captured_at=given).json()
    assert (image["captured_at"], image["captured_at_source"]) == (captured_at, source)


@pytest.mark.parametrize("name", ["photo.jpg", "20261399_999999.jpg", "1234567890123456789.jpg"])
def test_a_photograph_that_does_not_tell_its_time_is_refused(upload: Upload, name: str) -> None:
    """Without any source of the moment the answer is 422 naming captured_at and the ways out."""
    answer = upload(photograph(), name, captured_at=None)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "captured_at"
    assert "file name pattern" in answer.json()["detail"]


@pytest.mark.parametrize("moment", ["yesterday", "0001-01-01T00:00:00Z", "9999-12-31T23:59:59"])
def test_an_absurd_moment_is_refused(upload: Upload, moment: str) -> None:
    """A moment that is none, or of another age, gives 422 naming the field."""
    answer = upload(photograph(), captured_at=moment)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "captured_at"


@pytest.mark.parametrize(
    ("name", "kept"),
    [
        ("/etc/passwd", "passwd"),
        ("C:\\photos\\evening.jpg", "evening.jpg"),
        ("../../up.jpg", "up.jpg"),
        ("a%0D%0ASet-Cookie: x=1.jpg", "a%0D%0ASet-Cookie: x=1.jpg"),
        ("nul\0byte.jpg", "nulbyte.jpg"),
        ("möwe 鷗.jpg", "möwe 鷗.jpg"),
        ("x" * 1500 + ".jpg", "x" * 194 + ".jpg"),
        ('quote".jpg', 'quote".jpg'),
        ("..", "image.jpg"),
    ],
)
def test_any_file_name_is_accepted_and_harmless(
    client: TestClient, camera: Camera, name: str, kept: str
) -> None:
    """Names with folders, control characters or great length are tidied, and sent back encoded."""
    raw = name.replace('"', "%22").encode()  # as browsers do
    part = b'--limit\r\nContent-Disposition: form-data; name="file"; filename="%s"\r\n\r\n%s\r\n'
    field = b'--limit\r\nContent-Disposition: form-data; name="%s"\r\n\r\n%s\r\n'
    body = (
        part % (raw, photograph())
        + field % (b"camera_id", str(camera.id).encode())
        + field % (b"captured_at", b"2026-11-22T10:00:05Z")
        + b"--limit--\r\n"
    )
    answer = client.post(
        "/api/v1/images",
        content=body,
        headers={"Content-Type": "multipart/form-data; boundary=limit"},
    )
    assert answer.status_code == 201
    stored = answer.json()["file_name"].replace("%22", '"')
    assert stored == kept
    header = client.get(answer.json()["file_url"]).headers["content-disposition"]
    assert header.endswith(f"filename*=UTF-8''{quote(answer.json()['file_name'], safe='')}")
    assert header.isascii()


def test_one_range_at_a_time(client: TestClient, upload: Upload) -> None:
    """A single range gives 206 with those bytes; ten thousand of them, or one beyond, give 416."""
    data = photograph()
    address = upload(data).json()["file_url"]

    def part(wanted: str) -> tuple[int, bytes]:
        answer = client.get(address, headers={"Range": wanted})
        return answer.status_code, answer.content

    assert part("bytes=10-19") == (206, data[10:20])
    assert part("bytes=-5") == (206, data[-5:])
    assert part(f"bytes={len(data) - 3}-") == (206, data[-3:])
    assert part("bytes=0-999999") == (206, data)
    assert part("lines=1-2") == (200, data)
    assert part(f"bytes={len(data)}-")[0] == 416
    assert part("bytes=-0")[0] == 416
    assert part("bytes=" + ",".join(["0-0"] * 10_000))[0] == 416
    refused = client.get(address, headers={"Range": "bytes=999999-"})
    assert refused.headers["content-range"] == f"bytes */{len(data)}"
    stale = client.get(address, headers={"Range": "bytes=0-1", "If-Range": '"other"'})
    assert stale.status_code == 200


def test_previews_come_in_fixed_widths(client: TestClient, database: Database) -> None:
    """Any width is rounded up to a fixed one; each has an ETag of its own; none is enlarged."""
    with database.writing() as session:
        wide = make_camera(session, make_site(session), width_px=1000, height_px=500)
    made = client.post(
        "/api/v1/images",
        files={"file": ("a.jpg", photograph(1, 1000, 500))},
        data={"camera_id": wide.id, "captured_at": "2026-11-22T10:00:05Z"},
    )
    path = f"/api/v1/images/{made.json()['id']}/preview"
    shapes = {}
    tags = set()
    for width in (1, 320, 321, 5000):
        answer = client.get(path, params={"width": width})
        shapes[width] = simplejpeg.decode_jpeg(answer.content).shape[:2]
        tags.add(answer.headers["etag"])
    assert shapes == {1: (160, 320), 320: (160, 320), 321: (320, 640), 5000: (500, 1000)}
    assert len(tags) == 3
    assert client.get(path, params={"width": 0}).status_code == 422


@pytest.mark.parametrize("mode", ["L", "CMYK", "RGBA", "P", "I;16"])
def test_previews_of_unusual_pictures(client: TestClient, upload: Upload, mode: str) -> None:
    """Grey, CMYK, transparent, palette and 16-bit photographs have a preview as well."""
    picture = Picture.open(BytesIO(photograph()))
    if mode == "I;16":
        picture = picture.convert("L").convert("I").point(lambda grey: grey * 256)
    converted = picture.convert(mode)
    target = BytesIO()
    converted.save(target, "JPEG" if mode in {"L", "CMYK"} else "PNG")
    image = upload(target.getvalue()).json()
    preview = client.get(image["preview_url"])
    shown = simplejpeg.decode_jpeg(preview.content, "GRAY").astype(float)
    truth = simplejpeg.decode_jpeg(photograph(), "GRAY").astype(float)
    assert abs(shown.mean() - truth.mean()) < 12


def test_an_image_gets_the_viewport_of_its_time(
    client: TestClient, database: Database, camera: Camera, upload: Upload
) -> None:
    """Uploads find the viewport valid when they were taken; changing its times moves them."""
    noon = datetime(2026, 11, 22, 12, tzinfo=UTC)
    with database.writing() as session:
        morning = make_viewport(session, camera, valid_until=noon)
        evening = make_viewport(session, camera, valid_from=noon)
    before = upload(photograph(1), captured_at="2026-11-22T11:59:59Z").json()
    after = upload(photograph(2), captured_at="2026-11-22T12:00:00Z").json()
    assert (before["viewport_id"], after["viewport_id"]) == (morning.id, evening.id)
    answer = client.patch(
        f"/api/v1/viewports/{evening.id}",
        json={"valid_from": "2026-11-22T13:00:00Z"},
        headers={"If-Match": '"1"'},
    )
    assert answer.status_code == 200
    moved = client.get(f"/api/v1/images/{after['id']}").json()
    assert moved["viewport_id"] is None
    listed = client.get("/api/v1/images", params={"viewport_id": morning.id}).json()["items"]
    assert [image["id"] for image in listed] == [before["id"]]


def test_images_are_found_by_camera_and_time(
    client: TestClient, database: Database, camera: Camera
) -> None:
    """Camera and half-open time filter the list; offsets in the query count."""
    with database.writing() as session:
        other = make_camera(session, make_site(session))
        hours = [
            make_image(session, camera, None, datetime(2026, 11, 22, hour, tzinfo=UTC)).id
            for hour in range(8, 13)
        ]
        make_image(session, other)

    def found(**query: object) -> list[int]:
        answer = client.get("/api/v1/images", params=query)
        assert answer.status_code == 200, answer.text
        return [image["id"] for image in answer.json()["items"]]

    assert found(camera_id=camera.id) == hours
    between = {"from": "2026-11-22T09:00:00Z", "to": "2026-11-22T11:00:00Z"}
    assert found(camera_id=camera.id, **between) == hours[1:3]
    assert found(camera_id=camera.id, to="2026-11-22T10:00:00+01:00") == hours[:1]
    assert found(camera_id=2**40) == []
    assert client.get("/api/v1/images?from=0001-01-01T00:00:00").status_code == 422


def test_a_deleted_image_is_hidden_until_it_comes_again(client: TestClient, upload: Upload) -> None:
    """Deleting gives 404 everywhere; the same bytes bring it back (200) with the new time."""
    made = upload(photograph()).json()
    address = f"/api/v1/images/{made['id']}"
    assert client.delete(address).status_code == 204
    for path in (address, made["file_url"], made["preview_url"]):
        assert client.get(path).status_code == 404
    assert client.delete(address).status_code == 404
    assert client.get("/api/v1/images").json()["items"] == []
    again = upload(photograph(), captured_at="2026-11-22T10:00:09Z")
    assert (again.status_code, again.json()["id"]) == (200, made["id"])
    assert client.get(address).json()["captured_at"] == "2026-11-22T10:00:09Z"


def test_a_foreign_image_does_not_exist(
    client_of: Callable[..., TestClient],
    make_user: MakeUser,
    database: Database,
    upload: Upload,
    camera: Camera,
) -> None:
    """An operator of another site gets 404 for an image on every verb, and for its camera."""
    image = upload(photograph()).json()
    with database.writing() as session:
        own = make_site(session)
    stranger = client_of(make_user(Role.OPERATOR, own.id), *Scope)
    for path in (f"/api/v1/images/{image['id']}", image["file_url"], image["preview_url"]):
        assert stranger.get(path).status_code == 404
    assert stranger.delete(f"/api/v1/images/{image['id']}").status_code == 404
    assert stranger.get("/api/v1/images").json()["items"] == []
    refused = stranger.post(
        "/api/v1/images",
        files={"file": ("a.jpg", photograph(7))},
        data={"camera_id": camera.id, "captured_at": "2026-11-22T10:00:05Z"},
    )
    assert refused.status_code == 404


@pytest.mark.parametrize("path", ["..%2f..%2fetc%2fpasswd/file", "..%2f", "%00/file", "x"])
def test_a_path_upwards_leads_nowhere(client: TestClient, path: str) -> None:
    """Encoded slashes, NUL and text in place of an id give 404."""
    assert client.get(f"/api/v1/images/{path}").status_code == 404
