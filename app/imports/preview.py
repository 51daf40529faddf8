"""A batch as it would be committed: how many, from when to when, to which viewports, what is odd.

Everything is worked out from the files' rows, each time it is asked for, so that a changed time
rule shows at once what it does. What will not be taken is told with its reason and a few examples;
what is taken but looks strange is told as well.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from itertools import pairwise
from statistics import median
from typing import Protocol

from app.imports.times import Doubt, Telling, TimeSettings, Told, by_name, in_utc, told
from app.tables.imagery import CaptureTimeSource
from app.tables.imports import FileState

CLOCKS_AGREE = timedelta(seconds=3)
SHORTEST_GAP = timedelta(hours=1)
GAP_FACTOR = 20
Moment = tuple[datetime, CaptureTimeSource]
FUTURE = timedelta(minutes=10)
_NUMBERS = re.compile(r"(\d{1,18})")


class File(Protocol):
    """What a preview needs to know of a file."""

    id: int
    path: str
    state: FileState
    reason: str | None
    sha256: str | None
    media_type: str | None
    size_bytes: int
    received_bytes: int
    width_px: int | None
    height_px: int | None
    exif_at: str | None
    listed_at: str | None
    modified_at: datetime | None


class Span(Protocol):
    """A viewport and when it holds."""

    id: int
    name: str
    valid_from: datetime | None
    valid_until: datetime | None


class OddKind(StrEnum):
    """What may be odd; the first ones keep a file out."""

    REFUSED = "refused"
    WRONG_SIZE = "wrong_size"
    NO_TIME = "no_time"
    KNOWN = "known"
    REPEATED = "repeated"
    SKIPPED = "skipped"
    NO_VIEWPORT = "no_viewport"
    SAME_TIME = "same_time"
    REPEATED_HOUR = "repeated_hour"
    MISSING_HOUR = "missing_hour"
    FUTURE = "future"
    CLOCK_BACKWARDS = "clock_backwards"
    CLOCKS_DIFFER = "clocks_differ"
    GAP = "gap"


LEFT_OUT = frozenset(
    {
        OddKind.REFUSED,
        OddKind.WRONG_SIZE,
        OddKind.NO_TIME,
        OddKind.KNOWN,
        OddKind.REPEATED,
        OddKind.SKIPPED,
    }
)


@dataclass(slots=True)
class Odd:
    """One kind of oddity: the files it was found at, with what is to be said of each."""

    kind: OddKind
    found: list[tuple[str, str]] = field(default_factory=list)

    @property
    def count(self) -> int:
        """How often it was found."""
        return len(self.found)


@dataclass(frozen=True, slots=True)
class Ready:
    """A file that will become an image, with its moment and viewport."""

    file: File
    told: Told
    true_time: datetime
    """What was told, set right by the camera's clock."""
    viewport_id: int | None


@dataclass(slots=True)
class Preview:
    """What committing a batch would do."""

    ready: list[Ready] = field(default_factory=list)
    odd: dict[OddKind, Odd] = field(default_factory=dict)
    waiting_count: int = 0
    waiting_bytes: int = 0

    def note(self, kind: OddKind, path: str, detail: str) -> None:
        """Tell something odd of a file."""
        self.odd.setdefault(kind, Odd(kind)).found.append((path, detail))

    def count(self, *kinds: OddKind) -> int:
        """Count what is odd in some ways."""
        return sum(self.odd[kind].count for kind in kinds if kind in self.odd)

    @property
    def left_out_count(self) -> int:
        """How many files will not become images."""
        return self.count(*LEFT_OUT)

    @property
    def sources(self) -> dict[CaptureTimeSource, int]:
        """How many moments came from where."""
        return dict(Counter(item.told.source for item in self.ready))

    @property
    def per_viewport(self) -> dict[int | None, int]:
        """How many images fall to which viewport."""
        return dict(Counter(item.viewport_id for item in self.ready))


@dataclass(frozen=True, slots=True)
class Camera:
    """What a batch is judged by: the camera's size, viewports, present images and clock."""

    width_px: int
    height_px: int
    viewports: Sequence[Span]
    known: frozenset[str]
    set_right: Callable[[Sequence[Moment]], Sequence[datetime]]


def preview(
    files: Iterable[File], settings: TimeSettings, camera: Camera, now: datetime
) -> Preview:
    """Work out what a commit would do."""
    made = Preview()
    seen: dict[str, str] = {}
    timed: list[tuple[File, Told]] = []
    for file in sorted(files, key=lambda file: _in_order(file.path)):
        if file.state is not FileState.STAGED:
            _tell_other(made, file)
            continue
        found = _judged(made, file, settings, camera, seen)
        if found is not None:
            timed.append((file, found))
    moments = camera.set_right([(found.moment, found.source) for _, found in timed])
    for (file, found), true_time in zip(timed, moments, strict=True):
        _take(made, file, found, true_time, camera)
    _tell_clock_jumps(made)
    made.ready.sort(key=lambda item: (item.true_time, item.file.path))
    _tell_times(made, now)
    _tell_gaps(made)
    return made


def _tell_other(made: Preview, file: File) -> None:
    if file.state is FileState.WAITING:
        made.waiting_count += 1
        made.waiting_bytes += file.size_bytes - file.received_bytes
    elif file.state is FileState.REFUSED:
        made.note(OddKind.REFUSED, file.path, file.reason or "")
    elif file.state is FileState.SKIPPED:
        made.note(OddKind.SKIPPED, file.path, "hidden, or made by a system")
    elif file.state is FileState.KNOWN:
        made.note(OddKind.KNOWN, file.path, "the camera has this photograph already")


