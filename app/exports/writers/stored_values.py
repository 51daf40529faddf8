"""Records of rows as the driver gives them: made by whichever process writes, not by who reads.

Moments are texts without a zone on SQLite, aware ones on Postgres. JSON columns come as texts.
"""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Any

import orjson

from app.exports.writers.records import Identities, ImageRecord, ReviewRecord

SUFFIXES = {"image/jpeg": ".jpg", "image/png": ".png", "image/webp": ".webp", "image/tiff": ".tif"}
_NO_FRACTION = ".000000"


def moment_text(stored: datetime | str) -> str:
    """Return a moment as a driver gives it, in UTC as ISO 8601 with Z; no fraction where it is 0.

    SQLite's is a text without a zone.
    """
    if isinstance(stored, str):
        return f"{stored[:10]}T{stored[11:].removesuffix(_NO_FRACTION)}Z"
    return f"{stored.astimezone(UTC).replace(tzinfo=None).isoformat()}Z"


def image_record(row: Sequence[Any], number: int, told: Identities) -> ImageRecord:
    """Return a photograph with its number, under the name it is told by."""
    image_id, file_name, sha256, width_px, height_px, captured_at, camera_id, media_type = row
    return ImageRecord(
        image_id,
        told.file_name(file_name, sha256),
        sha256,
        width_px,
        height_px,
        moment_text(captured_at),
        camera_id,
        SUFFIXES.get(media_type, ""),
        number,
    )


def review_records(rows: Iterable[Sequence[Any]]) -> dict[int, ReviewRecord]:
    """Return reviews by pose: the first of each, which is the one that counts."""
    found: dict[int, ReviewRecord] = {}
    none: list[str] = []
    for pose_id, grade, reasons, version, created_at in rows:
        if pose_id not in found:
            told = none if reasons == "[]" else orjson.loads(reasons)
            found[pose_id] = ReviewRecord(grade, told, version, moment_text(created_at))
    return found
