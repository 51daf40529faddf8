"""The main job: a run's images, batch by batch, from pixels and AIS reports to stored poses.

A batch is one step: it reads, computes for all its images, and then writes all rows and the note
that it is done in one transaction. A worker that dies inside a batch leaves no trace of it. While a
batch is fused and stored, the detector looks at the images of the next one already; where nothing
has to be detected, the next one is fused while a database elsewhere stores this one. Images are
fused together in groups, the same in every run, so that a pose does not move because another run
took larger steps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

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
from app.runs.batch_repository import KnownBoxes, RunPhotograph
from app.runs.outcome_repository import ImageOutcome
from app.runs.parameters import fusion_settings
from app.runs.service import RUN_JOB
from app.sites.water import Level, levels_at
from app.storage import Storage
from app.tables.detection import Model
from app.tables.runs import RunStatus
from worker.inference.ahead import DetectAhead, Looks, Unusable
from worker.inference.pool import DetectorPool
from worker.tasks import check_clock
from worker.tasks.pose_rows import pose_rows, state_rows
from worker.tasks.vessel_states import states_around
from worker.tasks.work_ahead import WorkAhead

log = structlog.get_logger()
# Groups of images in a step when nothing has to be detected: larger steps ask less often. On SQLite
# more than two would keep reviewers waiting, who write in turn with the worker.
GROUPS_OF_KNOWN = 4
GROUPS_OF_KNOWN_ON_SQLITE = 2


@dataclass(frozen=True)
class _Batch:
    """All that is needed to compute the outcomes of some images; `next_sha256s` come after them."""

    images: Sequence[RunPhotograph]
    states: Mapping[int, list[VesselState]]
    known: Mapping[str, KnownBoxes]
    camera: Camera
    frame: EnuFrame
    water: Mapping[int, Level]
    model: Model
    settings_sha256: str
    settings: FusionSettings
    next_sha256s: Sequence[str]

    def is_to_be_detected(self, image: RunPhotograph) -> bool:
        """Whether the detector has to look at an image."""
        return image.deleted_at is None and image.sha256 not in self.known


class _Prepared(NamedTuple):
    """A batch as it was read, with its outcomes where nothing is to be detected.

    `to_detect` is what the detector has to look at, by content: of this batch, then of the next.
    """

    batch: _Batch
    to_detect: Sequence[str]
    outcomes: list[ImageOutcome] | None


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
        plan = self._runner.step("begin", self._begin, run_id, first)
        looks_ahead = plan.get("unseen", 1) > 0
        # Jobs begun by earlier versions fused together what they did in a step.
        together = plan.get("images_together", plan["images_per_step"])
        prepare = partial(self._prepare, run_id, together, looks_ahead=looks_ahead)
        ahead = WorkAhead(prepare, plan["images"])
        looks = Looks()
        try:
            for start in range(first, plan["images"], plan["images_per_step"]):
                stop = start + plan["images_per_step"]
                self._runner.step(
                    "images", self._do_images, run_id, start, stop, together, looks, ahead
                )
        finally:
            looks.give_up()
            ahead.give_up()
        self._runner.step("finish", self._finish, run_id, first)

    def fail(self, reason: str, run_id: int, _first: int = 0) -> None:
        """Say that a run failed, and why."""
        batches.finish(self._runner.session(), run_id, RunStatus.FAILED, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that a run's job is not tried again, and why."""
        batches.fail_job(session, job_id, reason)

    def _begin(self, run_id: int, first: int) -> dict[str, int]:
        with self._database.reading() as session:
            context = batches.context(session, run_id)
            settings = fusion_settings(context.run.preset, context.run.parameters)
            unseen = batches.unseen(
                session,
                run_id,
                first,
                context.run.image_count,
                model_sha256=context.model.sha256,
                settings_sha256=self._detectors.settings_sha256(context.model, settings),
            )
        # The size of a batch is kept with the job: it must not change half-way.
        known = GROUPS_OF_KNOWN_ON_SQLITE if self._database.is_sqlite else GROUPS_OF_KNOWN
        return {
            "images": batches.begin(self._runner.session(), run_id),
            "images_per_step": self._images_per_step * (1 if unseen else known),
            "images_together": self._images_per_step,
            "unseen": len(unseen),
        }

    def _finish(self, run_id: int, first: int) -> None:
        with self._database.reading() as session:
            doubted = check_clock.suspicions(session, run_id, first)
        check_clock.act_on(self._runner.session(), run_id, doubted)
        batches.finish(self._runner.session(), run_id, RunStatus.SUCCEEDED)

    def _do_images(
        self,
        run_id: int,
        start: int,
        stop: int,
        together: int,
        looks: Looks,
        ahead: WorkAhead[_Prepared],
    ) -> int:
        batch, to_detect, outcomes = ahead.take(start, stop)
        looks.keep(set(to_detect))
        if to_detect:
            detector = self._detectors.get(batch.model, batch.settings)
            self._ahead.begin(looks, detector, to_detect)
        elif batch.images and not self._database.is_sqlite:
            # SQLite keeps nobody waiting: a thread would only hold up those who wait for its lock.
            ahead.begin(stop, 2 * stop - start)
        if outcomes is None:
            outcomes = _outcomes(batch, start, stop, together, looks)
        batches.store(
            self._runner.session(), run_id, batch.model.sha256, batch.settings_sha256, outcomes
        )
        return len(outcomes)

    def _prepare(
        self, run_id: int, together: int, start: int, stop: int, *, looks_ahead: bool
    ) -> _Prepared:
        batch = self._read(run_id, start, stop, looks_ahead=looks_ahead)
        unseen = [image.sha256 for image in batch.images if batch.is_to_be_detected(image)]
        to_detect = [*unseen, *batch.next_sha256s]
        if to_detect:
            return _Prepared(batch, to_detect, None)
        return _Prepared(batch, (), _outcomes(batch, start, stop, together, Looks()))

    def _read(self, run_id: int, start: int, stop: int, *, looks_ahead: bool) -> _Batch:
        with self._database.reading() as session:
            context = batches.context(session, run_id)
            settings = fusion_settings(context.run.preset, context.run.parameters)
            images = batches.images_between(session, run_id, start, stop)
            camera, frame = camera_of(session, context.run.registration_id)
            camera_at = frame.geodetic(camera.center_in_world)
            key = self._detectors.settings_sha256(context.model, settings)
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
                    key,
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
                model=context.model,
                settings_sha256=key,
                settings=settings,
                next_sha256s=batches.unseen(
                    session,
                    run_id,
                    stop,
                    2 * stop - start,
                    model_sha256=context.model.sha256,
                    settings_sha256=key,
                )
                if looks_ahead
                else (),
            )