def _judged(
    made: Preview, file: File, settings: TimeSettings, camera: Camera, seen: dict[str, str]
) -> Told | None:
    """Return when a photograph was taken; None, with the reason noted, for one that is left out."""
    sha256 = file.sha256 or ""
    if sha256 in camera.known:
        made.note(OddKind.KNOWN, file.path, "the camera has this photograph already")
        return None
    if sha256 in seen:
        made.note(OddKind.REPEATED, file.path, f"the same bytes as {seen[sha256]}")
        return None
    seen[sha256] = file.path
    if (file.width_px, file.height_px) != (camera.width_px, camera.height_px):
        size = f"{file.width_px} x {file.height_px} px, the camera takes"
        made.note(OddKind.WRONG_SIZE, file.path, f"{size} {camera.width_px} x {camera.height_px}")
        return None
    telling = telling_of(file)
    found = told(telling, settings)
    if found is None:
        made.note(OddKind.NO_TIME, file.path, "nothing tells when it was taken")
    else:
        _tell_clocks_apart(made, telling, found, settings)
    return found


def _take(made: Preview, file: File, found: Told, true_time: datetime, camera: Camera) -> None:
    viewport = viewport_at(camera.viewports, true_time)
    if viewport is None and camera.viewports:
        made.note(OddKind.NO_VIEWPORT, file.path, f"no viewport is valid at {_shown(true_time)}")
    made.ready.append(Ready(file, found, true_time, viewport.id if viewport else None))


def telling_of(file: File) -> Telling:
    """Return the ways a file tells its moment."""
    return Telling(file.path, _parsed(file.exif_at), _parsed(file.listed_at), file.modified_at)


def viewport_at(viewports: Iterable[Span], moment: datetime) -> Span | None:
    """Return the viewport that was valid at a moment."""
    for viewport in viewports:
        is_begun = viewport.valid_from is None or viewport.valid_from <= moment
        if is_begun and (viewport.valid_until is None or viewport.valid_until > moment):
            return viewport
    return None


def _tell_clocks_apart(
    made: Preview, telling: Telling, found: Told, settings: TimeSettings
) -> None:
    """Tell where EXIF and the file's name disagree: one of the two has another zone or clock."""
    if found.source is not CaptureTimeSource.EXIF:
        return
    named = by_name(telling.path, settings)
    if named is None:
        return
    apart = in_utc(named, settings) - found.moment
    if abs(apart) > CLOCKS_AGREE:
        seconds = apart.total_seconds()
        made.note(OddKind.CLOCKS_DIFFER, telling.path, f"its name says {seconds:+,.0f} s to EXIF")


def _tell_clock_jumps(made: Preview) -> None:
    """Tell where files that differ in their numbers only, in that order, go back in time.

    Only names that count, not tell the time, can show it; two cameras' names in one folder count
    each for itself.
    """
    latest: dict[str, Ready] = {}
    for item in made.ready:
        if item.told.source is CaptureTimeSource.FILE_NAME:
            continue
        before = latest.get(series := _NUMBERS.sub("0", item.file.path))
        if before is not None and item.told.moment < before.told.moment:
            detail = f"{_shown(item.told.moment)}, after {_shown(before.told.moment)}"
            made.note(OddKind.CLOCK_BACKWARDS, item.file.path, detail)
        latest[series] = item


def _tell_times(made: Preview, now: datetime) -> None:
    for item in made.ready:
        if item.told.doubt is Doubt.REPEATED:
            detail = f"that hour came twice; taken as {_shown(item.true_time)}"
            made.note(OddKind.REPEATED_HOUR, item.file.path, detail)
        elif item.told.doubt is Doubt.MISSING:
            detail = f"that hour never was; taken as {_shown(item.true_time)}"
            made.note(OddKind.MISSING_HOUR, item.file.path, detail)
        if item.true_time > now + FUTURE:
            made.note(OddKind.FUTURE, item.file.path, f"{_shown(item.true_time)} is to come")
    for before, item in pairwise(made.ready):
        if before.true_time == item.true_time:
            detail = f"{_shown(item.true_time)}, as {before.file.path}"
            made.note(OddKind.SAME_TIME, item.file.path, detail)


def _tell_gaps(made: Preview) -> None:
    """Tell where far more time passes between two images than usual: nights, outages."""
    steps = [
        (later.true_time - earlier.true_time, earlier, later)
        for earlier, later in pairwise(made.ready)
    ]
    if not steps:
        return
    usual = timedelta(seconds=median(step.total_seconds() for step, _, _ in steps))
    longest = max(SHORTEST_GAP, GAP_FACTOR * usual)
    for step, earlier, later in steps:
        if step > longest:
            detail = f"{_hours(step)} without a photograph since {_shown(earlier.true_time)}"
            made.note(OddKind.GAP, later.file.path, detail)


def names_of(viewports: Iterable[Span]) -> Mapping[int, str]:
    """Return viewports' names by their ids."""
    return {viewport.id: viewport.name for viewport in viewports}


def _in_order(path: str) -> list[tuple[int, str]]:
    """Return a key by which IMG_9 comes before IMG_10."""
    return [
        (int(part), "") if part.isdecimal() else (-1, part) for part in _NUMBERS.split(path) if part
    ]


def _parsed(text: str | None) -> datetime | None:
    return None if text is None else datetime.fromisoformat(text)


def _shown(moment: datetime) -> str:
    return f"{moment:%Y-%m-%d %H:%M:%S} UTC"


def _hours(step: timedelta) -> str:
    hours = step.total_seconds() / 3600
    return f"{hours:.1f} h" if hours < 48 else f"{hours / 24:.1f} days"
