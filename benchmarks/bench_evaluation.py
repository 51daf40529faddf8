"""The detector table of 4,000 images with 15,000 boxes: the first answer, a kept one, pycocotools.

An installation on SQLite gets ground truth and two imported detectors with 40,000 detections each,
through the same REST that people use. Timed is CPU of the serving process by its own account: the
first answer for one detector (figures of three class sets and four sizes, with intervals), the same
again (kept by content), after one box was drawn, and pycocotools for one class set on the same
files. `python benchmarks/bench_evaluation.py 400` does a tenth of it.
"""

import contextlib
import io
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from starlette.testclient import TestClient

from app import schema
from app.config import Settings
from app.db import Database
from app.main import create_app
from app.tables.identity import Role
from benchmarks.workbench import show_load
from tests.factories import identity
from tests.factories.sites import make_site

IMAGES, BOXES_AN_IMAGE, FALSE_AN_IMAGE = 4000, 3.75, 6
ROUNDS = 3
URL = "/api/v1/evaluation/detectors"
CLASSES = ("ship", "ship_leaving_frame", "ship_moored", "ship_partial", "subvessel")


def invented(images: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return a COCO file and detections: three of four boxes found, six beside them an image."""
    random = np.random.default_rng(9)
    truth: dict[str, Any] = {
        "images": [
            {"id": n + 1, "file_name": f"{n:06d}.jpg", "width": 2560, "height": 1920}
            for n in range(images)
        ],
        "categories": [{"id": n, "name": name} for n, name in enumerate(CLASSES)],
        "annotations": [],
    }
    found: list[dict[str, Any]] = []
    for image in truth["images"]:
        for _ in range(random.poisson(BOXES_AN_IMAGE)):
            size = np.exp(random.normal(4.2, 1.0, 2)).clip(6, 900)
            place = random.uniform(0, (1600, 1000))
            bbox = [*map(float, place), *map(float, size)]
            annotation = {
                "id": len(truth["annotations"]) + 1,
                "image_id": image["id"],
                "category_id": int(random.integers(0, 5)),
                "bbox": bbox,
                "area": bbox[2] * bbox[3],
                "iscrowd": 0,
            }
            truth["annotations"].append(annotation)
            if random.random() < 0.75:
                off = random.normal(0, 0.06, 4) * np.tile(size, 2)
                found.append(_result(image["id"], np.array(bbox) + off, random.beta(5, 2)))
        for _ in range(random.poisson(FALSE_AN_IMAGE)):
            bbox_false = np.r_[random.uniform(0, (2300, 1700)), random.uniform(8, 200, 2)]
            found.append(_result(image["id"], bbox_false, random.beta(2, 5)))
    return truth, found


def _result(image_id: int, bbox: Any, score: float) -> dict[str, Any]:  # noqa: ANN401  an array
    place = [float(value) for value in (*bbox[:2], *np.maximum(bbox[2:], 2))]
    return {"image_id": image_id, "category_id": 9, "bbox": place, "score": round(score, 3)}


def by_pycocotools(truth: dict[str, Any], found: list[dict[str, Any]]) -> float:
    """Return mAP@.5:.95 of all five classes as one."""
    reference = COCO()
    boxes = [box | {"category_id": 9} for box in truth["annotations"]]
    reference.dataset = truth | {"categories": [{"id": 9, "name": "boat"}], "annotations": boxes}
    with contextlib.redirect_stdout(io.StringIO()):
        reference.createIndex()
        judged = COCOeval(reference, reference.loadRes(found), "bbox")
        judged.evaluate()
        judged.accumulate()
        judged.summarize()
    return float(judged.stats[0])


def timed(act: Callable[[], Any]) -> tuple[float, Any]:
    """Return CPU seconds of this process, and what came of it."""
    began = time.process_time()
    answer = act()
    return time.process_time() - began, answer


def upload(client: TestClient, url: str, content: Any, **form: Any) -> None:  # noqa: ANN401  JSON
    """Send a JSON file with a form."""
    files = {"file": ("a.json", json.dumps(content).encode())}
    client.post(url, files=files, data=form).raise_for_status()


def main() -> None:
    """Measure and print."""
    images = int(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    truth, found = invented(images)
    print(f"{images} images, {len(truth['annotations'])} boxes, {len(found)} detections")
    show_load()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settings = Settings(
            data_dir=folder,
            database_url=f"sqlite:///{folder / 'quaymark.db'}",
            storage_url=str(folder / "files"),
            max_upload_bytes=2**30,
        )
        database = Database(settings.database_url)
        schema.upgrade(database)
        with database.writing() as session:
            site_id = make_site(session, "Elbe").id
            token = identity.make_token(session, identity.make_user(session, Role.ADMIN))
        headers = {"Authorization": f"Bearer {token}"}
        with TestClient(create_app(settings), headers=headers) as client:
            took, _ = timed(
                lambda: upload(client, "/api/v1/ground-truth/files", truth, site_id=site_id)
            )
            print(f"ground truth in: {took:.2f} s")
            took, _ = timed(lambda: upload(client, "/api/v1/detections", found, name="one"))
            print(f"detections in: {took:.2f} s")
            first, kept, reference = [], [], []
            for _ in range(ROUNDS):
                _draw(client)
                took, answer = timed(lambda: client.get(URL))
                first.append(took)
                took, _ = timed(lambda: client.get(URL))
                kept.append(took)
                ours = answer.json()["detectors"][0]["class_sets"][2]["map_50_95"]
            for _ in range(ROUNDS):
                took, theirs = timed(lambda: by_pycocotools(truth, found))
                reference.append(took)
            print(f"first answer {statistics.median(first):.2f} s")
            print(f"kept answer {statistics.median(kept):.2f} s")
            print(f"pycocotools, one of the three class sets: {statistics.median(reference):.2f} s")
            print(f"mAP@.5:.95 of all five: {ours:.6f} with a few boxes more, theirs {theirs:.6f}")


def _draw(client: TestClient) -> None:
    """Draw one more box, so that nothing is kept."""
    image = client.get("/api/v1/ground-truth/images", params={"limit": 1}).json()["items"][0]
    body = {
        "ground_truth_image_id": image["id"],
        "vessel_class": "ship_moored",
        "x1_px": 1,
        "y1_px": 1,
        "x2_px": 9,
        "y2_px": 9,
    }
    client.post("/api/v1/ground-truth/boxes", json=body).raise_for_status()


if __name__ == "__main__":
    main()
