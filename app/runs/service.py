"""Starting, watching and cancelling runs.

A run freezes what it is about when it is asked for: registration, detector, settings and the list
of images. So it can be explained later, and taken over by another worker at any image.
"""

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from app import __version__
from app.db import find, now
from app.domain.detection import DetectionSettings
from app.domain.fusion_settings import FusionSettings, Preset
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.jobs import JobClient, JobQueue
from app.learning.service import learnt_settings
from app.paging import Paging
from app.runs import growth_repository as growth
from app.runs import recording_repository, reference_repository, repository
from app.runs.parameters import as_json, fusion_settings
from app.runs.telling import announce_end
from app.tables.detection import Model
from app.tables.runs import Run, RunStatus
from app.tables.sites import Viewport

RUN_JOB = "run_pipeline"
ENDED = frozenset({RunStatus.SUCCEEDED, RunStatus.FAILED, RunStatus.CANCELLED})


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is, with its rate and what remains; None where it cannot be told.

    `is_stale` says that its viewport was registered anew, times or viewports of its images were
    changed, or an AIS recording of their time was deleted since (`lost_recording`): its poses stay
    as they are. `is_reference`: its site's other runs are measured by it.
    """

    status: RunStatus
    images_done: int
    images_total: int
    images_failed: int
    images_per_s: float | None
    remaining_s: float | None
    detections: int
    matches: int
    poses: int
    is_stale: bool
    lost_recording: bool
    is_reference: bool


def start_run(
    session: Session,
    jobs: JobClient,
    *,
    viewport_id: int,
    detector: str | None,
    preset: str,
    parameters: Mapping[str, Any],
    name: str = "",
    user_id: int | None = None,
) -> Run:
    """Store a run over all present images of a viewport and put its job into the queue.

    Preset waterline takes what the site's reviews taught, where `parameters` say nothing else, and
    photographs are decoded smaller where the site's ground truth proves that it does no harm.
    Raises NotFound (viewport), Conflict (no registration, no image), Invalid (detector, preset,
    parameters).
    """
    viewport = find(session, Viewport, viewport_id)
    if viewport is None:
        raise NotFound("there is no such viewport")
    site_id = viewport.camera.site_id
    learnt = learnt_settings(session, site_id) if preset == Preset.WATERLINE else {}
    settings = fusion_settings(preset, {**learnt, **parameters})
    registration = repository.latest_registration(session, viewport_id)
    if registration is None:
        raise _not_ready(
            "the viewport has no camera pose yet: register it first "
            f"(POST /api/v1/viewports/{viewport_id}/registrations with method pnp or given)"
        )
    model = ready_model(session, detector)
    if "decoding_divisor" not in parameters:
        settings = _decoded_as_proven(session, site_id, model, settings)
    run = Run(
        site_id=site_id,
        viewport_id=viewport_id,
        registration_id=registration.id,
        model_id=model.id,
        name=name,
        preset=settings.preset.value,
        parameters=as_json(settings),
        code_version=__version__,
        workflow_id=f"run-{uuid.uuid4()}",
        created_by_id=user_id,
    )
    if repository.add(session, run) == 0:
        raise _not_ready("the viewport has no images yet: upload some first (POST /api/v1/images)")
    jobs.enqueue(session, RUN_JOB, run.id, queue=JobQueue.RUNS, job_id=run.workflow_id)
    return run


def _decoded_as_proven(
    session: Session, site_id: int, model: Model, settings: FusionSettings
) -> FusionSettings:
    """Let photographs be decoded smaller where the site's ground truth says it does no harm."""
    from app.evaluation.decoding import proven_divisor  # noqa: PLC0415  figures ask about runs

    asked = DetectionSettings(settings.score_threshold, settings.nms_iou, settings.class_ids)
    divisor = proven_divisor(session, site_id, model.sha256, asked)
    return replace(settings, decoding_divisor=divisor)


def start_again(session: Session, jobs: JobClient, run: Run, *, user_id: int | None = None) -> Run:
    """Start a run like another one, on the newest registration and the present images.

    What the detector found before is used again. Raises as `start_run`.
    """
    return start_run(
        session,
        jobs,
        viewport_id=run.viewport_id,
        detector=run.model.name,
        preset=run.preset,
        parameters=run.parameters,
        name=run.name,
        user_id=user_id,
    )


def grow(
    session: Session, jobs: JobClient, run: Run, late: tuple[datetime, datetime] | None
) -> bool:
    """Add the images that came since a run ended, fuse again those of the time `late`, and go on.

    Images on which a person has worked stay as they are. Returns whether there is anything to do.
    """
    starts = [growth.take_new_images(session, run)]
    again = growth.untouched(session, run.id, *late) if late is not None else ()
    if again:
        starts.append(growth.forget_outcome(session, run.id, again))
    due = [start for start in starts if start is not None]
    if not due:
        return False
    growth.queue_again(session, run, f"run-{uuid.uuid4()}")
    jobs.enqueue(session, RUN_JOB, run.id, min(due), queue=JobQueue.RUNS, job_id=run.workflow_id)
    return True


def stale_runs(session: Session, viewport_id: int) -> list[Run]:
    """Return a viewport's runs that rest on an older registration, or on times since changed."""
    newest = repository.newest_registration_ids(session, [viewport_id]).get(viewport_id)
    return [
        run
        for run in repository.of_viewport(session, viewport_id)
        if run.has_changed_images or (newest is not None and run.registration_id != newest)
    ]


