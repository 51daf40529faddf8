"""What fusing again costs an image, beside the bare domain's fusing of the same from memory.

4,000 photographs 20 seconds apart with about four ships each (`IMAGES` in the environment for
fewer), whose boxes were imported: no file of them is there, so that a run which looked for pixels
would fail on every image. A first run makes the poses, a person judges a quarter of them, and then
runs with other parameters are started in turn with the bare domain, and taken by a real worker: on
SQLite and on a Postgres of its own. A run's time is from its beginning to its end as the database
tells them, its CPU time that of the worker; the bare domain gets 25 images a call.
"""

import hashlib
import os
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from itertools import islice
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import Base, Database
from app.detectors.service import IMPORTED_FAMILY, IMPORTED_SETTINGS_SHA256
from app.domain.camera import Camera
from app.domain.fusion import FusionSettings, MatchingMethod, Preset, SeenImage, fuse_series
from app.domain.rotations import rotvec_from_matrix
from app.garbage import set_startup_aside
from app.tables.ais import AisPosition, AisStatic
from app.tables.detection import Detection, DetectionSet, Model, ModelStatus
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.registration import Registration, RegistrationMethod
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose, RunImage
from app.tables.sites import Camera as CameraRow
from benchmarks.fairway import HEIGHT_M, ORIGIN, WATER_M, Fairway
from benchmarks.workbench import Workbench, show_load, workbench
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.postgres import PostgresCluster

IMAGES = int(os.environ.get("IMAGES", "4000"))
APART_S = 20.0
ROUNDS = 3
AIM_MS = 4.0
BEGIN = datetime(2026, 3, 1, 6, tzinfo=UTC)
_REPORTED_EVERY_S = 10.0
_SAID_EVERY_S = 360.0  # name and size
_MARGIN_S = 300.0  # of reports before and after the images
_AT_ONCE = 2000
_DETECTOR = "imported boxes"
_DETECTOR_SHA256 = hashlib.sha256(_DETECTOR.encode()).hexdigest()


def main() -> None:
    """Print milliseconds an image on both databases."""
    fairway = Fairway.of(11)
    moments = [_MARGIN_S + APART_S * number for number in range(IMAGES)]
    seen = [fairway.image(at_s) for at_s in moments]
    boxes = sum(len(image.detections) for image in seen) / IMAGES
    print(f"{IMAGES} images {APART_S:.0f} s apart, {boxes:.1f} boxes an image")
    _measure("SQLite", fairway, seen, None)
    with PostgresCluster() as cluster:
        _measure("Postgres", fairway, seen, cluster.create("refuse"))
    show_load()


def _measure(
    label: str, fairway: Fairway, seen: Sequence[SeenImage], database_url: str | None
) -> None:
    with workbench(worker=True, database_url=database_url) as bench:
        viewport_id = _fill(bench.database, fairway, seen)
        first = bench.finish(_start(bench, viewport_id, 1.0))
        judged = _judge(bench.database, first.id)
        print(f"{label}: first run {_wall_ms(bench, first.id):.2f} ms an image, {judged} reviews")
        walls, cpus, bare = [], [], []
        for number in range(ROUNDS):
            bare.append(_bare_ms(fairway, seen))
            begun = bench.worker_cpu_s()
            again = _start(bench, viewport_id, 1.1 + number / 10)
            bench.finish(again)
            cpus.append((bench.worker_cpu_s() - begun) * 1000 / IMAGES)
            walls.append(_wall_ms(bench, again))
            _check(bench.database, again)
        for name, values in (("wall", walls), ("CPU of the worker", cpus), ("bare domain", bare)):
            shown = ", ".join(f"{value:.2f}" for value in values)
            print(f"{label}: {name:<18}{statistics.median(values):6.2f} ms an image ({shown})")
        shares = [cpu / domain for cpu, domain in zip(cpus, bare, strict=True)]
        print(f"{label}: {statistics.median(shares):.2f} times the bare domain")
        met = "met" if statistics.median(walls) <= AIM_MS else "MISSED"
        print(f"{label}: aim: at most {AIM_MS:.0f} ms of wall an image: {met}")


