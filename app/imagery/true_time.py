"""True moments from what a camera's clock said, and the offset that counts then.

A person's word (a given time, a table) is no clock and is left alone, unless an offset says that
it concerns such times too: what a script gives is often a clock's word as well. Of the offsets that
cover a moment by the camera's clock, and were not undone, the newest counts.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.imagery import repository
from app.tables.clock import ClockOffset
from app.tables.imagery import CaptureTimeSource

CLOCK_SOURCES = (
    CaptureTimeSource.EXIF,
    CaptureTimeSource.FILE_NAME,
    CaptureTimeSource.FILE_TIME,
)
Moment = tuple[datetime, CaptureTimeSource]


def corrected_times(session: Session, camera_id: int, moments: Sequence[Moment]) -> list[datetime]:
    """Return the true moments of what a camera's clock told, with the source of each."""
    in_force = repository.offsets_in_force(session, camera_id)
    return [_corrected(in_force, raw, source) for raw, source in moments]


def _corrected(
    in_force: Sequence[ClockOffset], raw: datetime, source: CaptureTimeSource
) -> datetime:
    for row in in_force:
        if source not in CLOCK_SOURCES and not row.concerns_given:
            continue
        begins = row.valid_from is None or row.valid_from <= raw
        if begins and (row.valid_until is None or raw < row.valid_until):
            return raw + timedelta(seconds=row.offset_s)
    return raw
