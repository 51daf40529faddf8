"""Ships that pass a camera, and images with boxes where they were: they tell what time it was."""

from dataclasses import replace
from datetime import timedelta

import numpy as np
from sqlalchemy.orm import Session

from app.domain.ais import FixTimeSource, PositionReport, StaticReport
from app.domain.local_metres import moved
from app.domain.vessel_path import vessel_path
from app.tables.ais import AisPosition, AisStatic
from app.tables.detection import Detection, DetectionSet
from app.tables.imagery import CaptureTimeSource
from app.tables.runs import RunImage
from app.tables.sites import Site
from tests.factories.afloat import look_north
from tests.factories.imagery import NOON, make_image
from tests.factories.runs import Harbour, make_run

EXIF = CaptureTimeSource.EXIF


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


def photograph_passages(
    session: Session,
    harbour: Harbour,
    slow_s: float,
    *,
    ships: int = 10,
    settings_sha256: str = "5" * 64,
) -> int:
    """Insert ships, images with boxes where they were, and a run; the camera's clock is slow."""
    camera, frame = look_north(session, harbour)
    site = session.get_one(Site, harbour.site.id)
    paths = []
    for number in range(ships):
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
            image_sha256=image.sha256,
            model_sha256=harbour.model.sha256,
            settings_sha256=settings_sha256,
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