def _outcomes(
    batch: _Batch, start: int, stop: int, together: int, looks: Looks
) -> list[ImageOutcome]:
    """Fuse a batch, group by group."""
    outcomes: list[ImageOutcome] = []
    for first in range(start, stop, together):
        group = [one for one in batch.images if first <= one.position < first + together]
        outcomes += _outcomes_of(batch, group, looks)
    return outcomes


def _outcomes_of(batch: _Batch, group: Sequence[RunPhotograph], looks: Looks) -> list[ImageOutcome]:
    """Fuse the vessels of a while together, all on one water."""
    boxes = {image.id: _boxes(batch, image, looks) for image in group}
    seen: list[tuple[RunPhotograph, SeenImage]] = []
    for image in group:
        found = boxes[image.id]
        if not isinstance(found, ImageOutcome):
            seen.append((image, _seen(batch, image, found)))
    shown = [image for _, image in seen]
    results = fuse_series(batch.camera, batch.frame, shown, batch.settings)
    states = state_rows(batch.camera, batch.frame, shown, results)
    fused = {
        image.id: _fused(batch, image, one, result, rows)
        for (image, one), result, rows in zip(seen, results, states, strict=True)
    }
    return [
        unusable if isinstance(unusable := boxes[image.id], ImageOutcome) else fused[image.id]
        for image in group
    ]


def _seen(batch: _Batch, image: RunPhotograph, boxes: Sequence[Detection]) -> SeenImage:
    return SeenImage(
        detections=boxes,
        states=batch.states[image.id],
        water_level_m=batch.water[image.id].level_m,
        at_s=image.captured_at.timestamp(),
    )


def _boxes(batch: _Batch, image: RunPhotograph, looks: Looks) -> list[Detection] | ImageOutcome:
    """Return an image's detections, or its outcome when it cannot be looked at."""
    if image.deleted_at is not None:
        return _unusable(image, "the image was deleted before its turn came")
    known = batch.known.get(image.sha256)
    if known is not None:
        return known.boxes
    found = looks.of(image.sha256)
    if isinstance(found, Unusable):
        # One bad file among thousands is told by name; a broken detector ends the run.
        log.warning("image not usable", image_id=image.id, error=found.reason)
        return _unusable(image, found.reason)
    return found


def _fused(
    batch: _Batch,
    image: RunPhotograph,
    seen: SeenImage,
    result: FusionResult,
    states: Sequence[dict[str, Any]],
) -> ImageOutcome:
    known = batch.known.get(image.sha256)
    return ImageOutcome(
        image_id=image.id,
        image_sha256=image.sha256,
        detection_set_id=known.id if known else None,
        new_boxes=None if known else seen.detections,
        states=states,
        poses=pose_rows(batch.frame, seen.states, result),
        water=batch.water[image.id],
    )


def _unusable(image: RunPhotograph, reason: str) -> ImageOutcome:
    return ImageOutcome(image.id, image.sha256, None, None, (), (), error=reason)
