"""Asking for exports, and making them.

An export runs as a job, because a data set of years takes longer than a request may. What it reads
is fixed by its filters; the same data and filters give the same bytes.
"""

import hashlib
import hmac
import tempfile
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import IO

import cv2
import numpy as np
from sqlalchemy.orm import Session

from app import __version__
from app.db import Database, now
from app.errors import Invalid, NotFound
from app.exports import repository
from app.exports.filters import ExportFilters
from app.exports.writers import coco, ndjson
from app.exports.writers.records import ImageRecord, PoseRecord, ReviewRecord, Selection
from app.jobs import JobClient, JobQueue
from app.paging import Paging
from app.storage import Storage, Stored
from app.tables.exports import Export, ExportStatus
from app.tables.imagery import Image
from app.tables.reviews import Review
from app.tables.runs import Pose

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


def make_file(
    database: Database, storage: Storage, secret: bytes, export_id: int
) -> tuple[Stored, int]:
    """Write an export's file into the store; returns its address and how many poses it has."""
    with database.reading() as session, tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES) as draft:
        export = get_export(session, export_id)
        count = write_export(session, export, secret, draft)
        draft.seek(0)
        return storage.put_stream(draft), count


def write_export(session: Session, export: Export, secret: bytes, target: IO[bytes]) -> int:
    """Write an export's bytes; returns how many poses they hold."""
    filters = ExportFilters.model_validate(export.filters)
    poses = repository.PoseSelection(
        site_ids=export.site_ids,
        run_id=filters.run_id,
        site_id=filters.site_id,
        camera_id=filters.camera_id,
        grades=filters.grade,
    )
    selection = Selection(
        filters=export.filters,
        anonymised=export.anonymise,
        runs=[
            {
                "id": run.id,
                "preset": run.preset,
                "parameters": run.parameters,
                "detector": run.model.name,
                "detector_sha256": run.model.sha256,
                "registration_id": run.registration_id,
                "code_version": run.code_version,
            }
            for run in poses.runs(session)
        ],
        code_version=__version__,
        pose_count=poses.count(session),
    )
    images = [_image(image) for image in poses.images(session)]
    key = secret if export.anonymise else None
    records = (_pose(pose, review, key) for pose, review in poses.poses(session))
    for chunk in WRITERS[export.format][0](images, records, selection):
        target.write(chunk)
    return selection.pose_count


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


def pseudonym(mmsi: int, secret: bytes) -> str:
    """Return a vessel's stable pseudonym in this installation; it does not lead back."""
    return hmac.new(secret, f"vessel:{mmsi}".encode(), hashlib.sha256).hexdigest()[:16]


def _image(image: Image) -> ImageRecord:
    return ImageRecord(
        id=image.id,
        file_name=image.file_name,
        sha256=image.sha256,
        width_px=image.width_px,
        height_px=image.height_px,
        captured_at=image.captured_at,
    )


def _pose(pose: Pose, review: Review | None, secret: bytes | None) -> PoseRecord:
    box, state = pose.match.detection, pose.match.vessel_state
    rotation, _ = cv2.Rodrigues(np.array(pose.rotvec_cam_from_vessel, dtype=np.float64))
    return PoseRecord(
        id=pose.id,
        run_id=pose.run_id,
        registration_id=pose.run.registration_id,
        image=_image(pose.image),
        vessel=str(pose.mmsi) if secret is None else pseudonym(pose.mmsi, secret),
        box_px=(box.x1_px, box.y1_px, box.x2_px, box.y2_px),
        score=box.score,
        cost=pose.match.cost,
        centroid_in_cam_m=pose.centroid_in_cam_m,
        rotation_cam_from_vessel=rotation.tolist(),
        rotvec_cam_from_vessel=pose.rotvec_cam_from_vessel,
        lat_deg=pose.lat_deg,
        lon_deg=pose.lon_deg,
        center_height_m=pose.center_height_m,
        heading_deg=pose.heading_deg,
        heading_source=state.heading_source,
        report_age_s=state.age_s,
        length_m=pose.length_m,
        width_m=pose.width_m,
        height_m=pose.height_m,
        corners_in_image_px=pose.corners_in_image_px,
        correction_in_enu_m=pose.correction_in_enu_m,
        flags=pose.flags,
        review=_review(review),
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
