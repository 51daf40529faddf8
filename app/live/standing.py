"""Standing runs: a run that takes a viewport's images as they come.

It is one run as any other, with its figures and its review, that grows: images that come are added
and fused; what the detector found once is never looked for again. When reports of a time come late,
its images are fused again, except those on which a person has worked. A new registration begins a
new run; the old one stays beside it.
"""

from collections.abc import Mapping, Sequence
from datetime import timedelta
from typing import Any

from sqlalchemy.orm import Session

from app.db import now
from app.errors import AppError, Invalid, NotFound
from app.jobs import JobClient
from app.live import repository
from app.paging import Paging
from app.registration import service as registration
from app.runs import service as runs
from app.runs.parameters import as_json, fusion_settings
from app.tables.live import StandingRun
from app.tables.runs import Run
from app.tables.sites import Viewport

LONGEST_WAIT_S = 30 * 86_400.0
LEASE_PREFIX = "standing"


def get(session: Session, standing_id: int) -> StandingRun:
    """Return a standing run. Raises NotFound."""
    row = repository.standing(session, standing_id)
    if row is None:
        raise NotFound("there is no such standing run")
    return row


def listed(
    session: Session, site_ids: frozenset[int] | None, paging: Paging, camera_id: int | None = None
) -> tuple[Sequence[StandingRun], str | None]:
    """Return a page of the standing runs of some sites (None: all)."""
    return repository.standing_runs(session, site_ids, paging, camera_id)


def add(
    session: Session,
    viewport: Viewport,
    *,
    name: str,
    detector: str | None,
    preset: str,
    parameters: Mapping[str, Any],
    ais_wait_s: float,
    user_id: int | None,
) -> StandingRun:
    """Store what shall be done with a viewport's images. Raises Invalid naming the field."""
    settings = fusion_settings(preset, parameters)
    if not 0 <= ais_wait_s <= LONGEST_WAIT_S:
        raise Invalid.field("ais_wait_s", "must lie between 0 and 30 days")
    row = StandingRun(
        viewport_id=viewport.id,
        model_id=runs.ready_model(session, detector).id,
        name=name or f"{viewport.name}, standing",
        preset=settings.preset.value,
        parameters=as_json(settings),
        ais_wait_s=ais_wait_s,
        created_by_id=user_id,
    )
    session.add(row)
    session.flush()
    return row


def set_paused(session: Session, row: StandingRun, *, paused: bool) -> None:
    """Pause or go on."""
    row.paused_at = now() if paused else None
    session.flush()


def wanted(session: Session) -> Mapping[int, int]:
    """Return the standing runs to look after, each with its version."""
    return repository.running(session)


def look_after(session: Session, jobs: JobClient, standing_id: int) -> None:
    """Do what is due: begin a run, add images that came, fuse again what was heard late."""
    row = repository.standing(session, standing_id)
    if row is None or row.paused_at is not None:
        return
    trouble = None
    try:
        _advance(session, jobs, row)
    except AppError as error:  # not registered yet, no image yet
        trouble = error.detail
    repository.noted(session, standing_id, now(), trouble)


def _advance(session: Session, jobs: JobClient, row: StandingRun) -> None:
    site_id = row.viewport.camera.site_id
    run = _present_run(session, row)
    current = registration.current_registrations(session, [row.viewport_id]).get(row.viewport_id)
    if run is None or (current is not None and current.id != run.registration_id):
        newest, _, _ = repository.new_reports(session, site_id, row.last_report_id)
        begun = runs.start_run(
            session,
            jobs,
            viewport_id=row.viewport_id,
            detector=row.model.name,
            preset=row.preset,
            parameters=row.parameters,
            name=row.name,
            user_id=row.created_by_id,
        )
        row.run_id = begun.id
        session.flush()
        repository.seen_to(session, row.id, newest)
    elif run.status in runs.ENDED:
        _grow(session, jobs, row, run, site_id)


def _present_run(session: Session, row: StandingRun) -> Run | None:
    """Return the run that grows; None before the first, and after somebody deleted it."""
    try:
        return runs.get_run(session, row.run_id) if row.run_id is not None else None
    except NotFound:
        return None


def _grow(session: Session, jobs: JobClient, row: StandingRun, run: Run, site_id: int) -> None:
    newest, first, last = repository.new_reports(session, site_id, row.last_report_id)
    late: tuple[Any, Any] | None = None
    if first is not None and last is not None:
        reach = timedelta(seconds=fusion_settings(run.preset, run.parameters).maximum_report_age_s)
        late = (max(first - reach, now() - timedelta(seconds=row.ais_wait_s)), last + reach)
    runs.grow(session, jobs, run, late)
    repository.seen_to(session, row.id, newest)
