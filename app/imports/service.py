"""Batches: begun, looked at, committed in one transaction, undone, restored and moved as a whole.

Nothing of a batch is an image before it is committed. The commit is a single statement over rows
that were worked out before it, so a batch is there as a whole or not at all, and the database is
held for a fraction of a second even for tens of thousands of images.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from functools import partial
from typing import Any

from sqlalchemy.orm import Session
from sqlalchemy.orm.attributes import flag_modified

from app.db import now
from app.deletions import service as deletions
from app.edits import flush_edit
from app.errors import Conflict, NotFound
from app.imagery.names import tidy
from app.imagery.true_time import corrected_times
from app.imports import repository, states
from app.imports.preview import Camera as Judge
from app.imports.preview import Preview, Ready, preview, viewport_at
from app.imports.proposals import Proposal, propose
from app.imports.schemas import TakesAlongOut, TimesTableOut
from app.imports.states import Act
from app.imports.times import TimeSettings
from app.imports.times_table import matched, read_times
from app.paging import Paging
from app.tables.imagery import Image
from app.tables.imports import FileState, ImageImport, ImportFile, ImportStatus
from app.tables.sites import Camera, Viewport

NO_IMPORT = "there is no such import"
KEPT_FOR = timedelta(days=30)
NAMES_READ = 500
UNKNOWN_SHOWN = 5


def start(session: Session, camera: Camera, name: str, user_id: int | None) -> ImageImport:
    """Begin a batch for a camera, its times told as the camera's usually are."""
    pattern = camera.file_name_pattern
    times = TimeSettings(patterns=[pattern] if pattern else [], timezone=camera.timezone)
    row = ImageImport(
        site_id=camera.site_id,
        camera_id=camera.id,
        name=name,
        times=times.model_dump(mode="json"),
        created_by_id=user_id,
    )
    session.add(row)
    session.flush()
    return row


def get(session: Session, import_id: int) -> ImageImport:
    """Return a batch. Raises NotFound."""
    row = repository.get(session, import_id)
    if row is None:
        raise NotFound(NO_IMPORT)
    return row


def open_import(session: Session, import_id: int) -> ImageImport:
    """Return a batch that still takes files. Raises NotFound, Conflict."""
    row = get(session, import_id)
    states.after(row.status, Act.ADD)
    return row


def list_imports(
    session: Session,
    site_ids: frozenset[int] | None,
    camera_id: int | None,
    status: ImportStatus | None,
    paging: Paging,
) -> tuple[Sequence[ImageImport], str | None]:
    """Return a page of batches, oldest first."""
    return repository.listed(session, site_ids, camera_id, status, paging)


def newest(session: Session, camera_id: int, limit: int) -> Sequence[ImageImport]:
    """Return a camera's newest batches, newest first, without those discarded."""
    return repository.of_camera(session, camera_id, limit)


def open_named(session: Session, camera_id: int, name: str) -> ImageImport | None:
    """Return a camera's newest batch of a name that still collects."""
    return repository.open_named(session, camera_id, name)


def list_files(
    session: Session, import_id: int, state: FileState | None, paging: Paging
) -> tuple[Sequence[ImportFile], str | None]:
    """Return a page of a batch's files, in the order they were announced."""
    return repository.file_page(session, import_id, state, paging)


def times_of(row: ImageImport) -> TimeSettings:
    """Return how a batch's files tell their times."""
    return TimeSettings.model_validate(row.times)


def set_times(row: ImageImport, times: TimeSettings) -> None:
    """Choose how a batch's files tell their times. Raises Conflict once it is committed."""
    states.after(row.status, Act.ADD)
    row.times = times.model_dump(mode="json")


def change_times(row: ImageImport, changes: dict[str, Any]) -> None:
    """Change some of how a batch's files tell their times. Raises Conflict, ValidationError."""
    set_times(row, TimeSettings.model_validate(row.times | changes))


def set_listed_times(session: Session, row: ImageImport, text: str) -> TimesTableOut:
    """Take a table of file name and time; a name without folders stands for any folder's.

    Raises Invalid naming the line that cannot be read; then nothing is taken.
    """
    states.after(row.status, Act.ADD)
    listed = read_times(text)
    files = repository.all_files(session, row.id)
    named = dict(matched(listed, [file.path for file in files]))
    changes = [
        {"id": file.id, "listed_at": listed[named[file.path]].isoformat()}
        for file in files
        if file.path in named
    ]
    repository.update_files(session, changes)
    flag_modified(row, "times")  # a new version: what was looked at is no longer what would come
    flush_edit(session)
    used = set(named.values())
    unknown = [name for name in listed if name not in used]
    return TimesTableOut(
        matched=len(changes), unknown_names=unknown[:UNKNOWN_SHOWN], unknown_count=len(unknown)
    )


def preview_of(session: Session, row: ImageImport, times: TimeSettings | None = None) -> Preview:
    """Work out what committing a batch would do, by its own time rule or one that is tried."""
    chosen = times or times_of(row)
    camera = row.camera
    judge = Judge(
        camera.width_px,
        camera.height_px,
        repository.viewports(session, camera.id),
        frozenset(repository.known_hashes(session, row.id, camera.id)),
        partial(corrected_times, session, camera.id),
    )
    return preview(repository.all_files(session, row.id), chosen, judge, now())


def proposals(session: Session, row: ImageImport) -> list[Proposal]:
    """Return the patterns that the names of a batch's photographs seem to follow."""
    paths = repository.staged_names(session, row.id, NAMES_READ)
    return propose(paths, now() + timedelta(days=1))


def viewports(session: Session, row: ImageImport) -> Sequence[Viewport]:
    """Return the viewports of a batch's camera."""
    return repository.viewports(session, row.camera_id)


