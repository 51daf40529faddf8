"""Why a run has made no pose, and what to do: a newcomer's first run often makes none.

The commonest reasons are told apart by what the run left behind: nothing was detected, AIS has
nothing of the photographs' time (a wrong clock, a wrong date, another day's recording), or nothing
of their place.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy.orm import Session

from app.runs import emptiness_repository as repository
from app.runs.service import Progress
from app.tables.runs import Run, RunStatus
from app.templating import utc


@dataclass(frozen=True, slots=True)
class Reason:
    """Why there is no pose, what to do about it, and where (label, address)."""

    title: str
    advice: str
    links: Sequence[tuple[str, str]]


def reason(session: Session, run: Run, progress: Progress) -> Reason | None:
    """Return why a run that succeeded has no pose; None where it has, or its images failed."""
    failed = progress.images_failed == progress.images_total
    if run.status is not RunStatus.SUCCEEDED or progress.poses or failed:
        return None
    if not progress.detections:
        return Reason(
            "No vessel was detected",
            "Run again with a lower least score, or with a larger detector: yolox-x sees small "
            "vessels that nano misses.",
            [("New run", f"/runs/new?viewport_id={run.viewport_id}"), ("Detectors", "/models")],
        )
    return _unheard(session, run) or Reason(
        "No detection was matched with a vessel",
        "Below stands what became of the vessels. Where there are none, all were farther away "
        "than the longest range, or beside the picture: look at the registration on the map.",
        [("Registration", f"/viewports/{run.viewport_id}/register")],
    )


def _unheard(session: Session, run: Run) -> Reason | None:
    images = repository.of_images(session, run.id)
    if images.first_at is None or images.last_at is None:
        return None
    if repository.was_heard(session, run, images.first_at, images.last_at):
        return None
    recorded = repository.of_recordings(session, run.site_id)
    said = (
        f"the recordings are of {_span(recorded.first_at, recorded.last_at)}"
        if recorded.first_at and recorded.last_at
        else "there is no recording yet"
    )
    return Reason(
        "AIS has nothing of the time of these photographs",
        f"They were taken {_span(images.first_at, images.last_at)}; {said}. Import AIS of those "
        "hours. Or is the photographs' time wrong? Set it right at the camera's clock, or delete "
        "them and upload them again with the right time. Then run again.",
        [
            ("Import AIS", "/ais"),
            ("Clock of the camera", f"/cameras/{run.viewport.camera_id}/clock"),
        ],
    )


def _span(first_at: datetime, last_at: datetime) -> str:
    begin, end = utc(first_at), utc(last_at)
    return begin if begin == end else f"{begin} \N{EN DASH} {end}"
