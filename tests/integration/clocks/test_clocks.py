"""Clocks of cameras: corrected over a range, undone, told from vessels; stale runs say so."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta

import numpy as np
from sqlalchemy.orm import Session
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.domain.ais import FixTimeSource, PositionReport, StaticReport
from app.domain.local_metres import moved
from app.domain.vessel_path import vessel_path
from app.imagery import service as imagery
from app.imagery.service import Upload
from app.storage import Storage
from app.tables.ais import AisPosition, AisStatic
from app.tables.clock import ClockEstimate, EstimateStatus
from app.tables.detection import Detection, DetectionSet
from app.tables.identity import User
from app.tables.imagery import CaptureTimeSource
from app.tables.runs import RunImage
from app.tables.sites import Site
from tests.factories.afloat import look_north
from tests.factories.imagery import NOON, make_image, photograph
from tests.factories.runs import Harbour, make_harbour, make_run
from worker.tasks.estimate_clock import estimated

EXIF = CaptureTimeSource.EXIF


def stored(client: TestClient, camera_id: int) -> list[str]:
    """Return the times of a camera's images, in the order they came in."""
    items = client.get("/api/v1/images", params={"camera_id": camera_id}).json()["items"]
    return [item["captured_at"][11:19] for item in items]


def test_an_offset_moves_the_times_it_covers_and_is_undone(
    client: TestClient, database: Database, settings: Settings
) -> None:
    """Images of the range get true times, viewports and stale runs; undoing takes all back."""
    with database.writing() as session:
        harbour = make_harbour(session)
        late = NOON + timedelta(hours=1)
        make_image(
            session,
            harbour.camera,
            harbour.viewport,
            NOON,
            captured_at_source=EXIF,
            sha256="a" * 64,
        )
        make_image(session, harbour.camera, harbour.viewport, late, captured_at_source=EXIF)
        run = make_run(session, harbour, [1])
        for image in harbour.images:
            session.get_one(RunImage, (run.id, image.id)).captured_at = image.captured_at
    camera = f"/api/v1/cameras/{harbour.camera.id}"
    body = {"offset_s": 90, "valid_until": "2026-11-22T12:30:00Z", "note": "seen beside a clock"}

    made = client.post(f"{camera}/clock-offsets", json=body)

    assert made.status_code == 201
    # The first image's time was given by a person.
    assert stored(client, harbour.camera.id) == ["12:00:00", "12:01:30", "13:00:00"]
    wrong = client.post(f"{camera}/clock-offsets", json={"offset_s": 1e12})
    assert wrong.json()["errors"][0]["field"] == "offset_s"
    over = client.post(f"{camera}/clock-offsets", json={"offset_s": -5})
    assert stored(client, harbour.camera.id) == ["12:00:00", "11:59:55", "12:59:55"]
    undo = f"/api/v1/clock-offsets/{over.json()['id']}/undo"
    assert client.post(undo).status_code == 200
    assert client.post(undo).status_code == 409
    assert stored(client, harbour.camera.id) == ["12:00:00", "12:01:30", "13:00:00"]
    upload = Upload(photograph(5, taken="2026:11:22 12:10:00", offset="+00:00"), "new.jpg")
    image, _ = imagery.store_image(
        database, Storage(settings.storage_url), settings, harbour.camera.id, upload
    )
    assert f"{image.captured_at:%H:%M:%S} {image.captured_at_raw:%H:%M:%S}" == "12:11:30 12:10:00"


def test_runs_on_other_times_are_stale(client: TestClient, database: Database) -> None:
    """A run says that times were changed since; with the old times back it is fresh again."""
    with database.writing() as session:
        harbour = make_harbour(session, images=0)
        image = make_image(session, harbour.camera, harbour.viewport, NOON, captured_at_source=EXIF)
        run = make_run(session, replace(harbour, images=[image]), [1])
        session.get_one(RunImage, (run.id, image.id)).captured_at = image.captured_at
    shown = f"/api/v1/runs/{run.id}"
    assert client.get(shown).json()["is_stale"] is False
    offsets = f"/api/v1/cameras/{harbour.camera.id}/clock-offsets"
    made = client.post(offsets, json={"offset_s": 90}).json()["id"]
    assert client.get(shown).json()["is_stale"] is True
    client.post(f"/api/v1/clock-offsets/{made}/undo")
    assert client.get(shown).json()["is_stale"] is False


def pass_by(harbour: Harbour, site: Site, number: int) -> tuple[list[AisPosition], AisStatic]:
    """Return the reports of a ship that passes the camera at its own speed and distance."""
    mmsi = 211_300_000 + number
    course_deg = 90.0 if number % 2 else 270.0
    speed_mps = 3.0 + 0.4 * number
    reports = []
    for second in range(-500, 1500, 10):
        east_m = speed_mps * (second - 110 * number) * (1 if number % 2 else -1)
        lat, lon = moved(site.origin_lat_deg, site.origin_lon_deg, east_m, 260.0 + 45 * number)
        moment = NOON + timedelta(seconds=second)
        reports.append(
            AisPosition(
                site_id=harbour.site.id,
                mmsi=mmsi,
                fix_time=moment,
                received_at=moment,
                lat_deg=lat,
                lon_deg=lon,
                sog_kn=speed_mps * 3600 / 1852,
                cog_deg=course_deg,
                heading_deg=course_deg,
            )
        )
    static = AisStatic(
        site_id=harbour.site.id,
        mmsi=mmsi,
        received_at=NOON - timedelta(minutes=8),
        to_bow_m=20.0 + 2 * number,
        to_stern_m=20.0,
        to_port_m=4.0,
        to_starboard_m=4.0,
    )
    return reports, static


