"""The main job: a run's images, batch by batch, from pixels and AIS reports to stored poses.

A batch is one step: it reads, computes for all its images, and then writes all rows and the note
that it is done in one transaction. A worker that dies inside a batch leaves no trace of it. While a
batch is fused and stored, the detector looks at the images of the next one already.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import structlog
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.fusion import FusionResult, SeenImage, fuse_series
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import EnuFrame
from app.domain.vessel_state import VesselState
from app.jobs import JobRunner
from app.registration.service import camera_of
from app.runs import batch_repository as batches
from app.runs.batch_repository import ImageOutcome
from app.runs.parameters import fusion_settings
from app.runs.service import RUN_JOB
from app.sites.water import Level, levels_at
from app.storage import Storage
from app.tables.detection import Detection as DetectionRow
from app.tables.detection import DetectionSet
from app.tables.imagery import Image
from app.tables.runs import RunStatus
from worker.inference.ahead import DetectAhead, Looks, Unusable
from worker.inference.detector import Detector
from worker.inference.pool import DetectorPool
from worker.tasks import check_clock
from worker.tasks.pose_rows import pose_rows, state_rows
from worker.tasks.vessel_states import states_around

log = structlog.get_logger()


@dataclass(frozen=True)
class _Batch:
    """All that is needed to compute the outcomes of some images; `next_sha256s` come after them."""

    images: Sequence[Image]
    states: Mapping[int, list[VesselState]]
    known: Mapping[str, DetectionSet]
    camera: Camera
    frame: EnuFrame
    water: Mapping[int, Level]
    detector: Detector
    model_sha256: str
    settings: FusionSettings
    next_sha256s: Sequence[str]

    def is_to_be_detected(self, image: Image) -> bool:
        """Whether the detector has to look at an image."""
        return image.deleted_at is None and image.sha256 not in self.known


class RunPipeline:
    """Does the jobs of runs."""

    job = RUN_JOB

    def __init__(
        self, runner: JobRunner, database: Database, storage: Storage, settings: Settings
    ) -> None:
        self._runner = runner
        self._database = database
        self._ahead = DetectAhead(storage)
        self._images_per_step = settings.images_per_step
        self._detectors = DetectorPool(storage, settings)

    def do(self, run_id: int, first: int = 0) -> None:
        """Do a run from its first image that is not done to its end; before `first` all are."""
        plan = self._runner.step("begin", self._begin, run_id)
        looks = Looks()
        try:
            for start in range(first, plan["images"], plan["images_per_step"]):
                stop = start + plan["images_per_step"]
                self._runner.step("images", self._do_images, run_id, start, stop, looks)
        finally:
            looks.give_up()
        self._runner.step("finish", self._finish, run_id, first)

    def fail(self, reason: str, run_id: int, _first: int = 0) -> None:
        """Say that a run failed, and why."""
        batches.finish(self._runner.session(), run_id, RunStatus.FAILED, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that a run's job is not tried again, and why."""
        batches.fail_job(session, job_id, reason)

    def _begin(self, run_id: int) -> dict[str, int]:
        # The size of a batch is kept with the job: it must not change half-way.
        images = batches.begin(self._runner.session(), run_id)
        return {"images": images, "images_per_step": self._images_per_step}

    def _finish(self, run_id: int, first: int) -> None:
        with self._database.reading() as session:
            doubted = check_clock.suspicions(session, run_id, first)
        check_clock.act_on(self._runner.session(), run_id, doubted)
        batches.finish(self._runner.session(), run_id, RunStatus.SUCCEEDED)

    def _do_images(self, run_id: int, start: int, stop: int, looks: Looks) -> int:
        batch = self._read(run_id, start, stop)
        unseen = [image.sha256 for image in batch.images if batch.is_to_be_detected(image)]
        looks.keep({*unseen, *batch.next_sha256s})
        self._ahead.begin(looks, batch.detector, [*unseen, *batch.next_sha256s])
        outcomes = _outcomes(batch, looks)
        batches.store(
            self._runner.session(),
            run_id,
            batch.model_sha256,
            batch.detector.settings_sha256,
            outcomes,
        )
        return len(outcomes)

    def _read(self, run_id: int, start: int, stop: int) -> _Batch:
        with self._database.reading() as session:
            context = batches.context(session, run_id)
            settings = fusion_settings(context.run.preset, context.run.parameters)
            images = batches.images_between(session, run_id, start, stop)
            camera, frame = camera_of(session, context.run.registration_id)
            camera_at = frame.geodetic(camera.center_in_world)
            detector = self._detectors.get(context.model, settings)
            return _Batch(
                images=images,
                states=states_around(
                    session,
                    context.site.id,
                    camera_at,
                    {image.id: image.captured_at for image in images},
                    settings,
                ),
                known=batches.known_detections(
                    session,
                    [image.sha256 for image in images],
                    context.model.sha256,
                    detector.settings_sha256,
                ),
                camera=camera,
                frame=frame,
                water=dict(
                    zip(
                        (image.id for image in images),
                        levels_at(session, context.site, [image.captured_at for image in images]),
                        strict=True,
                    )
                ),
                detector=detector,
                model_sha256=context.model.sha256,
                settings=settings,
                next_sha256s=batches.unseen(
                    session,
                    run_id,
                    stop,
                    2 * stop - start,
                    model_sha256=context.model.sha256,
                    settings_sha256=detector.settings_sha256,
                ),
            )


