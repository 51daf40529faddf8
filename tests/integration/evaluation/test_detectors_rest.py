"""The detector table over REST, beside pycocotools on the same files."""

import contextlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from starlette.testclient import TestClient

from app.db import Database
from app.tables.sites import Site
from tests.factories.sites import make_site

URL = "/api/v1/evaluation/detectors"
TRUTH = "real/bonk/ground_truth_2d_coco.json"
MOVING = {0, 1, 4, 5}  # what the test maps to ship, ship_leaving_frame and subvessel
IMAGES = 60


@pytest.fixture
def site(database: Database) -> Site:
    """Return an empty site."""
    with database.writing() as session:
        return make_site(session, "Elbe")


@pytest.fixture(scope="module")
def truth(shared_dir: Path) -> dict[str, Any]:
    """Return the first images of the real file, the one with annotation 0 among them."""
    document: dict[str, Any] = json.loads((shared_dir / TRUTH).read_text())
    document["images"] = document["images"][:IMAGES]
    kept = {image["id"] for image in document["images"]}
    document["annotations"] = [a for a in document["annotations"] if a["image_id"] in kept]
    return document


def invented(truth: dict[str, Any]) -> list[dict[str, Any]]:
    """Return detections near the boxes and beside them, with scores that are often the same."""
    random = np.random.default_rng(7)
    found: list[dict[str, Any]] = []
    for box in truth["annotations"]:
        for _ in range(int(random.integers(0, 3))):
            x, y, width, height = box["bbox"]
            shift = random.normal(0, 0.1, 4)
            place = [x + shift[0] * width, y + shift[1] * height]
            size = [width * float(np.exp(shift[2])), height * float(np.exp(shift[3]))]
            found.append(_result(box["image_id"], [*place, *size], float(random.random())))
    for image in truth["images"][:-1]:  # the last one has none: it is missed, not left out
        for _ in range(int(random.integers(0, 9))):
            place, size = list(random.uniform(0, 1800, 2)), list(random.uniform(5, 200, 2))
            found.append(_result(image["id"], [*place, *size], float(random.random())))
    last = truth["images"][-1]["id"]
    return [one for one in found if one["image_id"] != last]


def _result(image_id: int, bbox: list[float], score: float) -> dict[str, Any]:
    return {
        "image_id": image_id,
        "category_id": 8,
        "bbox": [float(v) for v in bbox],
        "score": round(score, 2),
    }


def by_pycocotools(
    truth: dict[str, Any], found: list[dict[str, Any]], categories: set[int], first_id: int = 0
) -> Any:
    """Return pycocotools' twelve figures for boxes of some categories, all of one class."""
    reference = COCO()
    reference.dataset = truth | {
        "categories": [{"id": 8, "name": "boat"}],
        "annotations": [
            box | {"category_id": 8, "id": box["id"] + first_id}
            for box in truth["annotations"]
            if box["category_id"] in categories
        ],
    }
    with contextlib.redirect_stdout(io.StringIO()):
        reference.createIndex()
        judged = COCOeval(reference, reference.loadRes(found), "bbox")
        judged.evaluate()
        judged.accumulate()
        judged.summarize()
    return judged.stats


def test_figures_are_those_of_pycocotools(
    client: TestClient, site: Site, truth: dict[str, Any]
) -> None:
    """Real boxes of absent photographs, invented detections with ties: equal to 1e-9, all sizes."""
    found = invented(truth)
    _import(client, site, truth, found)
    answer = client.get(URL)
    table = answer.json()
    assert table["images_complete"] == IMAGES
    assert table["boxes_by_class"]["ship_moored"] > 0
    (detector,) = table["detectors"]
    assert (detector["images"], detector["images_without_detections"]) == (IMAGES, 1)
    by_name = {one["class_set"]: one for one in detector["class_sets"]}
    for name, categories in (("moving", MOVING), ("all", set(range(6)))):
        expected = by_pycocotools(truth, found, categories)
        ours = by_name[name]
        sizes = [ours["by_size"][size] for size in ("small", "medium", "large")]
        figures = [ours["map_50_95"], ours["map_50"], ours["map_75"]]
        figures += [one["map_50_95"] for one in sizes] + [ours["ar_100"]]
        figures += [one["ar_100"] for one in sizes]
        wanted = [*expected[:6], *expected[8:]]
        assert [-1.0 if v is None else v for v in figures] == pytest.approx(wanted, abs=1e-9)
        low, high = ours["intervals"]["map_50_95"]
        assert low < ours["map_50_95"] < high
    renumbered = by_pycocotools(truth, found, MOVING, first_id=1)
    assert by_name["moving"]["renumbered"]["map_50_95"] == pytest.approx(renumbered[0], abs=1e-9)
    assert by_name["moving"]["map_50_95"] < by_name["moving_others_ignored"]["map_50_95"]
    known = client.get(URL, headers={"If-None-Match": answer.headers["ETag"]})
    assert known.status_code == 304
    lines = client.get(URL, params={"format": "csv"}).text.splitlines()
    assert len(lines) == 1 + 3 * 4 + 2 * 8


def test_an_edit_is_seen_at_once(client: TestClient, site: Site, truth: dict[str, Any]) -> None:
    """Figures are kept by content: a deleted box and a reopened image change them."""
    _import(client, site, truth, invented(truth))
    before = client.get(URL).json()["detectors"][0]["class_sets"][2]["boxes"]
    box = client.get("/api/v1/ground-truth/boxes", params={"limit": 1}).json()["items"][0]
    client.delete(
        f"/api/v1/ground-truth/boxes/{box['id']}", headers={"If-Match": f'"{box["version"]}"'}
    )
    after = client.get(URL).json()["detectors"][0]["class_sets"][2]["boxes"]
    assert after == before - 1
    url = f"/api/v1/ground-truth/images/{box['ground_truth_image_id']}"
    version = client.get(url).headers["ETag"]
    client.patch(url, json={"is_complete": False}, headers={"If-Match": version})
    assert client.get(URL).json()["images_complete"] == IMAGES - 1


def _import(
    client: TestClient, site: Site, truth: dict[str, Any], found: list[dict[str, Any]]
) -> None:
    boxes = client.post(
        "/api/v1/ground-truth/files",
        files={"file": ("truth.json", json.dumps(truth).encode())},
        data={"site_id": site.id, "map": '{"boat": "ship"}'},
    )
    assert boxes.status_code == 201, boxes.text
    detections = client.post(
        "/api/v1/detections",
        files={"file": ("found.json", json.dumps(found).encode())},
        data={"name": "invented"},
    )
    assert detections.status_code == 201, detections.text
