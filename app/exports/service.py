"""Asking for exports, and making them.

An export runs as a job, because a data set of years takes longer than a request may. What it reads
is fixed by its filters; the same data and filters give the same bytes.
"""

import tempfile
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import IO

import cv2
import numpy as np
from sqlalchemy.orm import Session

from app import __version__
from app.db import Database, now
from app.errors import Invalid, NotFound, looked_up_by
from app.exports import repository
from app.exports.filters import ExportFilters
from app.exports.identities import REMAINS, Hidden, Identities, Shown
from app.exports.writers import coco, ndjson
from app.exports.writers.records import ImageRecord, PoseRecord, ReviewRecord, Selection
from app.identities import service as identities
from app.jobs import JobClient, JobQueue
from app.paging import Paging
from app.runs import service as runs
from app.sites import service as sites
from app.storage import Storage, Stored
from app.tables.exports import Export, ExportStatus
from app.tables.imagery import Image
from app.tables.reviews import Correction, Review
from app.tables.runs import Pose, Run

EXPORT_JOB = "export"
Writer = Callable[[Sequence[ImageRecord], Iterable[PoseRecord], Selection], Iterator[bytes]]
WRITERS: dict[str, tuple[Writer, str, str]] = {
    "coco": (coco.write, "application/json", "json"),
    "ndjson": (ndjson.write, "application/x-ndjson", "ndjson"),
}
IN_MEMORY_BYTES = 8 << 20


def request_export(
    session: Session,
    jobs: JobClient,
    *,
    format_name: str,
    filters: ExportFilters,
    site_ids: frozenset[int] | None,
    anonymise: bool,
    user_id: int | None,
) -> Export:
    """Store a request and put its job into the queue. Raises Invalid naming `format`."""
    if format_name not in WRITERS:
        raise Invalid.field("format", f"must be one of {', '.join(WRITERS)}")
    export = Export(
        format=format_name,
        filters=filters.model_dump(mode="json", exclude_none=True),
        site_ids=None if site_ids is None else sorted(site_ids),
        anonymise=anonymise,
        workflow_id=f"export-{uuid.uuid4()}",
        created_by_id=user_id,
    )
    session.add(export)
    session.flush()
    jobs.enqueue(session, EXPORT_JOB, export.id, queue=JobQueue.SHORT, job_id=export.workflow_id)
    return export


def get_export(session: Session, export_id: int) -> Export:
    """Return an export. Raises NotFound."""
    export = repository.get(session, export_id)
    if export is None:
        raise NotFound("there is no such export")
    return export


def list_exports(
    session: Session, user_id: int | None, paging: Paging
) -> tuple[Sequence[Export], str | None]:
    """Return a page of a person's exports (None: everybody's)."""
    return repository.listed(session, user_id, paging)


def newest_exports(session: Session, user_id: int | None, limit: int = 50) -> Sequence[Export]:
    """Return the newest exports of a person (None: of everybody)."""
    return repository.newest(session, user_id, limit)


def sites_of(session: Session, filters: ExportFilters) -> Iterator[tuple[str, int]]:
    """Give (filter, site id) of each thing an export shall be of.

    Raises NotFound naming the filter that leads to nothing.
    """
    if filters.site_id is not None:
        with looked_up_by("filters.site_id"):
            yield "filters.site_id", sites.get_site(session, filters.site_id).id
    if filters.camera_id is not None:
        with looked_up_by("filters.camera_id"):
            yield "filters.camera_id", sites.get_camera(session, filters.camera_id).site_id
    if filters.run_id is not None:
        with looked_up_by("filters.run_id"):
            yield "filters.run_id", runs.get_run(session, filters.run_id).site_id


def begin(session: Session, export_id: int) -> None:
    """Say that an export is being written."""
    repository.set_status(session, export_id, ExportStatus.RUNNING)


def make_file(database: Database, storage: Storage, export_id: int) -> tuple[Stored, int]:
    """Write an export's file into the store; returns its address and how many poses it has."""
    with database.reading() as session:
        export = get_export(session, export_id)
    with tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES) as draft:
        count = write_export(database, export, draft)
        draft.seek(0)
        return storage.put_stream(draft), count


