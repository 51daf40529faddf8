"""NDJSON: one pose a line, and a last line that says the file is complete.

A reader that does not find `{"complete": true, ...}` at the end holds a torn file.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict

from app.exports.writers.records import ImageRecord, PoseRecord, Selection


def write(
    images: Sequence[ImageRecord], poses: Iterable[PoseRecord], selection: Selection
) -> Iterator[bytes]:
    """Give the file in chunks, one line a pose; memory stays small."""
    count = 0
    for pose in poses:
        count += 1
        yield _line({"type": "pose", **asdict(pose)})
    yield _line(
        {
            "type": "end",
            "complete": True,
            "poses": count,
            "images": len(images),
            "filters": dict(selection.filters),
            "anonymised": selection.anonymised,
            "remains": selection.remains,
            "runs": [dict(run) for run in selection.runs],
            "code_version": selection.code_version,
        }
    )


def _line(value: object) -> bytes:
    # ASCII only: some readers also end a line at the separators U+0085, U+2028 and U+2029.
    text = json.dumps(value, separators=(",", ":"), allow_nan=False, default=_moment)
    return text.encode() + b"\n"


def _moment(value: object) -> str:
    return str(getattr(value, "isoformat")()).replace("+00:00", "Z")  # noqa: B009  datetime only