def ready_model(session: Session, name: str | None) -> Model:
    """Return the detector with a name, else the newest. Raises Invalid when none is ready."""
    model = repository.ready_model(session, name)
    if model is None:
        raise Invalid.field("detector", _no_detector(name))
    return model


def _not_ready(reason: str) -> Conflict:
    return Conflict(reason, fields=(FieldError("viewport_id", reason),))


def _no_detector(name: str | None) -> str:
    fix = "add one with POST /api/v1/models or `quaymark model add`, and wait until it is ready"
    return f"no detector is ready; {fix}" if name is None else f"{name!r} is not ready; {fix}"


def get_run(session: Session, run_id: int) -> Run:
    """Return a run. Raises NotFound."""
    run = repository.get(session, run_id)
    if run is None:
        raise NotFound("there is no such run")
    return run


def list_runs(
    session: Session, site_ids: frozenset[int] | None, viewport_id: int | None, paging: Paging
) -> tuple[Sequence[Run], str | None]:
    """Return a page of the runs of some sites (None: all)."""
    return repository.listed(session, site_ids, viewport_id, paging)


def newest_runs(
    session: Session, site_ids: frozenset[int] | None, limit: int = 50
) -> list[tuple[Run, Progress]]:
    """Return the newest runs with their progress."""
    return with_progress(session, repository.newest(session, site_ids, limit))


def label(run: Run) -> str:
    """Return what a run is called on screen."""
    return run.name or f"Run {run.id}"


def ready_models(session: Session) -> list[tuple[str, str]]:
    """Return (name, text) of the detectors a run may use."""
    return [
        (model.name, f"{model.name} ({model.family})") for model in repository.ready_models(session)
    ]


def runnable_viewports(session: Session, site_ids: frozenset[int] | None) -> list[tuple[int, str]]:
    """Return (id, text) of the viewports that have a camera pose and images."""
    return [
        (viewport_id, f"{site} / {camera} / {viewport} ({count} images)")
        for viewport_id, site, camera, viewport, count in repository.runnable_viewports(
            session, site_ids
        )
    ]


OUTCOMES = {
    "matched": "Matched with a detection",
    "no_detection_left": "No detection left for them",
    "cost_too_high": "Detection too unlike (cost too high)",
    "outside_image": "Beside the picture",
    "clock_suspect": "Withheld: clock suspect",
    "size_unknown": "Matched, but of unknown size",
    "no_heading": "Without a heading",
}


def outcomes(session: Session, run_id: int) -> list[tuple[str, int]]:
    """Return (text, count) of what became of the vessels heard near the pictures."""
    counts = repository.outcome_counts(session, run_id)
    return [(text, counts[code]) for code, text in OUTCOMES.items() if code in counts]


def image_errors(session: Session, run_id: int) -> Sequence[tuple[str, str]]:
    """Return (file name, reason) of the first images a run could not use."""
    return repository.image_errors(session, run_id)


def progress(session: Session, run: Run) -> Progress:
    """Tell how far a run is, from its rows alone."""
    return with_progress(session, [run])[0][1]


def with_progress(session: Session, runs: Sequence[Run]) -> list[tuple[Run, Progress]]:
    """Tell of each run how far it is, with as many queries for many as for one."""
    counts = repository.counts(session, [run.id for run in runs])
    newest = repository.newest_registration_ids(session, [run.viewport_id for run in runs])
    lost = {
        run_id
        for recording in recording_repository.deleted(session)
        for run_id in recording_repository.runs_in_time_of(session, recording, list(counts))
    }
    references = reference_repository.run_ids(session, {run.site_id for run in runs})
    return [
        (
            run,
            _progress(
                run,
                counts[run.id],
                newest.get(run.viewport_id, run.registration_id),
                lost_recording=run.id in lost,
                is_reference=run.id in references,
            ),
        )
        for run in runs
    ]


def resting_on_recording(session: Session, file_id: int) -> list[int]:
    """Return the runs that placed vessels in the time of an AIS recording, in order."""
    recording = recording_repository.recorded(session, file_id)
    return sorted(recording_repository.runs_in_time_of(session, recording)) if recording else []


def _progress(
    run: Run,
    counts: repository.Counts,
    newest_registration_id: int,
    *,
    lost_recording: bool,
    is_reference: bool,
) -> Progress:
    rate = _rate_per_s(run, counts.images_done, counts.last_done_at)
    left = counts.images_total - counts.images_done
    return Progress(
        status=run.status,
        images_done=counts.images_done,
        images_total=counts.images_total,
        images_failed=counts.images_failed,
        images_per_s=rate,
        remaining_s=left / rate if rate and run.status not in ENDED else None,
        detections=counts.detections,
        matches=counts.matches,
        poses=counts.poses,
        is_stale=newest_registration_id != run.registration_id
        or run.has_changed_images
        or lost_recording,
        lost_recording=lost_recording,
        is_reference=is_reference,
    )


def _rate_per_s(run: Run, done: int, last_done_at: datetime | None) -> float | None:
    if run.started_at is None or last_done_at is None or not done:
        return None
    return done / max((last_done_at - run.started_at).total_seconds(), 1e-3)


def cancel_job(session: Session, workflow_id: str) -> None:
    """Mark the run behind a stopped job as cancelled, if there is one and it has not ended."""
    run = repository.of_job(session, workflow_id)
    if run is not None:
        mark_cancelled(session, run)


def mark_cancelled(session: Session, run: Run) -> bool:
    """Mark a run as cancelled; its job must have been stopped before. False if it has ended."""
    is_cancelled = repository.mark_cancelled(session, run.id, now())
    if is_cancelled:
        announce_end(session, run.id)
    return is_cancelled
