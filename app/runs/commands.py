"""`quaymark run` and `quaymark fuse`."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.domain.fusion_settings import PRESET_OF_RUNS, Preset
from app.errors import AppError, Invalid

if TYPE_CHECKING:
    from app.db import Database
    from app.tables.runs import Run


def register(cli: typer.Typer) -> None:
    """Add the commands."""
    cli.command(name="run")(run)
    cli.command()(fuse)


def run(
    viewport: Annotated[int, typer.Option(help="The viewport's id")],
    detector: Annotated[str | None, typer.Option(help="A ready model's name")] = None,
    preset: Annotated[Preset, typer.Option()] = PRESET_OF_RUNS,
    changed: Annotated[
        list[str] | None, typer.Option("--set", help="key=value, once for each parameter")
    ] = None,
    *,
    wait: Annotated[bool, typer.Option(help="Watch the run until it ends")] = True,
) -> None:
    """Run the pipeline over a viewport's images; a worker must be running."""
    from app.installation import open_installation
    from app.runs import service
    from app.tables.runs import RunStatus

    parameters = dict(_pair(text) for text in changed or ())
    with open_installation() as here:
        with here.database.writing() as session:
            started = service.start_run(
                session,
                here.jobs,
                viewport_id=viewport,
                detector=detector,
                preset=preset.value,
                parameters=parameters,
            )
        typer.echo(f"run {started.id} over {started.image_count} images")
        if wait:
            ended = watch(here.database, started.id)
            if ended.status is not RunStatus.SUCCEEDED:
                raise AppError(f"run {started.id} {ended.status}: {ended.error or ''}")


def watch(database: "Database", run_id: int) -> "Run":
    """Show a run's progress until it has ended; returns the run."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    from app.runs import service

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns) as bars:
        bar = bars.add_task("fusing")
        while True:
            with database.reading() as session:
                current = service.get_run(session, run_id)
                progress = service.progress(session, current)
            bars.update(bar, total=progress.images_total, completed=progress.images_done)
            if current.status in service.ENDED:
                return current
            time.sleep(0.3)


def fuse(
    camera: Annotated[Path, typer.Option(help="Camera file: size, K, pose")],
    label: Annotated[Path, typer.Option(help="Label file: boxes and vessels of one image")],
    preset: Annotated[Preset, typer.Option()] = Preset.PAPER,
) -> None:
    """Fuse one image's boxes and vessels from two files; prints JSON, stores nothing."""
    from app.fuse_files import fuse_files

    typer.echo(json.dumps(fuse_files(camera, label, preset.value), indent=1))


def _pair(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals:
        raise Invalid.field("--set", f"{text!r} must read key=value")
    try:
        return key, json.loads(value)
    except json.JSONDecodeError:
        return key, value
