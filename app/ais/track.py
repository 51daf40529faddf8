"""A vessel's track in pieces: one line as long as it was heard, broken where it was not.

A line drawn over a silence of an hour would claim a course that nobody saw.
"""

from collections.abc import Iterable
from datetime import timedelta

from app.tables.ais import AisPosition

LONGEST_SILENCE = timedelta(minutes=10)


def segments(positions: Iterable[AisPosition]) -> list[list[AisPosition]]:
    """Split a vessel's positions, oldest first, at silences of more than ten minutes.

    A fix that a second recording repeated for another site appears once.
    """
    pieces: list[list[AisPosition]] = []
    last: AisPosition | None = None
    for position in positions:
        if last is None or position.fix_time - last.fix_time > LONGEST_SILENCE:
            pieces.append([position])
        elif _fix(position) != _fix(last):
            pieces[-1].append(position)
        last = position
    return pieces


def _fix(position: AisPosition) -> tuple[object, ...]:
    return (position.fix_time, position.lat_deg, position.lon_deg)
