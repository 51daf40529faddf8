"""What a selection is and where it comes from: the manifest that goes with every export."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app import __version__
from app.domain.matching_table import LABELS, NOT_GIVEN, Result, RowName, matching_table
from app.evaluation.published import PAPER_ROWS
from app.exports import provenance_repository as repository
from app.exports.filters import ExportFilters, ExportOptions, Split
from app.exports.identities import REMAINS
from app.exports.reading import Reading
from app.exports.writers.records import Identities
from app.exports.writers.stored_values import moment_text
from app.tables.exports import Export
from app.tables.runs import Run

GRADES = ("good", "ok", "bad", "wrong")


def manifest_of(
    session: Session,
    export: Export,
    filters: ExportFilters,
    options: ExportOptions,
    runs: Sequence[Run],
    told: Mapping[int, Identities],
    reading: Reading,
    at_most: int | None = None,
) -> dict[str, Any]:
    """Return the manifest of an export or of one of its parts.

    `at_most` bounds how many verdicts are counted for the table of association.
    """
    chosen = reading.chosen
    grades = reading.grades
    if grades is None:
        grades = repository.grades(session, chosen.pose_ids, filters.verdict or "standing")
    ids = np.unique(chosen.run_ids).tolist()
    used = [run for run in runs if run.id in ids]
    return {
        "format": export.format,
        "filters": told_filters(export),
        "options": options.model_dump(mode="json", exclude={"split"}),
        "anonymised": export.anonymise,
        "remains": REMAINS if export.anonymise else None,
        "part": reading.only,
        "split": None if options.split is None else _split(options.split, reading),
        "counts": {
            "poses": len(reading),
            "images": len(np.unique(chosen.image_ids)),
            "vessels": len(np.unique(chosen.mmsis)),
            "grades": {
                **{grade: grades.get(grade, 0) for grade in GRADES},
                "ungraded": grades.get(None, 0),
            },
        },
        "runs": [_run(run) for run in used],
        "registrations": [_registration(row) for row in _registrations(used)],
        "ais_files": _recordings(session, used, chosen.image_ids.tolist(), told),
        "matching": _association(session, [run.id for run in used], at_most),
        "code_version": __version__,
    }


def told_filters(export: Export) -> dict[str, Any]:
    """Return the filters in order; without identities no MMSI is among them."""
    filters = dict(sorted(export.filters.items()))
    if export.anonymise and isinstance(filters.get("mmsi"), int):
        filters["mmsi"] = "one vessel"
    return filters


def _split(split: Split, reading: Reading) -> dict[str, Any]:
    parts = {name: len(reading.part(name)) for name in reading.parts}
    if reading.only is not None:
        parts = {reading.only: len(reading)}
    return {**split.model_dump(mode="json"), "poses": parts}


def _run(run: Run) -> dict[str, Any]:
    return {
        "id": run.id,
        "site_id": run.site_id,
        "viewport_id": run.viewport_id,
        "preset": run.preset,
        "parameters": dict(sorted(run.parameters.items())),
        "detector": run.model.name,
        "detector_sha256": run.model.sha256,
        "registration_id": run.registration_id,
        "code_version": run.code_version,
    }


def _association(
    session: Session, run_ids: Sequence[int], at_most: int | None
) -> dict[str, Any] | None:
    """Fill the paper's table of association results from the runs' complete photographs."""
    if not run_ids:
        return None
    counts: Counter[RowName] = Counter()
    for (grade, reasons), count in repository.complete_verdicts(session, run_ids, at_most).items():
        name = RowName(Result.CORRECT, grade)
        if grade == "wrong":
            reason = reasons[0] if reasons else NOT_GIVEN
            name = RowName(Result.WRONG, reason)
        counts[name if name in LABELS else RowName(Result.WRONG, "other")] += count
    for reason, count in repository.missed(session, run_ids).items():
        counts[RowName(Result.NO_MATCH, reason)] += count
    table = matching_table(counts)
    return {
        "complete_images": repository.complete_images(session, run_ids),
        "visible": table.visible,
        "rows": [
            {
                "result": row.name.result.value,
                "reason": row.name.reason,
                "label": row.label,
                "count": row.count,
                "percent_of_visible": row.percent_of_visible,
                "paper_percent": paper.percent_of_visible
                if (paper := PAPER_ROWS.get(row.name))
                else None,
            }
            for row in table.rows
        ],
    }


def _registrations(runs: Sequence[Run]) -> list[Any]:
    found = {run.registration_id: run.registration for run in runs}
    return [found[registration_id] for registration_id in sorted(found)]


def _registration(row: Any) -> dict[str, Any]:  # noqa: ANN401  a registration
    names = ("rotation", "center_lat_deg", "center_lon_deg", "center_height_m", "intrinsics")
    errors = ("mae_px", "mae_pct_width", "mae_pct_height", "leave_one_out_px")
    return {
        "id": row.id,
        "viewport_id": row.viewport_id,
        "method": row.method.value,
        **{name: getattr(row, name) for name in (*names, *errors)},
    }


def _recordings(
    session: Session,
    runs: Sequence[Run],
    image_ids: Sequence[int],
    told: Mapping[int, Identities],
) -> list[dict[str, Any]]:
    site_ids = sorted({run.site_id for run in runs})
    if not site_ids:
        return []
    first, last = repository.times(session, image_ids)
    return [
        {
            "id": row.id,
            "file_name": told[site_ids[0]].file_name(row.file_name, row.sha256),
            "sha256": row.sha256,
            "format": row.format,
            "first_at": row.first_at and moment_text(row.first_at),
            "last_at": row.last_at and moment_text(row.last_at),
        }
        for row in repository.recordings(session, site_ids, first, last)
    ]