def photograph_passages(session: Session, harbour: Harbour, slow_s: float) -> int:
    """Insert ships, and images with boxes where they were; the camera's clock is slow."""
    camera, frame = look_north(session, harbour)
    site = session.get_one(Site, harbour.site.id)
    paths = []
    for number in range(10):
        rows, static = pass_by(harbour, site, number)
        reports = [
            PositionReport(
                mmsi=row.mmsi,
                fix_time=row.fix_time,
                received_at=row.received_at,
                lat_deg=row.lat_deg,
                lon_deg=row.lon_deg,
                sog_kn=row.sog_kn,
                cog_deg=row.cog_deg,
                heading_deg=row.heading_deg,
                rot_deg_min=None,
                message_type=1,
                ais_class="A",
                high_accuracy=None,
                fix_time_source=FixTimeSource.PROMPT,
            )
            for row in rows
        ]
        said = StaticReport(
            name=None,
            callsign=None,
            imo=None,
            ship_type=None,
            mmsi=static.mmsi,
            received_at=static.received_at,
            to_bow_m=static.to_bow_m,
            to_stern_m=20.0,
            to_port_m=4.0,
            to_starboard_m=4.0,
        )
        path = vessel_path(reports, [said], frame, site.water_level_m, NOON)
        assert path is not None
        paths.append(path)
        session.add_all([*rows, static])
    rng = np.random.default_rng(1)
    images = []
    for true_s in np.sort(rng.uniform(0, 1000, 20)):
        clock = NOON + timedelta(seconds=float(true_s) - slow_s)
        image = make_image(
            session, harbour.camera, harbour.viewport, clock, captured_at_source=EXIF
        )
        found = DetectionSet(
            image_sha256=image.sha256, model_sha256=harbour.model.sha256, settings_sha256="5" * 64
        )
        session.add(found)
        session.flush()
        images.append((image, found))
        for path in paths:
            x1, y1, x2, y2 = path.rectangles_px(camera, site.water_level_m, np.array([true_s]))[0]
            if x1 > 5 and x2 < camera.intrinsics.width_px - 5:
                session.add(
                    Detection(
                        detection_set_id=found.id,
                        x1_px=float(x1),
                        y1_px=float(y1 - 40),
                        x2_px=float(x2),
                        y2_px=float(y2),
                        score=0.9,
                        class_id=8,
                    )
                )
    run = make_run(session, replace(harbour, images=[image for image, _ in images]))
    for image, found in images:
        row = session.get_one(RunImage, (run.id, image.id))
        row.detection_set_id, row.captured_at = found.id, image.captured_at
    return run.id


def test_vessels_tell_a_slow_clock_and_a_person_applies_it(
    client: TestClient, browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """From a run 90 s late the offset is found; once applied, nothing more is proposed."""
    with database.writing() as session:
        harbour = make_harbour(session, images=0)
        run_id = photograph_passages(session, harbour, 90.0)
        row = ClockEstimate(camera_id=harbour.camera.id, run_id=run_id, workflow_id="clock-1")
        session.add(row)
        session.flush()
        row.result, row.status = estimated(session, row.id), EstimateStatus.SUCCEEDED
        found = row.result
    assert found["is_off"]
    assert found["low_s"] - 0.5 < 90.0 < found["high_s"] + 0.5
    assert abs(found["offset_s"] - 90.0) < 1.0

    browser = browser_of(admin)
    page = f"/cameras/{harbour.camera.id}/clock"
    assert "s slow" in browser.get(page).text
    offsets = f"/cameras/{harbour.camera.id}/clock-offsets"
    assert browser.post(offsets, data={"estimate_id": str(row.id)}).status_code == 303

    shown = client.get(f"/api/v1{offsets}").json()["items"][0]
    assert (shown["source"], shown["offset_s"]) == ("estimated", found["offset_s"])
    assert client.get(f"/api/v1/runs/{run_id}").json()["is_stale"] is True
    with database.reading() as session:
        again = estimated(session, row.id)
    assert not again["is_off"]
    assert abs(again["offset_s"] - 90.0) < 1.0
    assert browser.post(offsets, data={"offset_s": "soon"}).status_code == 422


def test_estimates_are_asked_for_by_those_who_register(
    client: TestClient, browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """A run of another camera is refused by name; one of the camera is queued."""
    with database.writing() as session:
        harbour, other = make_harbour(session), make_harbour(session)
        run, foreign = make_run(session, harbour, [1]), make_run(session, other, [1])
    address = f"/api/v1/cameras/{harbour.camera.id}/clock-estimates"
    refused = client.post(address, json={"run_id": foreign.id})
    assert refused.json()["errors"][0]["field"] == "run_id"
    assert client.post(address, json={"run_id": run.id}).status_code == 202
    form = f"/cameras/{harbour.camera.id}/clock-estimates"
    assert browser_of(admin).post(form, data={"run_id": str(run.id)}).status_code == 303
    assert [item["status"] for item in client.get(address).json()["items"]] == ["queued"] * 2
