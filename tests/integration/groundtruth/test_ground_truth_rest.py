"""Boxes by people over REST: a real file in and out, drawing, links with photographs."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy.orm import Session
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.db import Database
from app.tables.imagery import Image
from app.tables.sites import Camera
from tests.factories.world import make_world

API = "/api/v1/ground-truth"
TRUTH = "real/bonk/ground_truth_2d_coco.json"
PLACE = {"x1_px": 10.0, "y1_px": 20.0, "x2_px": 30.5, "y2_px": 40.0}


@pytest.fixture
def ids(database: Database) -> dict[str, int]:
    """Return the ids of one of everything on a site."""
    with database.writing() as session:
        return make_world(session, "north", 211000001)


def send(client: TestClient, site_id: int, document: Any, path: str = "files", **form: Any) -> Any:
    """Send a file with a form."""
    data = document if isinstance(document, bytes) else json.dumps(document).encode()
    return client.post(
        f"{API}/{path}",
        files={"file": ("boxes.json", data, "application/json")},
        data={"site_id": site_id, **form},
    )


def small(**changes: Any) -> dict[str, Any]:
    """Return a file of two images, one of them without a box."""
    document: dict[str, Any] = {
        "images": [
            {"id": 4, "file_name": "set/a.jpg", "width": 640, "height": 480, "license": 2},
            {"id": 0, "file_name": "b.jpg", "width": 640, "height": 480},
        ],
        "categories": [{"id": 7, "name": "boat", "supercategory": "thing"}],
        "annotations": [
            {"id": 0, "image_id": 4, "category_id": 7, "bbox": [1, 2.5, 30, 40], "area": 900},
            {
                "id": 9,
                "image_id": 4,
                "category_id": 7,
                "bbox": [0.1, 0.2, 0.7, 600.3],
                "iscrowd": 1,
            },
        ],
        "licenses": [{"id": 2, "name": "own"}],
    }
    return document | changes


def test_the_real_file_comes_in_and_goes_out_equal(
    client: TestClient, ids: dict[str, int], shared_dir: Path
) -> None:
    """998 images that are not here, 3,945 boxes, a sixth category: all of it as it came."""
    data = (shared_dir / TRUTH).read_bytes()
    refused = send(client, ids["site_id"], data)
    assert refused.status_code == 422
    assert "boat (4 boxes)" in refused.json()["detail"]
    answer = send(client, ids["site_id"], data, map='{"boat": "ship"}')
    assert answer.status_code == 201, answer.text
    imported = answer.json()
    assert (imported["images"], imported["boxes"], imported["linked"]) == (998, 3945, 0)
    again = send(client, ids["site_id"], data, map='{"5": "ship"}')
    assert (again.status_code, again.json()["file_id"]) == (200, imported["file_id"])
    out = client.get(f"{API}/coco", params={"file_id": imported["file_id"]})
    assert out.json() == json.loads(data)
    ships = client.get(f"{API}/boxes", params={"file_id": imported["file_id"], "limit": 1})
    assert ships.json()["items"][0]["image_id"] is None


def test_what_is_drawn_and_changed_goes_out_beside_what_stays(
    client: TestClient, ids: dict[str, int]
) -> None:
    """A moved box gets new numbers, a new one a free id; everything else is as it came."""
    document = small()
    file_id = send(client, ids["site_id"], document, map='{"boat": "ship"}').json()["file_id"]
    first, second = client.get(f"{API}/boxes", params={"file_id": file_id}).json()["items"]
    changed = client.patch(
        f"{API}/boxes/{first['id']}",
        json={"x2_px": 101.0, "vessel_class": "subvessel"},
        headers={"If-Match": f'"{first["version"]}"'},
    )
    assert changed.status_code == 200, changed.text
    assert changed.json()["area_px2"] == 4000
    new = client.post(
        f"{API}/boxes",
        json={
            "ground_truth_image_id": first["ground_truth_image_id"],
            "vessel_class": "ship",
            **PLACE,
        },
    ).json()
    out = client.get(f"{API}/coco", params={"file_id": file_id}).json()
    assert out["images"] == document["images"]
    assert out["licenses"] == document["licenses"]
    moved, kept, drawn = out["annotations"]
    assert kept == document["annotations"][1]
    names = {category["id"]: category["name"] for category in out["categories"]}
    assert (moved["id"], moved["bbox"], moved["area"]) == (0, [1, 2.5, 100, 40], 4000)
    assert names[moved["category_id"]] == "subvessel"
    assert (drawn["id"], drawn["bbox"]) == (10, [10, 20, 20.5, 20])
    assert names[drawn["category_id"]] == "ship"
    gone = client.delete(f"{API}/boxes/{new['id']}", headers={"If-Match": f'"{new["version"]}"'})
    assert gone.status_code == 204
    assert client.get(f"{API}/boxes/{new['id']}").status_code == 404
    back = client.post(f"{API}/boxes/{new['id']}/restore")
    assert {name: back.json()[name] for name in PLACE} == PLACE
    assert second["is_crowd"]


def test_an_absent_photograph_is_linked_when_it_has_come(
    client: TestClient, database: Database, ids: dict[str, int]
) -> None:
    """Same name and size, one photograph only, and a person says so."""
    send(client, ids["site_id"], small(), map='{"boat": "ship_moored"}')
    with database.writing() as session:
        photo = _photograph(session, ids, "a.jpg")
        _photograph(session, ids, "b.jpg", width_px=320)
    assert client.post(f"{API}/links", json={"site_id": ids["site_id"]}).json() == {"linked": 1}
    boxes = client.get(f"{API}/boxes", params={"image_id": photo}).json()["items"]
    assert [box["vessel_class"] for box in boxes] == ["ship_moored", "ship_moored"]
    assert client.post(f"{API}/links", json={"site_id": ids["site_id"]}).json() == {"linked": 0}


def test_drawing_asks_for_the_version_and_stays_in_the_image(
    client: TestClient, ids: dict[str, int]
) -> None:
    """428 without a version, 412 with an old one, 422 beyond the image's edge."""
    url = f"{API}/boxes/{ids['box_id']}"
    assert client.patch(url, json={"x2_px": 9.0}).status_code == 428
    assert client.patch(url, json={}, headers={"If-Match": '"99"'}).status_code == 412
    for place in (PLACE | {"x2_px": 9.0}, PLACE | {"y2_px": 9000.0}):
        answer = client.post(
            f"{API}/boxes", json={"image_id": ids["image_id"], "vessel_class": "ship", **place}
        )
        assert answer.status_code == 422, place
    image = client.get(f"{API}/images/{ids['ground_truth_image_id']}")
    done = client.patch(
        f"{API}/images/{ids['ground_truth_image_id']}",
        json={"is_complete": True},
        headers={"If-Match": image.headers["ETag"]},
    )
    assert done.json()["is_complete"]
    assert done.json()["completed_at"] is not None