def _outcomes(batch: _Batch, looks: Looks) -> list[ImageOutcome]:
    """Detect in all images first: vessels of one while are fused together."""
    found: dict[int, list[Detection]] = {}
    unusable: dict[int, ImageOutcome] = {}
    for image in batch.images:
        boxes = _boxes(batch, image, looks)
        if isinstance(boxes, ImageOutcome):
            unusable[image.id] = boxes
        else:
            found[image.id] = boxes
    seen = [image for image in batch.images if image.id in found]
    results = fuse_series(
        batch.camera,
        batch.frame,
        [
            SeenImage(
                detections=found[image.id],
                states=batch.states[image.id],
                water_level_m=batch.water[image.id].level_m,
                at_s=image.captured_at.timestamp(),
            )
            for image in seen
        ],
        batch.settings,
    )
    fused = {image.id: result for image, result in zip(seen, results, strict=True)}
    return [
        unusable.get(image.id) or _fused(batch, image, found[image.id], fused[image.id])
        for image in batch.images
    ]


def _boxes(batch: _Batch, image: Image, looks: Looks) -> list[Detection] | ImageOutcome:
    """Return an image's detections, or its outcome when it cannot be looked at."""
    if image.deleted_at is not None:
        return _unusable(image, "the image was deleted before its turn came")
    known = batch.known.get(image.sha256)
    if known is not None:
        return [_box(row) for row in known.detections]
    found = looks.of(image.sha256)
    if isinstance(found, Unusable):
        # One bad file among thousands is told by name; a broken detector ends the run.
        log.warning("image not usable", image_id=image.id, error=found.reason)
        return _unusable(image, found.reason)
    return found


def _fused(
    batch: _Batch, image: Image, boxes: list[Detection], result: FusionResult
) -> ImageOutcome:
    known = batch.known.get(image.sha256)
    states, water = batch.states[image.id], batch.water[image.id]
    return ImageOutcome(
        image_id=image.id,
        image_sha256=image.sha256,
        detection_set_id=known.id if known else None,
        new_boxes=None if known else boxes,
        states=state_rows(batch.camera, batch.frame, water.level_m, states, result),
        poses=pose_rows(batch.frame, states, result),
        water=water,
    )


def _unusable(image: Image, reason: str) -> ImageOutcome:
    return ImageOutcome(image.id, image.sha256, None, None, (), (), error=reason)


def _box(row: DetectionRow) -> Detection:
    return Detection(row.x1_px, row.y1_px, row.x2_px, row.y2_px, row.score, row.class_id)