def _start(bench: Workbench, viewport_id: int, level_sigma_m: float) -> int:
    return bench.start_run(
        viewport_id, detector=_DETECTOR, preset="waterline", level_sigma_m=level_sigma_m
    )


def _bare_ms(fairway: Fairway, seen: Sequence[SeenImage]) -> float:
    settings = FusionSettings(preset=Preset.WATERLINE, matching=MatchingMethod.LIKELIHOOD)
    set_startup_aside()
    begun = time.process_time()
    for start in range(0, len(seen), 25):
        fuse_series(fairway.camera, fairway.frame, seen[start : start + 25], settings)
    return (time.process_time() - begun) * 1000 / len(seen)


def _wall_ms(bench: Workbench, run_id: int) -> float:
    run = bench.run(run_id)
    assert run.started_at is not None
    assert run.finished_at is not None
    return (run.finished_at - run.started_at).total_seconds() * 1000 / run.image_count


def _check(database: Database, run_id: int) -> None:
    """Tell that nothing was looked for again, how many poses there are, and what they inherited."""
    with database.reading() as session:
        of_run = sa.select(sa.func.count()).where(RunImage.run_id == run_id)
        done = session.scalar(of_run.where(RunImage.done_at.is_not(None)))
        failed = session.scalar(of_run.where(RunImage.error.is_not(None)))
        sets = session.scalar(sa.select(sa.func.count()).select_from(DetectionSet))
        poses = session.scalar(sa.select(sa.func.count()).where(Pose.run_id == run_id))
        inherited = session.scalar(
            sa.select(sa.func.count())
            .select_from(Review)
            .join(Pose, Pose.id == Review.pose_id)
            .where(Pose.run_id == run_id)
        )
    assert (done, failed, sets) == (IMAGES, 0, IMAGES), (done, failed, sets)
    print(f"    {poses} poses, {inherited} reviews inherited, nothing detected")


def _judge(database: Database, run_id: int) -> int:
    """Let a person judge every fourth pose of a run."""
    with database.writing() as session:
        user_id = session.scalar(sa.text("SELECT min(id) FROM users"))
        every_fourth = sa.select(Pose.id).where(Pose.run_id == run_id, Pose.id % 4 == 0)
        rows = [
            {
                "pose_id": pose_id,
                "user_id": user_id,
                "grade": Grade.GOOD,
                "reasons": [],
                "guideline_version": 1,
            }
            for pose_id in session.scalars(every_fourth)
        ]
        _add(session, Review, rows)
        return len(rows)


def _fill(database: Database, fairway: Fairway, seen: Sequence[SeenImage]) -> int:
    """Store a viewport with its photographs' names and boxes, and the AIS; returns its id."""
    with database.writing() as session:
        site = make_site(session)
        lens, size = _lens(fairway.camera)
        camera = make_camera(session, site, **lens, **size)
        viewport = make_viewport(session, camera)
        session.add(
            Registration(
                viewport_id=viewport.id,
                method=RegistrationMethod.GIVEN,
                rotation=rotvec_from_matrix(fairway.camera.R_cam_from_world).tolist(),
                center_lat_deg=ORIGIN.lat_deg,
                center_lon_deg=ORIGIN.lon_deg,
                center_height_m=WATER_M + HEIGHT_M,
                intrinsics={**lens, **size, "distortion": [0.0] * 5},
            )
        )
        session.add(
            Model(
                name=_DETECTOR,
                family=IMPORTED_FAMILY,
                sha256=_DETECTOR_SHA256,
                size_bytes=0,
                status=ModelStatus.READY,
            )
        )
        _add(session, Image, _photographs(camera, viewport.id, seen))
        _add_boxes(session, seen)
        _add(session, AisPosition, _positions(fairway, site.id, seen[-1].at_s + _MARGIN_S))
        _add(session, AisStatic, _statics(fairway, site.id, seen[-1].at_s + _MARGIN_S))
        return viewport.id


