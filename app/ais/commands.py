"""`quaymark ais inspect` and `quaymark import ais`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from app.errors import AppError, Invalid, TooLarge
from app.path_arguments import files_of

if TYPE_CHECKING:
    from app.domain.rejects import Reject
    from app.domain.table_mapping import TableMapping

Paths = Annotated[
    list[Path],
    typer.Argument(
        exists=True, readable=True, help="Recordings: NMEA, JSON or CSV, plain, gzip or zip"
    ),
]
MappingFile = Annotated[
    Path | None,
    typer.Option(
        exists=True, dir_okay=False, help="JSON that says which column of a table is what"
    ),
]


def register(cli: typer.Typer, imports: typer.Typer) -> None:
    """Add the commands."""
    ais = typer.Typer(name="ais", help="AIS recordings.", no_args_is_help=True)
    ais.command()(inspect)
    cli.add_typer(ais)
    imports.command("ais")(import_recordings)


def inspect(
    paths: Paths,
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON")] = False,
    mapping: MappingFile = None,
    rejected: Annotated[
        bool, typer.Option("--rejected", help="Print each line that is not taken, and why")
    ] = False,
) -> None:
    """Decode recordings without storing anything, and say what became of every line."""
    from app.ais.service import inspect as decode
    from app.config import get_settings

    files, _ = files_of(paths, frozenset())
    found = decode(
        files,
        max_bytes=get_settings().max_ais_file_bytes,
        mapping=_mapping_of(mapping),
        on_reject=_print_reject if rejected else None,
    )
    if as_json:
        typer.echo(json.dumps(found, indent=1))
        return
    for name, value in found.items():
        typer.echo(f"{name:<10} {_in_words(value)}")


def _print_reject(entry: str, reject: "Reject") -> None:
    where = f"{entry}:{reject.line}" if entry else f"line {reject.line}"
    typer.echo(f"{where}: {reject.message}: {reject.text.decode('utf-8', 'replace')}", err=True)


def _mapping_of(path: Path | None) -> "TableMapping | None":
    from app.domain.table_mapping import MappingError, TableMapping

    if path is None:
        return None
    try:
        data = json.loads(path.read_text())
        return TableMapping.of(data if isinstance(data, dict) else {})
    except (ValueError, RecursionError) as error:
        field = f"{error.field}: " if isinstance(error, MappingError) else ""
        raise typer.BadParameter(f"{path}: {field}{error}", param_hint="--mapping") from error


def _in_words(value: Any) -> str:  # noqa: ANN401  a part of JSON
    if isinstance(value, dict):
        return ", ".join(f"{name} {_in_words(count)}" for name, count in value.items()) or "none"
    if isinstance(value, list):
        return "; ".join(map(_in_words, value)) or "none"
    return f"{value:,}" if isinstance(value, int) else str(value or "none")


def import_recordings(
    paths: Paths,
    site: Annotated[
        int | None, typer.Option(help="Id of the site that alone may use it; else all sites")
    ] = None,
    mapping: MappingFile = None,
) -> None:
    """Import AIS recordings; the same bytes again change nothing."""
    from app.ais.service import import_ais_file
    from app.installation import open_installation
    from app.sites.service import get_site

    files, _ = files_of(paths, frozenset())
    chosen = _mapping_of(mapping)
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
                    mapping=chosen,
                )
            except (Invalid, TooLarge) as error:
                refused += 1
                typer.echo(f"refused {file}: {error.detail}", err=True)
                continue
            word = "imported" if imported.created else "known"
            messages = imported.file.accounting["messages"]
            typer.echo(f"{word} {file}: {_in_words(messages)}")
            left_out = imported.file.accounting.get("left_out", {"count": 0, "first": []})
            for left in left_out["first"]:
                typer.echo(f"left out {left['entry']!r}: {left['reason']}", err=True)
            if (more := left_out["count"] - len(left_out["first"])) > 0:
                typer.echo(f"left out {more} more entries", err=True)
    if refused:
        raise AppError(f"{refused} of {len(files)} recordings were refused")
