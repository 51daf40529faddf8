"""`quaymark model` and `quaymark import detections`."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError

if TYPE_CHECKING:
    from app.db import Database
    from app.detectors.service import AddedModel
    from app.tables.detection import Model

Wait = Annotated[bool, typer.Option("--wait", help="Wait until a running worker has tried it")]
POLL_S = 0.3


def register(cli: typer.Typer, imports: typer.Typer) -> None:
    """Add the commands."""
    models = typer.Typer(name="model", help="Detectors.", no_args_is_help=True)
    models.command("list")(list_models)
    models.command()(pull)
    models.command()(add)
    cli.add_typer(models)
    imports.command("detections")(import_detections)


def list_models(
    *, as_json: Annotated[bool, typer.Option("--json", help="Print JSON")] = False
) -> None:
    """List the detectors of this installation."""
    from app.detectors.schemas import ModelOut
    from app.detectors.service import all_models
    from app.installation import open_installation

    with open_installation() as here, here.database.reading() as session:
        models = [ModelOut.model_validate(model) for model in all_models(session)]
    if as_json:
        typer.echo(json.dumps([model.model_dump(mode="json") for model in models], indent=1))
        return
    for model in models:
        reason = f"  {model.reason}" if model.reason else ""
        typer.echo(
            f"{model.name:<24} {model.family:<25} {model.status:<8} "
            f"{model.size_bytes / 2**20:7.1f} MB{reason}"
        )
    if not models:
        typer.echo("no detectors yet: `quaymark model pull yolox-x` or `quaymark model add`")


def pull(
    name: Annotated[
        str, typer.Argument(help="yolox-nano, -tiny, -s, -m, -l or -x: COCO weights, Apache-2.0")
    ],
    *,
    wait: Wait = False,
) -> None:
    """Fetch an official YOLOX model, check its SHA-256 and have it tried by a worker."""
    from app.detectors.releases import OFFICIAL, pull_model
    from app.installation import open_installation

    if name not in OFFICIAL:
        raise typer.BadParameter(f"choose one of {', '.join(OFFICIAL)}", param_hint="NAME")
    with open_installation() as here:
        typer.echo(f"fetching {name} ...", err=True)
        added = pull_model(here.database, here.storage, here.jobs, name)
        _tell(here.database, added, wait=wait)


def add(
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="An ONNX file")
    ],
    name: Annotated[str, typer.Option(help="How runs call it")],
    family: Annotated[
        str,
        typer.Option(
            help="What its inputs and outputs mean: yolox, yolov3, detr, deformable-detr, "
            "deformable-detr-two-stage or cascade-rcnn; auto: as they show"
        ),
    ] = "auto",
    *,
    wait: Wait = False,
) -> None:
    """Add a detector of your own and have it tried by a worker."""
    from app.detectors.families import AUTO, FAMILIES, family_named
    from app.detectors.service import add_model_file
    from app.installation import open_installation

    if family_named(family) is None:
        known = ", ".join((AUTO, *FAMILIES))
        raise typer.BadParameter(f"choose one of {known}", param_hint="--family")
    with open_installation() as here:
        added = add_model_file(
            here.database,
            here.storage,
            here.jobs,
            file,
            name=name,
            family=family,
            max_bytes=here.settings.max_model_bytes,
        )
        _tell(here.database, added, wait=wait)


def _tell(database: "Database", added: "AddedModel", *, wait: bool) -> None:
    model = _tried(database, added.model.id) if wait else added.model
    if model.reason is not None:
        raise AppError(f"{model.name} was refused: {model.reason}")
    family = "" if model.family == "auto" else f", family {model.family}"
    known = "" if added.created else " (known already)"
    typer.echo(f"{model.name} is {model.status}{family}{known}")


def _tried(database: "Database", model_id: int) -> "Model":
    from app.detectors.service import get_model
    from app.tables.detection import ModelStatus

    while True:
        with database.reading() as session:
            model = get_model(session, model_id)
        if model.status is not ModelStatus.PROBING:
            return model
        time.sleep(POLL_S)


def import_detections(
    file: Annotated[
        Path,
        typer.Argument(
            exists=True, dir_okay=False, readable=True, help="A COCO results file (JSON)"
        ),
    ],
    name: Annotated[str, typer.Option(help="How runs call the source of these boxes")],
    camera: Annotated[
        int | None, typer.Option(help="Id of the camera whose file names are meant")
    ] = None,
    images: Annotated[
        Path | None,
        typer.Option(
            exists=True, dir_okay=False, readable=True, help="A COCO file whose image ids are meant"
        ),
    ] = None,
    category: Annotated[
        list[int] | None, typer.Option(help="A category id that is a vessel; once for each")
    ] = None,
) -> None:
    """Import the boxes of another detector; a run can use them like those of a model."""
    from app.auth.audit import record
    from app.detectors.imported import resolve, store
    from app.domain.detection import COCO_BOAT
    from app.installation import open_installation

    with open_installation() as here:
        with here.database.reading() as session:
            found = resolve(
                session,
                file.read_bytes(),
                name=name,
                camera_id=camera,
                images=None if images is None else images.read_bytes(),
                categories=dict.fromkeys(category, COCO_BOAT) if category else None,
            )
        with here.database.writing() as session:
            outcome = store(session, found, user_id=None)
            if outcome.created:
                record(session, None, "import", "model", outcome.model.id, name=outcome.model.name)
    typer.echo(
        f"{outcome.model.name}: {outcome.detections} boxes on {outcome.images} images"
        + (f", {outcome.ignored} of other categories left out" if outcome.ignored else "")
        + ("" if outcome.created else " (known already)")
    )
    for note in outcome.notes:
        typer.echo(note, err=True)
