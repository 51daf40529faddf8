"""Waiting for what a worker does: asked again no sooner than the server says."""

import time
from typing import TypeVar

from quaymark.client.connection import Quaymark, pause_s
from quaymark.client.rest.models import (
    CalibrationWithPhotosOut,
    ExportOut,
    ModelOut,
    ReregistrationOut,
    RunOut,
)

Work = TypeVar("Work", RunOut, ExportOut, ModelOut, ReregistrationOut, CalibrationWithPhotosOut)
PLACES: dict[type, str] = {
    RunOut: "runs",
    ExportOut: "exports",
    ModelOut: "models",
    ReregistrationOut: "reregistrations",
    CalibrationWithPhotosOut: "calibrations",
}
UNDER_WAY = {"queued", "running", "probing"}
WELL = {"succeeded", "ready", "solved"}


class EndedError(Exception):
    """What was waited for ended badly, or not in time; `last` is how it stood."""

    def __init__(self, message: str, last: object) -> None:
        self.last = last
        super().__init__(message)


def wait(client: Quaymark, work: Work, *, within_s: float = 86_400.0) -> Work:
    """Return a run, an export, a model or the like once it has ended well.

    Raises EndedError when it failed, was cancelled, or has not ended within so many seconds.
    """
    give_up_at_s = time.monotonic() + within_s
    place = f"/api/v1/{PLACES[type(work)]}/{work.id}"
    while True:
        response = client.request("GET", place)
        work = type(work).from_dict(response.json())
        if work.status not in UNDER_WAY:
            break
        pause = pause_s(response)
        if time.monotonic() + pause > give_up_at_s:
            raise EndedError(f"{place} is still {work.status} after {within_s:g} s", work)
        time.sleep(pause)
    if work.status not in WELL:
        raise EndedError(f"{place} has {work.status}: {getattr(work, 'error', None)}", work)
    return work