BAD: tuple[tuple[dict[str, Any], str], ...] = (
    ({"images": None}, "file"),
    ({"images": [{"id": 4, "file_name": "a.jpg", "width": 0, "height": 3}]}, "images[0].width"),
    ({"images": [small()["images"][0]] * 2}, "images[1].id"),
    ({"categories": []}, "annotations[0].category_id"),
    ({"annotations": [{"id": 1, "image_id": 8, "category_id": 7}]}, "annotations[0].image_id"),
    (
        {"annotations": [{"id": 1, "image_id": 4, "category_id": 7, "bbox": [0, 0, 1e999, 1]}]},
        "file",
    ),
    (
        {"annotations": [{"id": 1, "image_id": 4, "category_id": 7, "bbox": [700, 0, 5, 5]}]},
        "annotations[0].bbox",
    ),
    ({"info": {"description": "a\0b"}}, "file"),
)


def test_a_bad_file_is_refused_with_the_place(client: TestClient, ids: dict[str, int]) -> None:
    """Nothing is stored, and the error names entry and field."""
    for changes, field in BAD:
        answer = send(client, ids["site_id"], small(**changes), map='{"boat": "ship"}')
        assert answer.status_code == 422, answer.text
        assert answer.json()["errors"][0]["field"] == field
    assert len(client.get(f"{API}/files").json()["items"]) == 1


def test_who_may_only_read_neither_draws_nor_imports(
    client_of: Callable[..., TestClient], admin: Any, ids: dict[str, int]
) -> None:
    """Reading shows boxes; drawing takes the scope review, files take ingest."""
    reader = client_of(admin, Scope.READ)
    assert reader.get(f"{API}/boxes/{ids['box_id']}").status_code == 200
    body = {"image_id": ids["image_id"], "vessel_class": "ship", **PLACE}
    assert reader.post(f"{API}/boxes", json=body).status_code == 403
    assert send(reader, ids["site_id"], small()).status_code == 403
    looked = send(client_of(admin, Scope.INGEST), ids["site_id"], small(), "files/preview")
    assert looked.json()["categories"][0] == {
        "category_id": 7,
        "name": "boat",
        "boxes": 2,
        "proposed": None,
    }


def _photograph(session: Session, ids: dict[str, int], name: str, **columns: Any) -> int:
    camera = session.get_one(Camera, ids["camera_id"])
    known = session.get_one(Image, ids["image_id"])
    values: dict[str, Any] = {
        "site_id": camera.site_id,
        "camera_id": camera.id,
        "sha256": f"{name:0>64}",
        "media_type": "image/jpeg",
        "file_name": name,
        "size_bytes": 1,
        "width_px": 640,
        "height_px": 480,
        "captured_at": known.captured_at,
        "captured_at_source": known.captured_at_source,
    }
    image = Image(**(values | columns))
    session.add(image)
    session.flush()
    return image.id
