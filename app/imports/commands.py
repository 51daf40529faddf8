"""`quaymark import images`: a batch from the shell, resumable and looked at like any other."""

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from datetime import UTC, datetime, timedelta
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError, Invalid, TooLarge
from app.garbage import loading
from app.imports.rules import TimeRule
from app.path_arguments import files_of

if TYPE_CHECKING:
    from app.imports.intake import Place
    from app.imports.preview import Preview
    from app.tables.imports import ImageImport, ImportFile

ENDINGS = frozenset({".jpg", ".jpeg", ".jpe", ".mpo", ".png", ".webp", ".zip"})
ANNOUNCED_AT_ONCE = 1_000
AT_ONCE = 3


def register(imports: typer.Typer) -> None:
    """Add the command."""
    imports.command("images")(import_images)


def import_images(
    camera: Annotated[int, typer.Argument(help="The camera's id")],
    paths: Annotated[
        list[Path],
        typer.Argument(
            exists=True,
            readable=True,
            help="Photographs, zips of them, or folders with either below them",
        ),
    ],
    *,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only tell what would come in")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Tell it as JSON")] = False,
    time_from: Annotated[
        TimeRule,
        typer.Option(help="auto: EXIF, else the file's name"),
    ] = TimeRule.AUTO,
    pattern: Annotated[
        list[str] | None, typer.Option(help="Of file names, such as cam_%Y%m%d_%H%M%S")
    ] = None,
    timezone: Annotated[
        str, typer.Option(help="Of the camera's clock, such as Europe/Berlin")
    ] = "",
    summer_time: Annotated[
        bool, typer.Option(help="Whether the camera's clock follows summer time")
    ] = True,
    times: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="CSV: file name, time")
    ] = None,
) -> None:
    """Import a camera's photographs as one batch; the same bytes again change nothing.

    Broken off, or after --dry-run, the same command goes on where it was. No image of a batch is
    seen before all of it is there. Zone and patterns are the camera's unless given.
    """
    with loading():
        from app.imports import service
        from app.imports.intake import Place
        from app.installation import open_installation
        from app.sites.service import get_camera

    files, left_out = files_of(paths, ENDINGS)
    name = ", ".join(str(path) for path in paths)[:200]
    given = {"rule": time_from, "patterns": pattern, "timezone": timezone}
    with open_installation() as here:
        place = Place(here.database, here.storage, here.settings)
        with here.database.writing() as session:
            row = get_camera(session, camera)
            batch = service.open_named(session, camera, name)
            batch = batch or service.start(session, row, name, None)
            service.change_times(
                batch,
                {key: value for key, value in given.items() if value}
                | {"follows_summer_time": summer_time},
            )
        try:
            _bring_in(place, batch.id, files)
        except KeyboardInterrupt:
            typer.echo("broken off: the same command goes on where it was", err=True)
            raise
        batch, made = _close(place, batch.id, times, dry_run=dry_run)
    _tell(row.name, batch, made, left_out, as_json=as_json)
    _tell_patterns(made)
    refused = _refused(made)
    if refused:
        raise AppError(f"{len(refused)} of {len(files)} photographs were refused")


def _close(
    place: "Place", import_id: int, times: Path | None, *, dry_run: bool
) -> tuple["ImageImport", "Preview"]:
    """Commit a batch, unless it is only to be looked at; one without anything new is forgotten."""
    from app.auth.audit import record
    from app.deletions import service as deletions
    from app.imports import service

    stored: set[str] = set()
    with place.database.writing() as session:
        batch = service.get(session, import_id)
        if times is not None:
            service.set_listed_times(session, batch, times.read_text("utf-8-sig"))
        made = service.preview_of(session, batch)
        if made.ready and not dry_run:
            service.commit(session, batch, made, leave_out_waiting=False)
            count = batch.image_count
            record(session, None, "commit", "import", batch.id, batch.site_id, images=count)
        elif not dry_run:
            stored = service.discard(session, batch)
    deletions.sweep(place.database, place.storage, stored)
    return batch, made


