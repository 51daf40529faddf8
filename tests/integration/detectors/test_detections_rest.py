"""Boxes of other detectors come in as COCO results: all of a file or nothing."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.detectors.imported import import_coco_detections
from app.detectors.service import IMPORTED_FAMILY, IMPORTED_SETTINGS_SHA256
from app.runs.batch_repository import known_detections
from app.tables.detection import Detection, DetectionSet, Model
from app.tables.identity import Role
from app.tables.imagery import Image
from app.tables.sites import Camera
from tests.factories.detectors import entry, results
from tests.factories.imagery import make_image
from tests.factories.sites import make_camera, make_site
from tests.integration.conftest import MakeUser

BOX = [10.0, 20.0, 30.5, 8.0]


def send(client: TestClient, data: bytes, *, images: bytes | None = None, **form: object) -> Any:
    """Upload results; returns the response."""
    files = {"file": ("boxes.json", data)}
    if images is not None:
        files["images"] = ("images.json", images)
    return client.post("/api/v1/detections", files=files, data=form)


def boxes_of(database: Database, image: Image) -> list[tuple[float, ...]] | None:
    """Return an image's boxes as x1, y1, x2, y2, score, class; None without a set."""
    with database.reading() as session:
        found = session.scalars(
            select(DetectionSet).where(
                DetectionSet.image_sha256 == image.sha256,
                DetectionSet.settings_sha256 == IMPORTED_SETTINGS_SHA256,
            )
        ).one_or_none()
        if found is None:
            return None
        return [(d.x1_px, d.y1_px, d.x2_px, d.y2_px, d.score, d.class_id) for d in found.detections]


def test_a_list_of_results(client: TestClient, database: Database, images: list[Image]) -> None:
    """Images by our id or by file name get their boxes; a model stands for the source."""
    data = results((images[0].id, BOX, 0.9), (images[0].id, [0, 0, 5, 5], 0.3), ("x/b.jpg", BOX, 1))
    answer = send(client, data, name="yolox-x by hand")
    assert answer.status_code == 201, answer.text
    body = answer.json()
    assert (body["images"], body["detections"], body["ignored"]) == (2, 3, 0)
    assert body["model"]["name"] == "yolox-x by hand"
    assert (body["model"]["family"], body["model"]["status"]) == (IMPORTED_FAMILY, "ready")
    assert answer.headers["location"] == f"/api/v1/models/{body['model']['id']}"
    first = boxes_of(database, images[0])
    assert first == [(10.0, 20.0, 40.5, 28.0, 0.9, 8), (0.0, 0.0, 5.0, 5.0, 0.3, 8)]
    assert boxes_of(database, images[1]) == [(10.0, 20.0, 40.5, 28.0, 1.0, 8)]
    assert boxes_of(database, images[2]) is None

    again = send(client, data, name="yolox-x by hand")
    assert again.status_code == 200
    assert again.json() == body
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(Detection)) == 3


def test_boxes_without_area_are_kept_and_told(
    client: TestClient, database: Database, images: list[Image]
) -> None:
    """They count as false detections, also at the border; a run's matching passes them over."""
    flat = [[10.0, 20.0, 0.0, 8.0], [64.0, 2.0, 0.0, 0.0]]
    body = send(client, results(*((images[0].id, box, 0.9) for box in (BOX, *flat)))).json()
    assert (body["detections"], body["without_area"]) == (3, 2)
    assert body["notes"][0].startswith("2 boxes have no width or no height")
    assert (boxes_of(database, images[0]) or [])[1] == (10.0, 20.0, 10.0, 28.0, 0.9, 8)
    with database.reading() as session:
        sets = known_detections(
            session, [images[0].sha256], body["model"]["sha256"], IMPORTED_SETTINGS_SHA256
        )
    assert [box.score for box in sets[images[0].sha256].boxes] == [0.9, -1.0, -1.0]
    assert all(box.has_area for box in sets[images[0].sha256].boxes)
    nothing = send(client, b"[]", name="nothing").json()
    assert nothing["notes"][0].startswith("The file says that nothing was found, and in no image")


def test_results_that_were_deleted_are_imported_again(
    client: TestClient, database: Database, images: list[Image]
) -> None:
    """The same file makes another model of the same boxes, beside the one that waits deleted."""
    data = results((images[0].id, BOX, 0.9))
    first = send(client, data).json()["model"]["id"]
    assert client.delete(f"/api/v1/models/{first}").status_code == 204
    again = send(client, data)
    assert (again.status_code, again.json()["detections"]) == (201, 1)
    assert again.json()["model"]["id"] != first
    assert len(boxes_of(database, images[0]) or []) == 1


@pytest.mark.parametrize("beside", [False, True], ids=["one file", "two files"])
def test_a_list_of_images_gives_empty_sets(
    client: TestClient, database: Database, images: list[Image], beside: object
) -> None:
    """With a list of images, ids are the list's own, and images without boxes get empty sets."""
    listed = [{"id": 70 + n, "file_name": f"cam/{name}.jpg"} for n, name in enumerate("abc")]
    found = [entry(71, BOX, 0.5), entry(71, BOX, 0.4, category_id=3)]
    whole: dict[str, Any] = {"annotations": found} | ({} if beside else {"images": listed})
    answer = send(
        client,
        json.dumps(whole).encode(),
        images=json.dumps({"images": listed}).encode() if beside else None,
        categories='{"9": 8, "3": 0}',
    )
    assert answer.status_code == 201, answer.text
    assert (answer.json()["images"], answer.json()["detections"]) == (3, 2)
    assert answer.json()["model"]["name"] == "boxes.json"
    assert [boxes_of(database, image) for image in (images[0], images[2])] == [[], []]
    assert [box[5] for box in boxes_of(database, images[1]) or []] == [8, 0]


