"""`quaymark export`: written here and now, for scripts that want a file and no job."""

import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from app.exports.making import Advanced
    from app.installation import Installation
    from app.tables.exports import Export

FORMAT_NAMES = "coco, bop, kitti, bonk, parquet, ndjson, csv"


def register(cli: typer.Typer) -> None:
    """Add the command."""
    cli.command()(export)


def export(
    format_name: Annotated[str, typer.Option("--format", help=f"One of {FORMAT_NAMES}")],
    out: Annotated[
        Path,
        typer.Option(dir_okay=False, writable=True, help="The file to write; it is replaced"),
    ],
    run: Annotated[int | None, typer.Option(help="Only poses of this run")] = None,
    site: Annotated[int | None, typer.Option(help="Only poses of this site")] = None,
    camera: Annotated[int | None, typer.Option(help="Only poses of this camera")] = None,
    viewport: Annotated[int | None, typer.Option(help="Only poses of this viewport")] = None,
    image: Annotated[int | None, typer.Option(help="Only poses of this image")] = None,
    since: Annotated[
        str | None, typer.Option("--from", help="Only images taken at this time or later, UTC")
    ] = None,
    until: Annotated[
        str | None, typer.Option("--to", help="Only images taken before this time, UTC")
    ] = None,
    mmsi: Annotated[str | None, typer.Option(help="Only poses of this vessel")] = None,
    grade: Annotated[
        list[str] | None,
        typer.Option(help="Only poses with this grade, or `ungraded`; once for each"),
    ] = None,
    state: Annotated[
        str | None,
        typer.Option(help="ungraded, graded, disagreement, second_opinion or settled"),
    ] = None,
    reviewer: Annotated[int | None, typer.Option(help="Only poses this person graded")] = None,
    verdict: Annotated[
        str | None, typer.Option(help="Which review counts: standing, newest or consensus")
    ] = None,
    range_min: Annotated[
        float | None, typer.Option(help="Metres from the camera, at least")
    ] = None,
    range_max: Annotated[float | None, typer.Option(help="Metres from the camera, at most")] = None,
    flag: Annotated[str | None, typer.Option(help="Only poses with this flag")] = None,
    only_corrected: Annotated[
        bool | None,
        typer.Option("--only-corrected/--only-uncorrected", help="By whether a person corrected"),
    ] = None,
    person_made: Annotated[
        bool | None,
        typer.Option("--person-made/--pipeline-made", help="By who found the vessel"),
    ] = None,
    updated_since: Annotated[
        str | None,
        typer.Option(help="Only what was made, judged or corrected since this time, UTC"),
    ] = None,
    split: Annotated[
        str | None, typer.Option(help="Parts that share nothing: by `vessel` or by `day`")
    ] = None,
    seed: Annotated[int, typer.Option(help="Another seed, other parts")] = 0,
    fractions: Annotated[
        str, typer.Option(help="Shares of train, val and test, adding up to 1")
    ] = "0.7,0.15,0.15",
    *,
    corrected: Annotated[
        bool, typer.Option("--corrected", help="Boxes as people corrected them")
    ] = False,
    images: Annotated[
        bool, typer.Option("--images", help="With the photographs, in a zip archive")
    ] = False,
    archive: Annotated[
        bool, typer.Option("--archive", help="A zip archive with manifest and datasheet")
    ] = False,
    with_identities: Annotated[
        bool, typer.Option("--with-identities", help="MMSI instead of pseudonyms")
    ] = False,
) -> None:
    """Write poses with their reviews to a file; vessels are pseudonyms unless said otherwise."""
    given = {
        "run_id": run,
        "site_id": site,
        "camera_id": camera,
        "viewport_id": viewport,
        "image_id": image,
        "from": since,
        "to": until,
        "mmsi": mmsi,
        "grade": grade or None,
        "state": state,
        "reviewer": reviewer,
        "verdict": verdict,
        "range_min_m": range_min,
        "range_max_m": range_max,
        "flag": flag,
        "corrected": only_corrected,
        "person_made": person_made,
        "updated_since": updated_since,
        "poses": "corrected" if corrected else None,
    }
    packing = {"images": images, "archive": archive, "split": _split(split, seed, fractions)}
    _export(format_name, out, given, packing, anonymise=not with_identities)


def _split(by: str | None, seed: int, fractions: str) -> dict[str, object] | None:
    if by is None:
        return None
    shares = fractions.split(",")
    if len(shares) != 3:
        raise typer.BadParameter(
            "give three shares, such as 0.7,0.15,0.15", param_hint="--fractions"
        )
    return {"by": by, "seed": seed, **dict(zip(("train", "val", "test"), shares, strict=True))}


def _export(
    format_name: str,
    out: Path,
    given: Mapping[str, object],
    packing: Mapping[str, object],
    *,
    anonymise: bool,
) -> None:
    from pydantic import ValidationError

    from app.exports.filters import ExportFilters, ExportOptions
    from app.exports.formats import FORMATS
    from app.exports.service import Request, sites_of
    from app.installation import open_installation

    if format_name not in FORMATS:
        raise typer.BadParameter(f"choose one of {FORMAT_NAMES}", param_hint="--format")
    try:
        filters = ExportFilters.model_validate({k: v for k, v in given.items() if v is not None})
        options = ExportOptions.model_validate(packing)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise typer.BadParameter(
            _message(first["msg"]), param_hint=_option(first["loc"])
        ) from error
    asked = Request(format_name, filters, options, site_ids=None, anonymise=anonymise).row()
    with open_installation() as here:
        with here.database.reading() as session:
            list(sites_of(session, filters))  # raises for an id that leads to nothing
        count = _write(here, asked, out)
    typer.echo(f"wrote {count} poses to {out}")


def _message(text: str) -> str:
    return text.removeprefix("Value error, ")


def _option(place: tuple[int | str, ...]) -> str:
    """Return the option that a filter's name stands for."""
    name = str(place[0]) if place else "filters"
    name = name.removesuffix("_id").removesuffix("_m")
    return "--" + {"corrected": "only_corrected"}.get(name, name).replace("_", "-")


def _write(here: "Installation", asked: "Export", out: Path) -> int:
    """Write beside the wanted place and move there when all is written; return the poses."""
    from app.exports.making import write_export

    draft = out.with_name(f".{out.name}.{secrets.token_hex(8)}")
    try:
        with draft.open("xb") as target, _bar() as advanced:
            count = write_export(here.database, asked, target, here.storage, advanced).count
            target.flush()
            os.fsync(target.fileno())
        draft.replace(out)
    finally:
        draft.unlink(missing_ok=True)
    return count


@contextmanager
def _bar() -> "Iterator[Advanced]":
    """Show on a terminal how far the export is."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("poses", total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
