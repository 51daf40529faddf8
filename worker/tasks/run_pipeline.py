"""The main job: a run's images, batch by batch, from pixels and AIS reports to stored poses.

A batch is one step: it reads, computes for all its images, and then writes all rows and the note
that it is done in one transaction. A worker that dies inside a batch leaves no trace of it.
"""

from collections.abc import Sequence
from datetime import timedelta

import structlog
from sqlalchemy.orm import Session

from app.ais.service import ReportWindow, reports_between
from app.config import Settings
from app.db import Database
from app.domain.camera import Camera
from app.domain.detection import Detection, DetectionSettings
from app.domain.fusion import FusionResult, fuse
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import EnuFrame
from app.domain.tracks import TrackSettings, states_at
from app.errors import AppError
from app.jobs import JobRunner
from app.registration.service import camera_of
from app.runs import batch_repository as batches
from app.runs.batch_repository import ImageOutcome, RunContext
from app.runs.parameters import fusion_settings
from app.runs.service import RUN_JOB
from app.storage import Storage
from app.tables.imagery import Image
from app.tables.runs import RunStatus
from worker.inference.image import decode_image
from worker.inference.pool import DetectorPool
from worker.tasks.pose_rows import pose_rows, state_rows

log = structlog.get_logger()


class RunPipeline:
    """Does the jobs of runs."""

    job = RUN_JOB

    def __init__(
        self, runner: JobRunner, database: Database, storage: Storage, settings: Settings
    ) -> None:
        self._runner = runner
        self._database = database
        self._storage = storage
        self._images_per_step = settings.images_per_step
        self._detectors = DetectorPool(storage, settings)

    def do(self, run_id: int) -> None:
        """Do a run from its first image that is not done to its end."""
        plan = self._runner.step("begin", self._begin, run_id)
        for start in range(0, plan["images"], plan["images_per_step"]):
            stop = start + plan["images_per_step"]
            self._runner.step("images", self._do_images, run_id, start, stop)
        self._runner.step("finish", self._finish, run_id)

    def fail(self, reason: str, run_id: int) -> None:
        """Say that a run failed, and why."""
        batches.finish(self._runner.session(), run_id, RunStatus.FAILED, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that a run's job is not tried again, and why."""
        batches.fail_job(session, job_id, reason)

    def _begin(self, run_id: int) -> dict[str, int]:
        # The size of a batch is kept with the job: it must not change half-way.
        images = batches.begin(self._runner.session(), run_id)
        return {"images": images, "images_per_step": self._images_per_step}

    def _finish(self, run_id: int) -> None:
        batches.finish(self._runner.session(), run_id, RunStatus.SUCCEEDED)

    def _do_images(self, run_id: int, start: int, stop: int) -> int:
        with self._database.reading() as session:
            context = batches.context(session, run_id)
            settings = fusion_settings(context.run.preset, context.run.parameters)
            images = batches.images_between(session, run_id, start, stop)
            if not images:
                return 0
            camera, frame = camera_of(session, context.run.registration_id)
            window = _window(session, context, images, settings, camera, frame)
            detector = self._detectors.get(context.model, settings)
            known = batches.known_detections(
                session,
                [image.sha256 for image in images],
                context.model.sha256,
                detector.settings_sha256,
            )
        outcomes = []
        for image in images:
            found = known.get(image.sha256)
            try:
                boxes = (
                    [_box(row) for row in found.detections]
                    if found
                    else detector.detect(decode_image(self._storage.read(image.sha256)))
                )
            except (AppError, ValueError) as error:
                log.warning("image not usable", image_id=image.id, error=str(error))
                outcomes.append(_failed(image, str(error)))
                continue
            states = states_at(window.positions, window.statics, image.captured_at, _tracks(settings))
            result = fuse(camera, frame, context.site.water_level_m, boxes, states, settings)
            outcomes.append(
                ImageOutcome(
                    image_id=image.id,
                    image_sha256=image.sha256,
                    detection_set_id=found.id if found else None,
                    new_boxes=None if found else boxes,
                    states=state_rows(camera, frame, context.site.water_level_m, states, result),
                    poses=pose_rows(frame, states, result),
                )
            )
        batches.store(
            self._runner.session(), run_id, context.model.sha256, detector.settings_sha256, outcomes
        )
        return len(outcomes)
