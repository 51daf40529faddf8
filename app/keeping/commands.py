"""`quaymark backup` and `quaymark restore`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError

if TYPE_CHECKING:
    from rich.progress import Progress

    from app.keeping.archive import Manifest

File = Annotated[Path, typer.Argument(help="The archive, such as quaymark-2026-11-22.tar")]
MOST_NAMED = 3


def register(cli: typer.Typer) -> None:
    """Add the commands."""
    cli.command()(backup)
    cli.command()(restore)


def backup(file: File) -> None:
    """Write database and files into one archive, while the installation serves."""
    from app.installation import open_installation
    from app.keeping.backup import make_backup

    with open_installation() as here, _progress() as progress:
        task = progress.add_task("backing up", total=None)

        def told(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        manifest = make_backup(here.settings, here.database, here.storage, file, told)
    typer.echo(f"{file}: {_contents(manifest)}")
    _complain(manifest)


def restore(
    file: File,
    *,
    force: Annotated[
        bool, typer.Option("--force", help="Replace what is in the installation")
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Only check the archive; restore nothing")
    ] = False,
) -> None:
    """Restore an archive into an empty installation; web and workers must be stopped."""
    from app.config import get_settings
    from app.db import Database
    from app.keeping.restore import check_backup, restore_backup
    from app.storage import Storage

    with _progress() as progress:
        task = progress.add_task("checking", total=None)

        def told(done: int) -> None:
            progress.advance(task, done)

        if check:
            manifest = check_backup(file, told).manifest
        else:
            settings = get_settings()
            database = Database(settings.database_url)
            try:
                manifest = restore_backup(
                    settings,
                    database,
                    Storage(settings.storage_url),
                    file,
                    force=force,
                    told=told,
                )
            finally:
                database.dispose()
    typer.echo(f"{file}: {'whole' if check else 'restored'}, {_contents(manifest)}")
    _complain(manifest)


def _contents(manifest: "Manifest") -> str:
    return (
        f"{manifest.rows} rows of {len(manifest.tables)} tables, {manifest.file_count} files "
        f"({manifest.file_bytes / 1e6:.1f} MB), {len(manifest.jobs)} jobs under way"
    )


def _complain(manifest: "Manifest") -> None:
    """Raise AppError where the store had lost files before the backup was made."""
    lost = [*manifest.missing, *manifest.damaged]
    if lost:
        named = ", ".join(lost[:MOST_NAMED]) + (", ..." if len(lost) > MOST_NAMED else "")
        raise AppError(
            f"{len(manifest.missing)} files were missing in the store and "
            f"{len(manifest.damaged)} damaged when the backup was made: {named}"
        )


@contextmanager
def _progress() -> Iterator["Progress"]:
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    console = Console(stderr=True)
    with Progress(
        *Progress.get_default_columns(),
        MofNCompleteColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as progress:
        yield progress
