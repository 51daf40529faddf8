"""Commands that run an installation."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError, NotFound
from app.locator import locate

if TYPE_CHECKING:
    from app.db import Database

Host = Annotated[str, typer.Option(help="Address to listen at")]
Port = Annotated[int, typer.Option(help="Port to listen at")]


def register(cli: typer.Typer) -> None:
    """Add the commands."""
    cli.command()(serve)
    cli.command()(worker)
    cli.command()(demo)
    cli.command()(bench)
    database = typer.Typer(name="db", help="The database's schema.", no_args_is_help=True)
    database.command()(upgrade)
    database.command()(downgrade)
    database.command()(check)
    cli.add_typer(database)


def serve(host: Host = "", port: Port = 0) -> None:
    """Serve the pages and REST; jobs need a worker beside it."""
    from app.config import get_settings
    from app.operation.serving import serve as serve_pages

    settings = get_settings()
    serve_pages(settings, host or settings.host, port or settings.port)


def worker(
    concurrency: Annotated[
        int, typer.Option(min=0, help="Processes, one a core; 0: QUAYMARK_WORKER_CONCURRENCY")
    ] = 0,
) -> None:
    """Do jobs until stopped."""
    os.execv(  # noqa: S606  our own module, in place of this process
        sys.executable, [sys.executable, "-m", "worker", f"--concurrency={concurrency}"]
    )


def demo(
    host: Host = "127.0.0.1",
    port: Port = 8000,
    images: Annotated[int, typer.Option(min=1, max=10_000, help="How many images")] = 32,
    seed: Annotated[int, typer.Option(min=0, help="Another seed is another harbour")] = 19,
    size: Annotated[str, typer.Option(help="Image size in px: WIDTHxHEIGHT")] = "1280x960",
    *,
    leave: Annotated[
        bool, typer.Option("--exit", help="Set up, run, print the summary, and end")
    ] = False,
) -> None:
    """Set up the demo harbour, run the pipeline on it and serve it until Ctrl-C."""
    from app.operation.demo import run_demo
    from app.operation.harbour_site import HarbourChoice

    width_px, height_px = _size(size)
    run_demo(host, port, HarbourChoice(seed, images, width_px, height_px), leave=leave)


def _size(text: str) -> tuple[int, int]:
    width, times, height = text.partition("x")
    if not (times and width.isdecimal() and height.isdecimal()):
        raise typer.BadParameter(f"{text!r} must read WIDTHxHEIGHT, such as 1280x960")
    width_px, height_px = int(width), int(height)
    if not (320 <= width_px <= 8192 and 240 <= height_px <= 8192):
        raise typer.BadParameter("width must lie in 320 to 8192 px, height in 240 to 8192 px")
    return width_px, height_px


def bench(name: Annotated[str, typer.Argument(help="Only this benchmark")] = "") -> None:
    """Run the benchmarks of a checkout."""
    folder = locate("templates").parent / "benchmarks"
    scripts = sorted(folder.glob("bench_*.py")) if folder.is_dir() else []
    chosen = [script for script in scripts if name in {"", script.stem.removeprefix("bench_")}]
    if not chosen:
        names = ", ".join(script.stem.removeprefix("bench_") for script in scripts)
        raise NotFound(f"no benchmark {name!r}; there are: {names or 'none outside a checkout'}")
    for script in chosen:
        typer.echo(f"== {script.stem.removeprefix('bench_')}")
        if subprocess.run([sys.executable, str(script)], check=False).returncode:  # noqa: S603
            raise AppError(f"the benchmark {script.stem} failed")


def upgrade(revision: Annotated[str, typer.Argument()] = "head") -> None:
    """Bring the database's tables up to date."""
    from app import schema

    with _database() as database:
        schema.upgrade(database, revision)
        typer.echo(f"database is at {schema.current_revision(database)}")


def downgrade(revision: Annotated[str, typer.Argument(help="`base` removes all tables")]) -> None:
    """Take the database's tables back to a revision."""
    from app import schema

    with _database() as database:
        schema.downgrade(database, revision)
    typer.echo(f"database is at {revision}")


def check(
    *,
    rehash: Annotated[
        bool, typer.Option("--hash", help="Hash every stored file again; takes its time")
    ] = False,
) -> None:
    """Say whether the database fits this version and all it says is so; exit 1 when not."""
    from app import schema
    from app.config import get_settings
    from app.keeping.files import check_files
    from app.keeping.soundness import orphans, problems
    from app.storage import Storage

    storage = Storage(get_settings().storage_url)
    with _database() as database:
        schema.refuse_other_version(database)
        if differing := schema.differences(database):
            raise AppError(f"the tables differ from this version's: {differing}")
        found = list(problems(database, storage))
        if rehash:
            checked = check_files(database, storage)
            if checked.damaged:
                found.append(f"{checked.damaged} of {checked.files} files are damaged")
        for problem in found:
            typer.echo(problem)
        if unused := orphans(database, storage):
            typer.echo(f"{unused} stored files belong to no row (no harm)")
    if found:
        raise AppError(f"{len(found)} problems found")
    typer.echo(f"database is at {schema.head_revision()} and fits")


@contextmanager
def _database() -> Iterator["Database"]:
    from app.config import get_settings
    from app.db import Database

    database = Database(get_settings().database_url)
    yield database
    database.dispose()
