"""When a photograph was taken: as given, else by its EXIF, else by its file's name.

The moment decides which vessels are looked for, so a guess is worse than a question: a photograph
that does not tell is refused with the ways to say it.
"""

from datetime import datetime

from app.errors import Invalid
from app.sites.fields import in_zone
from app.sites.name_pattern import from_file_name
from app.tables.imagery import CaptureTimeSource


def captured_at(
    *,
    given: datetime | None,
    exif: datetime | None,
    file_name: str,
    pattern: str | None,
    timezone: str,
) -> tuple[datetime, CaptureTimeSource]:
    """Return the moment in UTC and where it came from; naive moments are in `timezone`.

    Raises Invalid naming captured_at when nothing tells, or when the moment is absurd.
    """
    if given is not None:
        return in_zone(given, timezone, "captured_at"), CaptureTimeSource.GIVEN
    by_exif = told_by_a_set_clock(exif)
    if by_exif is not None:
        return in_zone(by_exif, timezone, "captured_at"), CaptureTimeSource.EXIF
    by_name = told_by_a_set_clock(from_file_name(file_name, pattern))
    if by_name is not None:
        return in_zone(by_name, timezone, "captured_at"), CaptureTimeSource.FILE_NAME
    raise Invalid.field(
        "captured_at",
        "neither EXIF nor the file's name tells when the picture was taken; give the camera a "
        "file name pattern such as cam_%Y%m%d_%H%M%S (Edit), take times from a table or the "
        "files' dates (Import folders and zips), or send captured_at (ISO 8601, such as "
        "2026-11-22T10:00:05Z)",
    )


def told_by_a_set_clock(moment: datetime | None) -> datetime | None:
    """Return what a clock told; one that was never set tells 1970 or 1980: as good as nothing."""
    return moment if moment is not None and moment.year > 1990 else None
