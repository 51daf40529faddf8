"""Photographs decoded smaller where ground truth proves it harmless, and nowhere else."""

from dataclasses import replace
from typing import Any

import pytest
from sqlalchemy.orm import Session
from starlette.testclient import TestClient

from app.db import Database
from app.domain.detection import DetectionSettings
from app.tables.detection import Detection, DetectionSet
from app.tables.groundtruth import GroundTruthBox, GroundTruthImage, VesselClass
from tests.factories.runs import Harbour, make_harbour

RUNS = "/api/v1/runs"
IMAGES, BOXES = 4, 30
SETTINGS = DetectionSettings()


def see(session: Session, harbour: Harbour, settings: DetectionSettings, off_px: float) -> None:
    """Store a detection for each true box, so far beside it."""
    for image in harbour.images:
        rows = [
            Detection(
                x1_px=40.0 * n + off_px,
                y1_px=10,
                x2_px=40.0 * n + 30 + off_px,
                y2_px=60,
                score=0.9 - n / 100,
                class_id=8,
            )
            for n in range(BOXES)
        ]
        session.add(
            DetectionSet(
                image_sha256=image.sha256,
                model_sha256=harbour.model.sha256,
                settings_sha256=settings.sha256,
                detections=rows,
            )
        )


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a harbour whose boats are known, and whose detector saw them in whole photographs."""
    with database.writing() as session:
        harbour = make_harbour(session, images=IMAGES)
        for image in harbour.images:
            truth = GroundTruthImage(
                site_id=harbour.site.id,
                image_id=image.id,
                file_name=image.file_name,
                base_name=image.file_name,
                width_px=2560,
                height_px=1920,
                content_sha256=image.sha256,
                is_complete=True,
            )
            session.add_all(
                GroundTruthBox(
                    image=truth,
                    x1_px=40.0 * n,
                    y1_px=10,
                    x2_px=40.0 * n + 30,
                    y2_px=60,
                    area_px2=1500,
                    vessel_class=VesselClass.SHIP,
                )
                for n in range(BOXES)
            )
        see(session, harbour, SETTINGS, off_px=1)
        return harbour


def start(client: TestClient, harbour: Harbour, **parameters: Any) -> dict[str, Any]:
    """Start a run; returns its parameters."""
    body = {
        "viewport_id": harbour.viewport.id,
        "detector": harbour.model.name,
        "parameters": parameters,
    }
    answer = client.post(RUNS, json=body)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()["parameters"]
    return found


def test_new_runs_decode_smaller_where_ap_stays(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """In full without a proof, then at the largest divisor that leaves AP; or as a person asks."""
    assert start(client, harbour)["decoding_divisor"] == 1
    with database.writing() as session:
        see(session, harbour, replace(SETTINGS, decoding_divisor=2), off_px=1)
        see(session, harbour, replace(SETTINGS, decoding_divisor=4), off_px=9)
    assert start(client, harbour)["decoding_divisor"] == 2
    assert start(client, harbour, score_threshold=0.3)["decoding_divisor"] == 1
    assert start(client, harbour, decoding_divisor=4)["decoding_divisor"] == 4
    assert start(client, harbour, decoding_divisor=1)["decoding_divisor"] == 1

    table = client.get("/api/v1/evaluation/detectors").json()["detectors"]
    of = {one["decoding_divisor"]: one for one in table}
    assert of[1]["decoding_change"] is None
    harmless, harmful = of[2]["decoding_change"], of[4]["decoding_change"]
    assert (harmless["is_harmless"], harmless["images"], harmless["boxes"]) == (True, 4, 120)
    assert harmless["map_50_95"]["moving"] == 0
    assert not harmful["is_harmless"]
    assert harmful["map_50_95"]["moving"] == pytest.approx(
        of[4]["class_sets"][0]["map_50_95"] - of[1]["class_sets"][0]["map_50_95"]
    )
    assert of[1]["by_class"]["ship"]["boxes"] == 120
    assert of[1]["by_class"]["subvessel"]["map_50_95"] is None
    page = client.get("/evaluation/detectors").text
    assert "Harmless: new runs of the site decode smaller." in page
    assert "New runs decode in full unless they are told otherwise." in page
