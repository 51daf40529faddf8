"""`quaymark export`: written here and now, for scripts that want a file and no job."""

import os
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from app.installation import Installation
    from app.tables.exports import Export


def register(cli: typer.Typer) -> None:
    """Add the command."""
    cli.command()(export)


def export(
    format_name: Annotated[str, typer.Option("--format", help="coco or ndjson")],
    out: Annotated[
        Path,
        typer.Option(dir_okay=False, writable=True, help="The file to write; it is replaced"),
    ],
    run: Annotated[int | None, typer.Option(help="Only poses of this run")] = None,
    site: Annotated[int | None, typer.Option(help="Only poses of this site")] = None,
    camera: Annotated[int | None, typer.Option(help="Only poses of this camera")] = None,
    grade: Annotated[
        list[str] | None, typer.Option(help="Only poses with this grade; once for each")
    ] = None,
    *,
    corrected: Annotated[
        bool, typer.Option("--corrected", help="Boxes as people corrected them")
    ] = False,
    with_identities: Annotated[
        bool, typer.Option("--with-identities", help="MMSI instead of pseudonyms")
    ] = False,
) -> None:
    """Write poses with their reviews to a file; vessels are pseudonyms unless said otherwise."""
    from app.exports.filters import ExportFilters
    from app.exports.service import WRITERS, sites_of
    from app.installation import open_installation
    from app.tables.exports import Export
    from app.tables.reviews import Grade

    if format_name not in WRITERS:
        raise typer.BadParameter(f"choose one of {', '.join(WRITERS)}", param_hint="--format")
    if not set(grade or ()) <= set(Grade):
        raise typer.BadParameter(f"choose among {', '.join(Grade)}", param_hint="--grade")
    filters = ExportFilters(
        run_id=run,
        site_id=site,
        camera_id=camera,
        grade=[Grade(name) for name in grade] if grade else None,
        poses="corrected" if corrected else None,
    )
    asked = Export(
        format=format_name,
        filters=filters.model_dump(mode="json", exclude_none=True),
        site_ids=None,
        anonymise=not with_identities,
    )
    with open_installation() as here:
        with here.database.reading() as session:
            list(sites_of(session, filters))  # raises for an id that leads to nothing
        count = _write(here, asked, out)
    typer.echo(f"wrote {count} poses to {out}")


def _write(here: "Installation", asked: "Export", out: Path) -> int:
    """Write beside the wanted place and move there when all is written; return the poses."""
    from app.exports.service import write_export

    draft = out.with_name(f".{out.name}.{secrets.token_hex(8)}")
    try:
        with draft.open("xb") as target:
            count = write_export(here.database, asked, target)
            target.flush()
            os.fsync(target.fileno())
        draft.replace(out)
    finally:
        draft.unlink(missing_ok=True)
    return count
