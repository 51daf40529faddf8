"""Clocks of cameras: corrected over a range, undone, told from vessels; stale runs say so."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta

from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.imagery import service as imagery
from app.imagery.service import Upload
from app.storage import Storage
from app.tables.clock import ClockEstimate, EstimateStatus
from app.tables.identity import User
from app.tables.imagery import CaptureTimeSource
from app.tables.runs import RunImage
from tests.factories.imagery import NOON, make_image, photograph
from tests.factories.passages import photograph_passages
from tests.factories.runs import make_harbour, make_run
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
        (part,) = estimated(session, row.id)
        found = part.result
        row.result, row.status = found, EstimateStatus.SUCCEEDED
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
        again = estimated(session, row.id)[0].result
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
