"""`quaymark ais inspect` and `quaymark import ais`."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from app.errors import AppError, Invalid, TooLarge
from app.path_arguments import files_of

Paths = Annotated[
    list[Path],
    typer.Argument(exists=True, readable=True, help="Recordings: NMEA or CSV, plain, gzip or zip"),
]


def register(cli: typer.Typer, imports: typer.Typer) -> None:
    """Add the commands."""
    ais = typer.Typer(name="ais", help="AIS recordings.", no_args_is_help=True)
    ais.command()(inspect)
    cli.add_typer(ais)
    imports.command("ais")(import_recordings)


def inspect(
    paths: Paths, *, as_json: Annotated[bool, typer.Option("--json", help="Print JSON")] = False
) -> None:
    """Decode recordings without storing anything, and say what became of every line."""
    from app.ais.service import inspect as decode
    from app.config import get_settings

    files, _ = files_of(paths, frozenset())
    found = decode(files, max_bytes=get_settings().max_ais_file_bytes)
    if as_json:
        typer.echo(json.dumps(found, indent=1))
        return
    for name, value in found.items():
        typer.echo(f"{name:<10} {_in_words(value)}")


def _in_words(value: Any) -> str:  # noqa: ANN401  a part of JSON
    if isinstance(value, dict):
        return ", ".join(f"{name} {_in_words(count)}" for name, count in value.items()) or "none"
    return f"{value:,}" if isinstance(value, int) else str(value or "none")


def import_recordings(
    paths: Paths,
    site: Annotated[
        int | None, typer.Option(help="Id of the site that alone may use it; else all sites")
    ] = None,
) -> None:
    """Import AIS recordings; the same bytes again change nothing."""
    from app.ais.service import import_ais_file
    from app.installation import open_installation
    from app.sites.service import get_site

    files, _ = files_of(paths, frozenset())
    refused = 0
    with open_installation() as here:
        if site is not None:
            with here.database.reading() as session:
                get_site(session, site)
        for file in files:
            try:
                imported = import_ais_file(
                    here.database,
                    here.storage,
                    file,
                    site_id=site,
                    file_name=file.name,
                    max_bytes=here.settings.max_ais_file_bytes,
                )
            except (Invalid, TooLarge) as error:
                refused += 1
                typer.echo(f"refused {file}: {error.detail}", err=True)
                continue
            word = "imported" if imported.created else "known"
            messages = imported.file.accounting["messages"]
            typer.echo(f"{word} {file}: {_in_words(messages)}")
    if refused:
        raise AppError(f"{refused} of {len(files)} recordings were refused")
