"""The job that tells a camera's clock from the vessels on a run's images."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from datetime import timedelta
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.service import reports_between
from app.clocks import repository
from app.clocks.repository import DetectedImage
from app.clocks.service import ESTIMATE_JOB, get_estimate
from app.config import Settings
from app.db import Database
from app.domain.ais import PositionReport, StaticReport
from app.domain.clock_offset import OffsetSettings, TimedImage, estimate_offset
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import EnuFrame
from app.domain.vessel_path import LONGEST_GAP_S, VesselPath, vessel_path
from app.jobs import JobRunner
from app.registration.service import camera_of
from app.runs.parameters import fusion_settings
from app.runs.service import get_run
from app.sites.water import level_at
from app.storage import Storage
from app.tables.clock import EstimateStatus
from app.tables.sites import Site

MOST_IMAGES = 120
Reports = dict[int, list[PositionReport]]
Statics = dict[int, list[StaticReport]]


class EstimateClock:
    """Does the jobs of clock estimates."""

    job = ESTIMATE_JOB

    def __init__(
        self, runner: JobRunner, database: Database, _storage: Storage, _settings: Settings
    ) -> None:
        self._runner = runner
        self._database = database

    def do(self, estimate_id: int) -> None:
        """Estimate and store what came of it."""
        self._runner.step("estimate", self._estimate, estimate_id)

    def fail(self, reason: str, estimate_id: int) -> None:
        """Say that an estimate failed, and why."""
        row = get_estimate(self._runner.session(), estimate_id)
        row.status, row.error = EstimateStatus.FAILED, reason

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that an estimate's job is not tried again, and why."""
        row = repository.estimate_of_job(session, job_id)
        if row is not None:
            row.status, row.error = EstimateStatus.FAILED, reason

    def _estimate(self, estimate_id: int) -> None:
        with self._database.reading() as session:
            result = estimated(session, estimate_id)
        row = get_estimate(self._runner.session(), estimate_id)
        row.status, row.result = EstimateStatus.SUCCEEDED, result
        self._runner.session().flush()


def estimated(session: Session, estimate_id: int) -> dict[str, Any]:
    """Return the estimate of the whole offset: what was applied already with what is missing."""
    row = get_estimate(session, estimate_id)
    run = get_run(session, row.run_id)
    seen = repository.detected(session, run.id, row.begin, row.end, MOST_IMAGES)
    settings = OffsetSettings()
    camera, frame = camera_of(session, run.registration_id)
    site = session.get_one(Site, run.site_id)
    fusion = fusion_settings(run.preset, run.parameters)
    applied_s = [
        (one.image.captured_at - one.image.captured_at_raw).total_seconds() for one in seen
    ]
    before_s = float(np.median(applied_s)) if applied_s else 0.0
    paths = _paths(session, site, frame, seen, settings, fusion) if seen else []
    images = [
        TimedImage(
            one.image.captured_at_raw.timestamp() + before_s,
            camera,
            level_at(session, site, one.image.captured_at).level_m,
            _boxes(one, fusion),
        )
        for one in seen
    ]
    found = asdict(estimate_offset(images, paths, settings))
    return found | {name: found[name] + before_s for name in ("offset_s", "low_s", "high_s")}


def _boxes(one: DetectedImage, fusion: FusionSettings) -> list[Detection]:
    return [
        Detection(box.x1_px, box.y1_px, box.x2_px, box.y2_px, box.score, box.class_id)
        for box in one.detections
        if box.score >= fusion.score_threshold
    ]


def _paths(
    session: Session,
    site: Site,
    frame: EnuFrame,
    seen: Sequence[DetectedImage],
    settings: OffsetSettings,
    fusion: FusionSettings,
) -> list[VesselPath]:
    """Return the vessels' ways around all images, as far as the search may shift them."""
    epoch = seen[0].image.captured_at.fromtimestamp(0, tz=seen[0].image.captured_at.tzinfo)
    margin = timedelta(seconds=settings.search_s + LONGEST_GAP_S)
    origin = frame.geodetic(np.zeros(3))
    area = Area.around(origin.lat_deg, origin.lon_deg, 2 * fusion.maximum_range_m)
    positions: Reports = defaultdict(list)
    statics: Statics = defaultdict(list)
    begin = seen[0].image.captured_at - margin
    for here, following in zip(seen, [*seen[1:], None], strict=True):
        end = here.image.captured_at + margin
        if following is not None and following.image.captured_at - margin <= end:
            continue
        heard = reports_between(session, site.id, begin, end, area)
        for report in heard.positions:
            positions[report.mmsi].append(report)
        for mmsi, said in heard.statics.items():
            statics[mmsi] += said
        if following is not None:
            begin = following.image.captured_at - margin
    paths = (
        vessel_path(reports, statics[mmsi], frame, site.water_level_m, epoch)
        for mmsi, reports in positions.items()
    )
    return [path for path in paths if path is not None]
