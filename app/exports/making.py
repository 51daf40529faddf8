"""Making an export's bytes: what its filters select, of one moment, through its format's writer.

The same data and filters give the same bytes, whatever the database and however often it is begun
anew: nothing of the present moment is written, and all lists are in order of ids.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import IO
from zoneinfo import ZoneInfo

import numpy as np
from sqlalchemy.orm import Session

from app.db import Database
from app.exports import record_repository, repository
from app.exports.filters import ExportFilters, ExportOptions, Split
from app.exports.formats import written
from app.exports.identities import Hidden, Shown
from app.exports.provenance import manifest_of
from app.exports.reading import Context, Photograph, Reading
from app.exports.selection_repository import Chosen, PoseSelection
from app.exports.splits import PARTS, Afloat, Convoys, drawn_part
from app.exports.writers.records import Identities, ImageRecord, ViewRecord
from app.identities import service as identities
from app.registration import service as registration
from app.storage import CHUNK_BYTES, Storage
from app.tables.exports import Export
from app.tables.runs import Run

PartOf = Callable[[int, int], str]
Advanced = Callable[[int, int], None]


def ignore(done: int, total: int) -> None:
    """Tell nobody how far an export is."""


@dataclass(frozen=True, slots=True)
class Written:
    """How many poses were written, and the manifest that tells of them."""

    count: int
    manifest: Mapping[str, object]


def write_export(
    database: Database,
    export: Export,
    target: IO[bytes],
    storage: Storage | None = None,
    advanced: Advanced = ignore,
) -> Written:
    """Write an export's bytes, all of one moment.

    `advanced(done, total)` is called now and then, and may raise to stop. Photographs need the
    store.
    """
    options = ExportOptions.model_validate(export.options or {})
    with database.reading() as session:
        repository.hold_still(session)
        reading = open_reading(session, export, options, storage, advanced)
        for chunk in written(export.format, options, reading):
            target.write(chunk)
        return Written(len(reading), reading.manifest())


def open_reading(
    session: Session,
    export: Export,
    options: ExportOptions,
    storage: Storage | None = None,
    advanced: Advanced = ignore,
    at_most: int | None = None,
) -> Reading:
    """Return an export's poses, to be read in the session's transaction.

    With `at_most` the first of them, with the work bounded by that.
    """
    filters = ExportFilters.model_validate(export.filters)
    _, mmsi = identities.searched(session, filters.mmsi)
    selection = PoseSelection(filters, export.site_ids, mmsi)
    chosen = selection.chosen(session, at_most)
    runs = repository.runs(session, np.unique(chosen.run_ids).tolist())
    corrected = filters.poses == "corrected"
    told = _identities(session, export, runs, corrected=corrected)
    total = len(chosen.pose_ids)
    context = Context(
        session=session,
        views=_views(session, runs),
        identities=told,
        verdict=filters.verdict or "standing",
        corrected=corrected,
        part_of=_part_of(session, options.split, runs, chosen),
        photograph=_photographs(storage) if options.images and storage else None,
        gone=lambda: selection.gone(session, chosen),
        manifest=lambda reading: manifest_of(
            session, export, filters, options, runs, told, reading, at_most
        ),
        advanced=lambda done: advanced(done, total),
    )
    return Reading(context, chosen, PARTS if options.split else ())


def _views(session: Session, runs: Sequence[Run]) -> dict[int, ViewRecord]:
    """Return the cameras of runs; those with the same registration are one object."""
    by_registration: dict[int, ViewRecord] = {}
    for run in runs:
        if run.registration_id not in by_registration:
            by_registration[run.registration_id] = _view(session, run)
    return {run.id: by_registration[run.registration_id] for run in runs}


def _view(session: Session, run: Run) -> ViewRecord:
    camera, frame = registration.camera_of(session, run.registration_id)
    R_ecef_from_enu = frame.R_enu_from_ecef.T  # noqa: N806  the field's symbol
    intrinsics, place = camera.intrinsics, run.viewport.camera
    return ViewRecord(
        registration_id=run.registration_id,
        viewport_id=run.viewport_id,
        camera_id=place.id,
        site_id=run.site_id,
        width_px=intrinsics.width_px,
        height_px=intrinsics.height_px,
        K=intrinsics.K.tolist(),
        distortion=intrinsics.distortion.tolist(),
        R_cam_from_ecef=(camera.R_cam_from_world @ frame.R_enu_from_ecef).tolist(),
        center_ecef_m=(R_ecef_from_enu @ camera.center_in_world + frame.origin_in_ecef).tolist(),
        water_level_m=place.site.water_level_m,
    )


def _identities(
    session: Session, export: Export, runs: Sequence[Run], *, corrected: bool
) -> Mapping[int, Identities]:
    """Return by site how its vessels are told.

    No file's name tells a vessel that has a pose, selected or not: a pull of what changed says the
    same of a photograph as a whole export.
    """
    site_ids = {run.site_id for run in runs}
    if not export.anonymise:
        names = _published_names(session) if export.format == "bonk" else {}
        return dict.fromkeys(site_ids, Shown(names))
    if not site_ids:
        return {}
    mmsis = set(record_repository.posed(session))
    if corrected:
        mmsis.update(record_repository.rematched(session))
    vessels = list(record_repository.vessel_names(session, sorted(mmsis)))
    keys = identities.keys(session, site_ids)
    return {site_id: Hidden(key, vessels) for site_id, key in keys.items()}


def _published_names(session: Session) -> Mapping[int, str]:
    """Return the identifiers of vessels that came from published labels, by their numbers here."""
    return {mmsi: name for mmsi, name in record_repository.stand_ins(session) if name}


def _photographs(storage: Storage) -> Photograph:
    def photograph(image: ImageRecord) -> Iterator[bytes]:
        with storage.open(image.sha256) as stream:
            while chunk := stream.read(CHUNK_BYTES):
                yield chunk

    return photograph


def _part_of(
    session: Session, split: Split | None, runs: Sequence[Run], chosen: Chosen
) -> PartOf | None:
    """Return what tells the part of a pose by its photograph and vessel."""
    if split is None:
        return None
    fractions = (split.train, split.val, split.test)
    if split.by == "vessel":
        parts = _convoys(session, chosen).parts(split.seed, fractions)
        return lambda _, mmsi: parts[mmsi]
    zones = {run.id: ZoneInfo(run.viewport.camera.site.timezone) for run in runs}
    zone_of = dict(zip(chosen.image_ids.tolist(), chosen.run_ids.tolist(), strict=True))
    days: dict[str, str] = {}
    part_of_image: dict[int, str] = {}
    for image_id, captured_at in repository.capture_times(session, sorted(zone_of)):
        day = captured_at.astimezone(zones[zone_of[image_id]]).date().isoformat()
        if day not in days:
            days[day] = drawn_part(f"day {day}", split.seed, fractions)
        part_of_image[image_id] = days[day]
    return lambda image_id, _: part_of_image[image_id]


def _convoys(session: Session, chosen: Chosen) -> Convoys:
    convoys = Convoys()
    photograph, afloat = None, list[Afloat]()
    for image_id, vessel in repository.afloat(session, chosen):
        if image_id != photograph:
            convoys.add_photograph(afloat)
            photograph, afloat = image_id, []
        afloat.append(Afloat(*vessel))
    convoys.add_photograph(afloat)
    return convoys