def write_export(database: Database, export: Export, target: IO[bytes]) -> int:
    """Write an export's bytes, all of one moment; returns how many poses they hold."""
    filters = ExportFilters.model_validate(export.filters)
    poses = repository.PoseSelection(
        site_ids=export.site_ids,
        run_id=filters.run_id,
        site_id=filters.site_id,
        camera_id=filters.camera_id,
        grades=filters.grade,
        corrected=filters.poses == "corrected",
    )
    with database.reading() as session:
        repository.hold_still(session)
        chosen_runs = poses.runs(session)
        selection = Selection(
            filters=dict(sorted(export.filters.items())),
            anonymised=export.anonymise,
            remains=REMAINS if export.anonymise else None,
            runs=[_run(run) for run in chosen_runs],
            code_version=__version__,
            pose_count=poses.count(session),
        )
        told = _identities(session, export, chosen_runs, poses)
        images = {image.id: _image(image, told[image.site_id]) for image in poses.images(session)}
        registrations = {run.id: run.registration_id for run in chosen_runs}
        told_of = {run.id: told[run.site_id] for run in chosen_runs}
        records = (
            _pose(
                pose,
                review,
                correction,
                images[pose.image_id],
                registrations,
                told_of[pose.run_id],
            )
            for pose, review, correction in poses.poses(session)
        )
        for chunk in WRITERS[export.format][0](list(images.values()), records, selection):
            target.write(chunk)
    return selection.pose_count


def _identities(
    session: Session, export: Export, chosen_runs: Sequence[Run], poses: repository.PoseSelection
) -> Mapping[int, Identities]:
    """Return by site how its vessels are told."""
    site_ids = {run.site_id for run in chosen_runs}
    if not export.anonymise:
        return dict.fromkeys(site_ids, Shown())
    vessels = poses.vessels(session)
    keys = identities.keys(session, site_ids)
    return {site_id: Hidden(key, vessels) for site_id, key in keys.items()}


def finish(session: Session, export_id: int, stored: Stored, count: int) -> None:
    """Say that an export's file is in the store."""
    repository.set_status(
        session,
        export_id,
        ExportStatus.SUCCEEDED,
        sha256=stored.sha256,
        size_bytes=stored.size_bytes,
        item_count=count,
        finished_at=now(),
    )


def fail(session: Session, export_id: int, reason: str) -> None:
    """Say that an export failed, and why."""
    repository.set_status(session, export_id, ExportStatus.FAILED, error=reason, finished_at=now())


def fail_job(session: Session, workflow_id: str, reason: str) -> None:
    """Say that the export behind a job failed, and why."""
    export_id = repository.id_of_job(session, workflow_id)
    if export_id is not None:
        fail(session, export_id, reason)


def _run(run: Run) -> dict[str, object]:
    return {
        "id": run.id,
        "preset": run.preset,
        "parameters": dict(sorted(run.parameters.items())),
        "detector": run.model.name,
        "detector_sha256": run.model.sha256,
        "registration_id": run.registration_id,
        "code_version": run.code_version,
    }


def _image(image: Image, shown: Identities) -> ImageRecord:
    return ImageRecord(
        id=image.id,
        file_name=shown.file_name(image.file_name, image.sha256),
        sha256=image.sha256,
        width_px=image.width_px,
        height_px=image.height_px,
        captured_at=image.captured_at,
    )


def _pose(
    pose: Pose,
    review: Review | None,
    correction: Correction | None,
    image: ImageRecord,
    registrations: Mapping[int, int],
    shown: Identities,
) -> PoseRecord:
    """Put a pose together; what a person corrected takes the place of what was generated."""
    box, state = pose.match.detection, pose.match.vessel_state
    place = correction or pose
    rotation, _ = cv2.Rodrigues(np.array(place.rotvec_cam_from_vessel, dtype=np.float64))
    generated = "person_made" if pose.person_made else "generated"
    source = correction.kind.value if correction else generated
    return PoseRecord(
        id=pose.id,
        run_id=pose.run_id,
        registration_id=registrations[pose.run_id],
        image=image,
        vessel=shown.vessel(place.mmsi),
        box_px=(box.x1_px, box.y1_px, box.x2_px, box.y2_px),
        score=box.score,
        cost=correction.cost if correction and correction.cost is not None else pose.match.cost,
        centroid_in_cam_m=place.centroid_in_cam_m,
        rotation_cam_from_vessel=rotation.tolist(),
        rotvec_cam_from_vessel=place.rotvec_cam_from_vessel,
        lat_deg=place.lat_deg,
        lon_deg=place.lon_deg,
        center_height_m=place.center_height_m,
        heading_deg=place.heading_deg,
        heading_source="person" if source == "edited" else state.heading_source,
        report_age_s=state.age_s,
        length_m=place.length_m,
        width_m=place.width_m,
        height_m=place.height_m,
        corners_in_image_px=place.corners_in_image_px,
        correction_in_enu_m=pose.correction_in_enu_m,
        flags=pose.flags if correction is None else correction.flags,
        review=_review(review),
        source=source,
    )


def _review(review: Review | None) -> ReviewRecord | None:
    if review is None:
        return None
    return ReviewRecord(
        grade=review.grade.value,
        reasons=review.reasons,
        guideline_version=review.guideline_version,
        created_at=review.created_at,
    )
