"""`quaymark import coco` and `quaymark ground-truth`: boxes by people, in and out."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError, NotFound

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

File = Annotated[
    Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="A COCO file (JSON)")
]


def register(cli: typer.Typer, imports: typer.Typer) -> None:
    """Add the commands."""
    imports.command("coco")(import_coco)
    boxes = typer.Typer(name="ground-truth", help="2D boxes drawn by people.", no_args_is_help=True)
    boxes.command("export")(export)
    cli.add_typer(boxes)


def import_coco(
    file: File,
    site: Annotated[
        int | None, typer.Option(help="Id of the site; not needed where there is one only")
    ] = None,
    mapped: Annotated[
        list[str] | None,
        typer.Option(
            "--map", metavar="CATEGORY=CLASS", help="Which class a category is; none leaves it out"
        ),
    ] = None,
    *,
    complete: Annotated[bool, typer.Option(help="Every vessel in these images has a box")] = True,
    link: Annotated[bool, typer.Option(help="Link photographs of the same name and size")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON")] = False,
) -> None:
    """Import boxes by people from a COCO file, also of photographs that are not here."""
    from app.auth.audit import record
    from app.groundtruth import importing
    from app.groundtruth.coco_file import read_coco
    from app.groundtruth.schemas import ImportedOut
    from app.installation import open_installation

    said = dict(_pair(text) for text in mapped or ())
    data = file.read_bytes()
    read = read_coco(data)
    choices = importing.ImportChoices(file.name, said, complete, link)
    with open_installation() as here, here.database.writing() as session:
        site_id = _site_id(session, site)
        imported = importing.store(
            session, site_id, importing.sha256_of(data), read, choices, user_id=None
        )
        if imported.created:
            record(
                session,
                None,
                "import",
                "ground truth",
                imported.file.id,
                site_id=site_id,
                file_name=file.name,
                images=imported.images,
                boxes=imported.boxes,
            )
        outcome = ImportedOut.of(imported)
    if as_json:
        typer.echo(outcome.model_dump_json(indent=1))
        return
    typer.echo(
        f"{file.name}: {outcome.boxes} boxes in {outcome.images} images"
        + (f", {outcome.linked} photographs linked" if outcome.linked else "")
        + (f", {outcome.left_out} boxes left out" if outcome.left_out else "")
        + ("" if imported.created else " (known already)")
    )


def export(
    out: Annotated[Path, typer.Option(help="The file to write")],
    site: Annotated[
        int | None, typer.Option(help="Id of the site; not needed where there is one only")
    ] = None,
    file: Annotated[int | None, typer.Option(help="Only the boxes of this imported file")] = None,
) -> None:
    """Write a site's boxes as a COCO file: what was imported goes out as it came."""
    from app.groundtruth.exporting import document_of
    from app.groundtruth.service import get_file
    from app.installation import open_installation

    with open_installation() as here, here.database.reading() as session:
        site_id = get_file(session, file).site_id if file is not None else _site_id(session, site)
        document = document_of(session, site_id, file)
    out.write_text(json.dumps(document, allow_nan=False))
    typer.echo(f"{out}: {len(document['annotations'])} boxes in {len(document['images'])} images")


def _pair(text: str) -> tuple[str, str]:
    category, is_pair, vessel_class = text.rpartition("=")
    if not is_pair or not category:
        raise typer.BadParameter("write CATEGORY=CLASS, such as boat=ship", param_hint="--map")
    return category, vessel_class


def _site_id(session: "Session", site: int | None) -> int:
    from app.paging import Paging
    from app.sites.service import get_site, list_sites

    if site is not None:
        return get_site(session, site).id
    sites, _ = list_sites(session, None, Paging(limit=10, after=None))
    if not sites:
        raise NotFound("there is no site yet; make one on the page Sites, then repeat this")
    if len(sites) > 1:
        names = ", ".join(f"{one.id} ({one.name})" for one in sites)
        raise AppError(f"say which site it is with --site: {names}")
    return sites[0].id
