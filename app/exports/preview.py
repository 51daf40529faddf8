"""What an export would hold, told before it is made: counts, first poses, about how large.

The size is judged by writing a few poses as the export would: two lengths tell what the file costs
whatever is in it, and what each pose adds. Of a selection of millions only the first poses are
looked at, so that nobody waits for a page.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from app.exports import provenance_repository
from app.exports.filters import ExportOptions
from app.exports.formats import written
from app.exports.making import open_reading
from app.exports.provenance import GRADES
from app.exports.reading import Reading
from app.exports.service import Request
from app.exports.writers import table_csv

SHOWN = 8
LOOKED_AT = 50_000  # poses: what a page may take about a second for
FEW, MORE = 40, 160


@dataclass(frozen=True, slots=True)
class Preview:
    """What a selection holds: counts, its first poses as rows of text, the size in bytes.

    All of it is of the first poses where there is more.
    """

    poses: int
    images: int
    vessels: int
    grades: Mapping[str, int]
    rows: Sequence[Mapping[str, str]]
    size_bytes: int
    is_exact: bool
    """Whether all of it was written to know the size."""
    is_more: bool
    """Whether there are more poses than were looked at."""


def look(session: Session, asked: Request) -> Preview:
    """Return what an export would hold at this moment."""
    plain = asked.options.model_copy(update={"images": False})
    reading = open_reading(session, asked.row(), plain, at_most=LOOKED_AT + 1)
    is_more = len(reading) > LOOKED_AT
    if is_more:
        reading = reading.first(LOOKED_AT)
    chosen = reading.chosen
    verdict = asked.filters.verdict or "standing"
    grades = provenance_repository.grades(session, chosen.pose_ids, verdict)
    images = np.unique(chosen.image_ids).tolist()
    size_bytes = _size(asked.format_name, plain, reading)
    if asked.options.images:
        size_bytes += provenance_repository.bytes_of_images(session, images)
    return Preview(
        poses=len(reading),
        images=len(images),
        vessels=len(np.unique(chosen.mmsis)),
        grades={
            **{grade: grades.get(grade, 0) for grade in GRADES},
            "ungraded": grades.get(None, 0),
        },
        rows=_rows(reading.first(SHOWN)),
        size_bytes=size_bytes,
        is_exact=len(reading) <= MORE,
        is_more=is_more,
    )


def _rows(reading: Reading) -> list[Mapping[str, str]]:
    text = b"".join(table_csv.write(reading)).decode()
    return list(csv.DictReader(io.StringIO(text)))


def _size(format_name: str, options: ExportOptions, reading: Reading) -> int:
    more = _written(format_name, options, reading.first(MORE))
    if len(reading) <= MORE:
        return more
    few = _written(format_name, options, reading.first(FEW))
    return more + round((more - few) / (MORE - FEW) * (len(reading) - MORE))


def _written(format_name: str, options: ExportOptions, reading: Reading) -> int:
    return sum(map(len, written(format_name, options, reading)))
