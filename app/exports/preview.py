"""What an export would hold, told before it is made: counts, first poses, about how large.

The size is judged by writing a few poses as the export would: two lengths tell what the file costs
whatever is in it, and what each pose adds.
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
FEW, MORE = 40, 160


@dataclass(frozen=True, slots=True)
class Preview:
    """What a selection holds: counts, its first poses as rows of text, the size in bytes."""

    poses: int
    images: int
    vessels: int
    grades: Mapping[str, int]
    rows: Sequence[Mapping[str, str]]
    size_bytes: int
    is_exact: bool
    """Whether all of it was written to know the size."""


def look(session: Session, asked: Request) -> Preview:
    """Return what an export would hold at this moment."""
    plain = asked.options.model_copy(update={"images": False})
    reading = open_reading(session, asked.row(), plain)
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