def _bring_in(place: "Place", import_id: int, files: Sequence[Path]) -> None:
    """Stage all files that have not come yet, with a bar on a terminal."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        DownloadColumn,
        Progress,
        TimeRemainingColumn,
        TransferSpeedColumn,
    )

    from app.imports import paths

    waiting = list(_announce(place, import_id, files))
    archives = [item for item in waiting if paths.is_archive(item[0].name)]
    photographs = [item for item in waiting if not paths.is_archive(item[0].name)]
    console = Console(stderr=True)
    with Progress(
        BarColumn(),
        DownloadColumn(),
        TransferSpeedColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    ) as progress:
        task = progress.add_task("importing", total=sum(row.size_bytes for _, row in waiting))
        for taken_bytes in _take_in(place, import_id, photographs):
            progress.advance(task, taken_bytes)
        for file, row in archives:
            _unpack(place, import_id, file, row)
            progress.advance(task, row.size_bytes)


def _announce(
    place: "Place", import_id: int, files: Sequence[Path]
) -> Iterator[tuple[Path, "ImportFile"]]:
    from app.imports import intake
    from app.imports.schemas import FileIn
    from app.tables.imports import FileState

    for begin in range(0, len(files), ANNOUNCED_AT_ONCE):
        part = files[begin : begin + ANNOUNCED_AT_ONCE]
        facts = [(file, file.stat()) for file in part]
        sent = [
            FileIn(
                path=str(file),
                size_bytes=fact.st_size,
                modified_at=datetime.fromtimestamp(fact.st_mtime, UTC),
            )
            for file, fact in facts
        ]
        for file, row in zip(part, intake.announce(place, import_id, sent), strict=True):
            if row.state is FileState.WAITING:
                yield file, row


def _take_in(
    place: "Place", import_id: int, items: Sequence[tuple[Path, "ImportFile"]]
) -> Iterator[int]:
    """Stage files in portions, a few at once: one is read and checked while another is flushed.

    Yields how many bytes of a portion have come.
    """
    from app.imports.intake import Blob, stage

    def take(portion: Sequence[tuple[Path, "ImportFile"]]) -> int:
        changes = stage(place, import_id, [Blob(row.id, file.read_bytes) for file, row in portion])
        return sum(int(change["received_bytes"]) for change in changes)

    portions = _portions(items)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        under_way = {pool.submit(take, portion) for portion in islice(portions, AT_ONCE)}
        while under_way:
            done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
            following = islice(portions, len(done))
            under_way |= {pool.submit(take, portion) for portion in following}
            for future in done:
                yield future.result()


def _portions(
    items: Sequence[tuple[Path, "ImportFile"]],
) -> Iterator[list[tuple[Path, "ImportFile"]]]:
    from app.imports.intake import PORTION_BYTES

    portion: list[tuple[Path, ImportFile]] = []
    held_bytes = 0
    for item in items:
        portion.append(item)
        held_bytes += item[1].size_bytes
        if held_bytes >= PORTION_BYTES:
            yield portion
            portion, held_bytes = [], 0
    if portion:
        yield portion


def _unpack(place: "Place", import_id: int, file: Path, row: "ImportFile") -> None:
    from app.imports import intake

    with file.open("rb") as stream:
        try:
            intake.unpack(place, import_id, row, stream)
        except (TooLarge, Invalid):
            return  # noted with its reason, which is told with all others


def _tell(
    camera: str, batch: "ImageImport", made: "Preview", left_out: int, *, as_json: bool
) -> None:
    from app.imports.preview import LEFT_OUT, OddKind
    from app.tables.imports import ImportStatus

    refused = _refused(made)
    known = made.count(OddKind.KNOWN, OddKind.REPEATED)
    counts = {"new": len(made.ready), "known": known, "refused": len(refused)}
    if as_json:
        typer.echo(json.dumps(_as_json(batch, made, counts, refused), indent=2))
        return
    for path, reason in refused:
        typer.echo(f"refused {path}: {reason}", err=True)
    told = ", ".join(f"{count} {word}" for word, count in counts.items())
    others = f"; {left_out} files with other endings left out" if left_out else ""
    typer.echo(f"camera {camera!r}: {told}{others}")
    if made.ready:
        first, last = made.ready[0].true_time, made.ready[-1].true_time
        typer.echo(f"taken from {first:%Y-%m-%d %H:%M:%S} to {last:%Y-%m-%d %H:%M:%S} UTC")
    for kind, odd in made.odd.items():
        if kind not in LEFT_OUT:
            path, detail = odd.found[0]
            typer.echo(f"{odd.count} {kind.value.replace('_', ' ')}, such as {path}: {detail}")
    if batch.status is ImportStatus.COLLECTING:
        typer.echo("not committed: give the same command without --dry-run")


def _tell_patterns(made: "Preview") -> None:
    """Tell by which patterns the names of photographs without a time could be read."""
    from app.db import now
    from app.imports.preview import OddKind
    from app.imports.proposals import propose

    untimed = made.odd.get(OddKind.NO_TIME)
    names = [path for path, _ in untimed.found] if untimed else []
    for proposal in propose(names, now() + timedelta(days=1)):
        typer.echo(
            f"--pattern '{proposal.pattern}' would read {proposal.name_count} of the names without "
            f"a time, such as {proposal.example} as {proposal.example_time:%Y-%m-%d %H:%M:%S}",
            err=True,
        )


def _as_json(
    batch: "ImageImport",
    made: "Preview",
    counts: dict[str, int],
    refused: Sequence[tuple[str, str]],
) -> dict[str, object]:
    return {
        "import_id": batch.id,
        "status": batch.status.value,
        **counts,
        "first_at": made.ready[0].true_time.isoformat() if made.ready else None,
        "last_at": made.ready[-1].true_time.isoformat() if made.ready else None,
        "refused_files": [{"path": path, "reason": reason} for path, reason in refused],
        "odd": {kind.value: odd.count for kind, odd in made.odd.items()},
    }


def _refused(made: "Preview") -> list[tuple[str, str]]:
    from app.imports.preview import OddKind

    kinds = (OddKind.REFUSED, OddKind.WRONG_SIZE, OddKind.NO_TIME)
    return [found for kind in kinds if kind in made.odd for found in made.odd[kind].found]
