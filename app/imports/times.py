"""When the photographs of a batch were taken, by the rule that somebody chose for the batch.

A file may tell its moment several ways: EXIF, its name, a table of times, the time it was written.
The rule says which counts, in which zone the camera's clock stood, and whether that clock follows
summer time. A clock that does shows one hour of autumn twice and one of spring never; such moments
are taken, and told, because only a person knows what the clock did.
"""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo

from pydantic import Field

from app.imagery.captured import told_by_a_set_clock
from app.imports.rules import TimeRule
from app.sites.fields import EARLIEST, LATEST, Pattern, Request, Timezone
from app.sites.name_pattern import from_file_name, told_by
from app.tables.imagery import CaptureTimeSource

MOST_PATTERNS = 8


class RepeatedHour(StrEnum):
    """Which pass of autumn's repeated hour is meant."""

    EARLIER = "earlier"
    LATER = "later"


class TimeSettings(Request):
    """How a batch's files tell when they were taken."""

    rule: TimeRule = Field(TimeRule.AUTO, description="auto: EXIF, else the file's name")
    patterns: list[Pattern] = Field(
        default_factory=list,
        max_length=MOST_PATTERNS,
        description="Of file names, tried in order; none: the usual ones",
        examples=[["cam_%Y%m%d_%H%M%S"]],
    )
    timezone: Timezone = Field("UTC", description="Of moments that tell no zone themselves")
    follows_summer_time: bool = Field(
        default=True, description="Whether the camera's clock is moved in spring and autumn"
    )
    repeated_hour: RepeatedHour = RepeatedHour.EARLIER


class Doubt(StrEnum):
    """What is uncertain about a moment that was told without a zone."""

    REPEATED = "repeated_hour"
    MISSING = "missing_hour"


@dataclass(frozen=True, slots=True)
class Telling:
    """All ways a file may tell its moment; naive where no zone was told."""

    path: str
    exif_at: datetime | None = None
    listed_at: datetime | None = None
    modified_at: datetime | None = None


@dataclass(frozen=True, slots=True)
class Told:
    """A moment in UTC as its source told it, the source, and what is doubtful about it."""

    moment: datetime
    source: CaptureTimeSource
    doubt: Doubt | None = None


def told(telling: Telling, settings: TimeSettings) -> Told | None:
    """Return when a photograph was taken by a batch's rule, or None where it does not tell."""
    for source in _sources(settings.rule):
        moment = _read(telling, settings, source)
        if moment is not None:
            utc, doubt = _in_utc(moment, settings)
            return Told(utc, source, doubt) if EARLIEST <= utc < LATEST else None
    return None


def by_name(path: str, settings: TimeSettings) -> datetime | None:
    """Return the moment that a file's name tells by the batch's patterns, naive or not."""
    name = path.rpartition("/")[2]
    if not settings.patterns:
        return from_file_name(name, None)
    for pattern in settings.patterns:
        moment = told_by(path if "/" in pattern else name, pattern)
        if moment is not None:
            return moment
    return None


def in_utc(moment: datetime, settings: TimeSettings) -> datetime:
    """Return a moment in UTC; one without a zone is in the batch's."""
    return _in_utc(moment, settings)[0]


def _sources(rule: TimeRule) -> tuple[CaptureTimeSource, ...]:
    if rule is TimeRule.AUTO:
        return CaptureTimeSource.EXIF, CaptureTimeSource.FILE_NAME
    return (CaptureTimeSource(rule.value),)


def _read(telling: Telling, settings: TimeSettings, source: CaptureTimeSource) -> datetime | None:
    match source:
        case CaptureTimeSource.EXIF:
            return told_by_a_set_clock(telling.exif_at)
        case CaptureTimeSource.FILE_NAME:
            return told_by_a_set_clock(by_name(telling.path, settings))
        case CaptureTimeSource.CSV:
            return telling.listed_at
        case CaptureTimeSource.FILE_TIME:
            return telling.modified_at
    return None


def _in_utc(moment: datetime, settings: TimeSettings) -> tuple[datetime, Doubt | None]:
    if moment.tzinfo is not None:
        return _converted(moment), None
    zone = ZoneInfo(settings.timezone)
    if not settings.follows_summer_time:
        return (moment - _standard(zone, moment.year)).replace(tzinfo=UTC), None
    first = moment.replace(tzinfo=zone)
    second = first.replace(fold=1)
    before, after = first.utcoffset(), second.utcoffset()
    if before == after or before is None or after is None:
        return _converted(first), None
    # The clock went back where the offset shrinks from the first pass to the second.
    if after < before:
        is_later = settings.repeated_hour is RepeatedHour.LATER
        return _converted(second if is_later else first), Doubt.REPEATED
    return _converted(first), Doubt.MISSING


def _standard(zone: ZoneInfo, year: int) -> timedelta:
    """Return a zone's offset without summer time: the lesser one of its year.

    Not what the zone calls standard: Ireland's law calls the winter's time the exception.
    """
    halves = (datetime(year, month, 1, tzinfo=zone).utcoffset() for month in (1, 7))
    return min(offset or timedelta() for offset in halves)


def _converted(moment: datetime) -> datetime:
    try:
        return moment.astimezone(UTC)
    except OverflowError:
        return datetime.min.replace(tzinfo=UTC)
