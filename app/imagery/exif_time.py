"""When a photograph was taken, by its EXIF.

The moment taken counts, else the moment digitised; a few cameras know the moment of the file only.
Its zone is told by an offset beside it. Where none is, the satellites' time may tell it: EXIF has
that in UTC, and a clock that shows it a whole zone later or earlier stands in that zone. A fix that
is older than the photograph tells nothing, because no zone would be right to the half minute.

Cameras leave rubbish in these tags: zeros, blanks, other separators, offsets that are none.

Source: Exif 2.32, 4.6.5 and 4.6.6.
"""

import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from typing import Any

from PIL import ExifTags, Image

from app.imagery.damage import DAMAGED

_MOMENT = re.compile(
    r"(\d{4})[:/.-](\d\d)[:/.-](\d\d)[ T](\d\d):(\d\d):(\d\d)"
    r"(?:[.,](\d{1,6})\d*)?(Z|[+-]\d\d:?\d\d)?"
)
_DAY = re.compile(r"(\d{4})[:/.-](\d\d)[:/.-](\d\d)")
_OFFSET = re.compile(r"([+-])(\d\d):?([0-5]\d)")
_FARTHEST = timedelta(hours=14)
_AGREES = timedelta(seconds=30)
_QUARTER = timedelta(minutes=15)
_tag, _gps = ExifTags.Base, ExifTags.GPS
_TOLD_BY = (
    (_tag.DateTimeOriginal, _tag.SubsecTimeOriginal, _tag.OffsetTimeOriginal),
    (_tag.DateTimeDigitized, _tag.SubsecTimeDigitized, _tag.OffsetTimeDigitized),
    (_tag.DateTime, _tag.SubsecTime, _tag.OffsetTime),
)


def taken(picture: Image.Image) -> datetime | None:
    """Return the moment taken, naive where no zone is told; None for EXIF that says nothing."""
    try:
        exif = picture.getexif()
        details = {**exif, **exif.get_ifd(ExifTags.IFD.Exif)}
    except DAMAGED:
        return None
    try:
        by_satellite = _satellites_time(exif.get_ifd(ExifTags.IFD.GPSInfo))
    except DAMAGED:
        by_satellite = None
    for moment, fraction, offset in _TOLD_BY:
        found = _moment(details.get(moment), details.get(fraction))
        if found is None:
            continue
        if found.tzinfo is not None:
            return found
        zone = _zone(details.get(offset)) or _zone(details.get(_tag.OffsetTime))
        return found.replace(tzinfo=zone or _zone_between(found, by_satellite))
    return by_satellite


def _moment(taken_at: object, fraction: object) -> datetime | None:
    match = _MOMENT.fullmatch(_text(taken_at))
    if match is None:
        return None
    digits = match[7] or _text(fraction)
    digits = digits[:6] if digits.isascii() and digits.isdigit() else "0"
    year, month, day, hour, minute, second = (int(match[part]) for part in range(1, 7))
    try:
        return datetime(
            *(year, month, day, hour, minute, second, int(digits.ljust(6, "0"))),
            tzinfo=_zone(match[8]),
        )
    except ValueError:
        return None


def _zone(offset: object) -> tzinfo | None:
    text = _text(offset)
    if text in {"Z", "UTC"}:
        return UTC
    match = _OFFSET.fullmatch(text)
    if match is None:
        return None
    span = timedelta(hours=int(match[2]), minutes=int(match[3]))
    return timezone(-span if match[1] == "-" else span) if span <= _FARTHEST else None


def _satellites_time(told: Mapping[int, Any]) -> datetime | None:
    """Return what the satellites said, UTC."""
    day = _DAY.fullmatch(_text(told.get(_gps.GPSDateStamp)))
    clock = told.get(_gps.GPSTimeStamp)
    if day is None or clock is None:
        return None
    hour, minute, second = (float(part) for part in clock)
    midnight = datetime(int(day[1]), int(day[2]), int(day[3]), tzinfo=UTC)
    moment = midnight + timedelta(hours=hour, minutes=minute, seconds=second)
    return moment if moment - midnight < timedelta(days=1) else None


def _zone_between(shown: datetime, utc: datetime | None) -> tzinfo | None:
    """Return the zone in which a clock stands that shows a moment of UTC as it does."""
    if utc is None:
        return None
    apart = shown.replace(tzinfo=UTC) - utc
    offset = round(apart / _QUARTER) * _QUARTER
    agrees = abs(apart - offset) <= _AGREES and abs(offset) <= _FARTHEST
    return timezone(offset) if agrees else None


def _text(value: object) -> str:
    return str(value).strip("\0 ")