def _lens(camera: Camera) -> tuple[dict[str, float], dict[str, int]]:
    inner = camera.intrinsics
    K = inner.K.tolist()
    lens = {"fx_px": K[0][0], "fy_px": K[1][1], "cx_px": K[0][2], "cy_px": K[1][2]}
    return lens, {"width_px": inner.width_px, "height_px": inner.height_px}


def _photographs(
    camera: CameraRow, viewport_id: int, seen: Sequence[SeenImage]
) -> Iterator[dict[str, Any]]:
    for number, image in enumerate(seen):
        yield {
            "site_id": camera.site_id,
            "camera_id": camera.id,
            "viewport_id": viewport_id,
            "sha256": _sha256(number),
            "media_type": "image/jpeg",
            "file_name": f"{number:05}.jpg",
            "size_bytes": 1,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "captured_at": BEGIN + timedelta(seconds=image.at_s),
            "captured_at_raw": BEGIN + timedelta(seconds=image.at_s),
            "captured_at_source": CaptureTimeSource.GIVEN,
        }


def _sha256(number: int) -> str:
    return hashlib.sha256(f"photograph {number}".encode()).hexdigest()


def _add_boxes(session: Session, seen: Sequence[SeenImage]) -> None:
    key = {"model_sha256": _DETECTOR_SHA256, "settings_sha256": IMPORTED_SETTINGS_SHA256}
    _add(
        session,
        DetectionSet,
        ({"id": 1 + number, "image_sha256": _sha256(number), **key} for number in range(len(seen))),
    )
    _add(
        session,
        Detection,
        (
            {
                "detection_set_id": 1 + number,
                **dict(zip(("x1_px", "y1_px", "x2_px", "y2_px"), box.edges_px, strict=True)),
                "score": box.score,
                "class_id": box.class_id,
            }
            for number, image in enumerate(seen)
            for box in image.detections
        ),
    )


def _positions(fairway: Fairway, site_id: int, until_s: float) -> Iterator[dict[str, Any]]:
    for at_s in _moments(_REPORTED_EVERY_S, until_s):
        at = BEGIN + timedelta(seconds=at_s)
        for lane in fairway.lanes:
            state = lane.state(at_s)
            yield {
                "site_id": site_id,
                "mmsi": int(state.identifier),
                "fix_time": at,
                "received_at": at,
                "lat_deg": state.lat_deg,
                "lon_deg": state.lon_deg,
                "sog_kn": state.speed_kn,
                "cog_deg": state.heading_deg,
                "heading_deg": state.heading_deg,
                "message_type": 1,
                "ais_class": "A",
                "high_accuracy": True,
            }


def _statics(fairway: Fairway, site_id: int, until_s: float) -> Iterator[dict[str, Any]]:
    for at_s in _moments(_SAID_EVERY_S, until_s):
        for lane in fairway.lanes:
            # Ships come into range every few minutes: what the next one says is heard by then.
            for state in (lane.state(at_s), lane.state(at_s + _SAID_EVERY_S)):
                yield {
                    "site_id": site_id,
                    "mmsi": int(state.identifier),
                    "received_at": BEGIN + timedelta(seconds=at_s),
                    "name": state.identifier,
                    "to_bow_m": state.to_bow_m,
                    "to_stern_m": state.to_stern_m,
                    "to_port_m": state.to_port_m,
                    "to_starboard_m": state.to_starboard_m,
                }


def _moments(every_s: float, until_s: float) -> Iterator[float]:
    for number in range(int(until_s / every_s) + 1):
        yield number * every_s


def _add(session: Session, table: type[Base], rows: Iterable[dict[str, Any]]) -> None:
    left = iter(rows)
    while some := list(islice(left, _AT_ONCE)):
        session.execute(sa.insert(table), some)


if __name__ == "__main__":
    main()