def progress(session: Session, row: ImageImport) -> dict[FileState, tuple[int, int]]:
    """Return, by state, how many files there are and how many bytes of them have come."""
    return repository.states(session, row.id)


def commit(session: Session, row: ImageImport, made: Preview, *, leave_out_waiting: bool) -> None:
    """Make images of what a preview found ready. Raises Conflict where there is nothing to do."""
    status = states.after(row.status, Act.COMMIT)
    if made.waiting_count and not leave_out_waiting:
        raise Conflict(
            f"{made.waiting_count:,} files have not come yet; send them, or commit without them "
            "(leave_out_waiting)"
        )
    if not made.ready:
        raise Conflict("none of its files can become an image; see what is odd about them")
    repository.share_camera(session, row.camera_id)
    spans = repository.viewports(session, row.camera_id)
    told = [(item.told.moment, item.told.source) for item in made.ready]
    true_times = corrected_times(session, row.camera_id, told)
    repository.upsert_images(
        session,
        [
            _image(row, item) | _at(true_time, spans)
            for item, true_time in zip(made.ready, true_times, strict=True)
        ],
    )
    repository.release_files(session, row.id)
    row.status, row.committed_at = status, now()
    row.image_count = repository.count_images(session, row)
    flush_edit(session)


def _image(row: ImageImport, item: Ready) -> dict[str, Any]:
    file = item.file
    media_type = file.media_type or ""
    return {
        "site_id": row.site_id,
        "camera_id": row.camera_id,
        "sha256": file.sha256,
        "media_type": media_type,
        "file_name": tidy(file.path, media_type),
        "size_bytes": file.size_bytes,
        "width_px": file.width_px,
        "height_px": file.height_px,
        "captured_at_raw": item.told.moment,
        "captured_at_source": item.told.source,
        "import_id": row.id,
    }


def _at(true_time: datetime, spans: Sequence[Viewport]) -> dict[str, Any]:
    """Return an image's true moment and the viewport that was valid then."""
    viewport = viewport_at(spans, true_time)
    return {"captured_at": true_time, "viewport_id": viewport.id if viewport else None}


def discard(session: Session, row: ImageImport) -> set[str]:
    """Give a batch up before it is committed: its files are forgotten.

    Returns the SHA-256 of the bytes that were stored for it, which may now be spoken of nowhere.
    """
    row.status = states.after(row.status, Act.DISCARD)
    stored = repository.contents(session, row.id)
    repository.forget_files(session, row.id)
    flush_edit(session)
    return stored


def takes_along(session: Session, row: ImageImport) -> TakesAlongOut:
    """Count what disappears when a batch is undone or moved."""
    poses, runs, reviews, corrections = repository.takes_along(session, row)
    return TakesAlongOut(
        images=repository.count_images(session, row),
        poses=poses,
        runs=runs,
        reviews=reviews,
        corrections=corrections,
    )


def undo(session: Session, row: ImageImport, user_id: int | None) -> int:
    """Delete all images of a batch; returns how many.

    They stand in Recently deleted as one thing, and can be restored for 30 days.
    """
    row.status, row.undone_at = states.after(row.status, Act.UNDO), now()
    flush_edit(session)
    deletion = deletions.delete(
        session, "import", [row.id], site_id=row.site_id, label=row.name, user_id=user_id
    )
    return int(deletion.counts.get("images", 0))


def restore(session: Session, row: ImageImport) -> int:
    """Bring the images of an undone batch back; returns how many. Raises Conflict after 30 days."""
    status = states.after(row.status, Act.RESTORE)
    deletion = deletions.deletion_of(session, "import", row.id)
    if deletion is not None:
        deletions.restore(session, deletion)
        return repository.count_images(session, row)
    # Undone before batches stood in Recently deleted.
    if row.undone_at is not None and row.undone_at < now() - KEPT_FOR:
        raise Conflict("it was undone more than 30 days ago, and its images are gone; import anew")
    count = repository.show_images(session, row)
    row.status, row.undone_at = status, None
    flush_edit(session)
    return count


def move(session: Session, row: ImageImport, target: Camera) -> int:
    """Give a batch to another camera; returns how many images went.

    Committed images are made anew at the other camera and deleted at this one, with what rests on
    them: a pose that was computed for another camera would be wrong. Raises Conflict where the
    sizes differ.
    """
    row.status = states.after(row.status, Act.MOVE)
    if target.id == row.camera_id:
        raise Conflict("the import is at this camera already")
    images = repository.images_of(session, row)
    for image in images:
        if (image.width_px, image.height_px) != (target.width_px, target.height_px):
            raise Conflict(
                f"its images have {image.width_px} x {image.height_px} px, but camera "
                f"{target.name!r} takes {target.width_px} x {target.height_px} px"
            )
    repository.share_camera(session, target.id)
    spans = repository.viewports(session, target.id)
    repository.hide_images(session, row, now())
    row.camera_id, row.site_id = target.id, target.site_id
    told = [(image.captured_at_raw, image.captured_at_source) for image in images]
    true_times = corrected_times(session, target.id, told)
    repository.upsert_images(
        session,
        [
            _moved(image, target) | _at(true_time, spans)
            for image, true_time in zip(images, true_times, strict=True)
        ],
    )
    row.image_count = repository.count_images(session, row)
    flush_edit(session)
    session.refresh(row, ["camera"])
    return len(images)


def _moved(image: Image, target: Camera) -> dict[str, Any]:
    kept = (
        "sha256",
        "media_type",
        "file_name",
        "size_bytes",
        "width_px",
        "height_px",
        "captured_at_raw",
        "captured_at_source",
        "import_id",
    )
    own = {"site_id": target.site_id, "camera_id": target.id}
    return {name: getattr(image, name) for name in kept} | own
