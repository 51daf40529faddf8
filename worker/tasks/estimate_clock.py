"""The job that tells a camera's clock from the vessels on a run's images."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import partial
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.clocks import repository
from app.clocks.repository import DetectedImage
from app.clocks.service import ESTIMATE_JOB, get_estimate
from app.config import Settings
from app.db import Database
from app.domain.clock_offset import OffsetSettings, Part, estimate_parts
from app.domain.clock_sight import TimedImage
from app.domain.zone_offset import ZoneSettings, find_offset
from app.imagery.true_time import CLOCK_SOURCES
from app.jobs import JobRunner
from app.registration.service import camera_of
from app.runs.parameters import fusion_settings
from app.runs.service import get_run
from app.sites.water import level_at
from app.storage import Storage
from app.tables.clock import ClockEstimate, EstimateStatus
from app.tables.sites import Site
from worker.tasks.vessel_paths import boxes_of, paths_around

MOST_IMAGES = 120


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
            found = estimated(session, estimate_id)
        session = self._runner.session()
        row = get_estimate(session, estimate_id)
        begins = [row.begin, *(part.begin for part in found[1:])]
        ends = [*(part.begin for part in found[1:]), row.end]
        row.status, row.result = EstimateStatus.SUCCEEDED, found[0].result
        row.begin, row.end = begins[0], ends[0]
        for number, part in enumerate(found[1:], 1):
            session.add(
                ClockEstimate(
                    camera_id=row.camera_id,
                    run_id=row.run_id,
                    begin=begins[number],
                    end=ends[number],
                    status=EstimateStatus.SUCCEEDED,
                    workflow_id=f"{row.workflow_id}-{number}",
                    created_by_id=row.created_by_id,
                    result=part.result,
                )
            )
        session.flush()


@dataclass(frozen=True, slots=True)
class Found:
    """What a time's images say, from `begin` on by the camera's clock."""

    begin: datetime | None
    result: dict[str, Any]


def estimated(session: Session, estimate_id: int) -> list[Found]:
    """Return the estimates of the whole offset: what was applied already with what is missing.

    One for each time between which the clock was set, by time.
    """
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
    around = partial(paths_around, session, site, frame, seen, settings, fusion)
    images = [
        TimedImage(
            one.image.captured_at_raw.timestamp() + before_s,
            camera,
            level_at(session, site, one.image.captured_at).level_m,
            boxes_of(one, fusion),
        )
        for one in seen
    ]
    parts = estimate_parts(images, around(0.0), settings) if images else []
    if len(parts) < 2:
        near = parts[0].estimate if parts else None
        offset = find_offset(images, around, settings, ZoneSettings(), near)
        parts = [Part(0, len(images), offset)]
    return [_found(seen[part.first : part.last], part, before_s) for part in parts]


def _found(seen: Sequence[DetectedImage], part: Part, before_s: float) -> Found:
    told = asdict(part.estimate)
    told |= {name: told[name] + before_s for name in ("offset_s", "low_s", "high_s")}
    given = any(one.image.captured_at_source not in CLOCK_SOURCES for one in seen)
    begin = min((one.image.captured_at_raw for one in seen), default=None)
    return Found(begin, told | {"concerns_given": given})