@pytest.mark.parametrize(
    ("used", "named", "given", "kept"),
    [
        ([9, 1], None, "", [9]),
        ([8, 8], None, "", [8, 8]),
        ([1], None, "", [1]),
        ([0], None, "", [0]),
        ([1, 2], [{"id": 1, "name": "person"}, {"id": 2, "name": "Ship"}], "", [2]),
        ([1, 2, 9], None, '{"1": 8}', [1]),
        ([1, 2], None, "", None),
        ([3], None, "", None),
        ([9], None, "[9]", None),
        ([9], None, '{"9": "boat"}', None),
    ],
)
def test_which_categories_are_vessels(
    client: TestClient,
    images: list[Image],
    used: list[int],
    named: list[dict[str, object]] | None,
    given: str,
    kept: list[int] | None,
) -> None:
    """What the caller says, else names, else COCO's boat, else the only one; else it is asked."""
    found = [entry(images[0].id, BOX, 0.5, category_id=category) for category in used]
    whole = {"annotations": found, "categories": named}
    answer = send(client, json.dumps(whole).encode(), categories=given)
    if kept is None:
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == "categories"
    else:
        assert answer.status_code == 201, answer.text
        assert answer.json()["detections"] == len(kept)
        assert answer.json()["ignored"] == len(used) - len(kept)


@pytest.mark.parametrize(
    ("bad", "field"),
    [
        (entry("a.jpg", [1, 2, 3], 0.5), "[1].bbox"),
        (entry("a.jpg", [1, 2, float("nan"), 4], 0.5), "[1].bbox"),
        (entry("a.jpg", [1, 2, 10**400, 4], 0.5), "[1].bbox"),
        (entry("a.jpg", [1, 2, -3, 4], 0.5), "[1].bbox"),
        (entry("a.jpg", [64, 2, 3, 4], 0.5), "[1].bbox"),
        (entry("a.jpg", "1 2 3 4", 0.5), "[1].bbox"),
        (entry("a.jpg", BOX, 1.5), "[1].score"),
        (entry("a.jpg", BOX, None), "[1].score"),
        (entry("a.jpg", BOX, True), "[1].score"),
        (entry("z.jpg", BOX, 0.5), "[1].image_id"),
        (entry(10**30, BOX, 0.5), "[1].image_id"),
        (entry(2**40, BOX, 0.5), "[1].image_id"),
        (entry(None, BOX, 0.5), "[1].image_id"),
        (entry("a.jpg", BOX, 0.5, category_id="boat"), "[1].category_id"),
        ("nonsense", "[1]"),
    ],
)
def test_an_error_names_entry_and_field(
    client: TestClient, database: Database, images: list[Image], bad: object, field: str
) -> None:
    """One bad entry refuses the file, named by its index; nothing of the file is stored."""
    data = json.dumps([entry(images[0].id, BOX, 0.5), bad]).encode()
    answer = send(client, data)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == field
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(Model)) == 0
        assert session.scalar(select(func.count()).select_from(DetectionSet)) == 0


@pytest.mark.parametrize("data", [b"", b"{", b"[" * 100_000, b"7", b"{}", b"\xff\xfe"])
def test_what_is_no_results_file(client: TestClient, data: bytes) -> None:
    """Broken JSON and other JSON are refused with a reason."""
    answer = send(client, data)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "file"


def test_names_are_looked_up_in_one_camera(
    client: TestClient, database: Database, camera: Camera, images: list[Image]
) -> None:
    """A file name that two cameras use is refused until the camera is given."""
    with database.writing() as session:
        other = make_camera(session, session.merge(camera).site)
        twin = make_image(session, other, file_name="a.jpg", sha256="7" * 64)
    data = results(("a.jpg", BOX, 0.5))
    answer = send(client, data)
    assert answer.status_code == 422
    assert "give the camera" in answer.json()["detail"]
    assert send(client, data, camera_id=camera.id).status_code == 201
    assert boxes_of(database, images[0])
    assert boxes_of(database, twin) is None


def test_only_images_one_may_work_on(
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
    database: Database,
    camera: Camera,
    images: list[Image],
) -> None:
    """Foreign images do not exist; a site's viewer may not add boxes, its operator may."""
    data = results((images[0].id, BOX, 0.5))
    with database.writing() as session:
        elsewhere = make_site(session)
    stranger = client_of(make_user(Role.OPERATOR, elsewhere.id))
    assert send(stranger, data).status_code == 422
    assert send(client_of(make_user(Role.VIEWER, camera.site_id)), data).status_code == 403
    assert send(client_of(make_user(Role.OPERATOR, camera.site_id)), data).status_code == 201


def test_the_service_for_the_demo(database: Database, images: list[Image]) -> None:
    """Without a web around it the import does the same, and says what is new."""
    data = results((images[0].id, BOX, 0.5), category_id=1)
    first = import_coco_detections(database, data, name="rendered")
    second = import_coco_detections(database, data, name="rendered")
    assert (first.created, second.created) == (True, False)
    assert first.model.id == second.model.id
    assert boxes_of(database, images[0]) == [(10.0, 20.0, 40.5, 28.0, 0.5, 8)]


def test_too_large_a_file(client: TestClient, settings: Settings) -> None:
    """Beyond the limit of uploads the answer is 413."""
    answer = send(client, b"[" + b" " * (settings.max_upload_bytes + 2**21))
    assert answer.status_code == 413


def test_real_ground_truth_is_no_result(client: TestClient, shared_dir: Path) -> None:
    """The published ground truth has boxes without scores: refused by entry, or by its images."""
    answer = send(client, (shared_dir / "real/bonk/ground_truth_2d_coco.json").read_bytes())
    assert answer.status_code == 422
