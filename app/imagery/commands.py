"""`quaymark import images`."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError
from app.path_arguments import files_of

if TYPE_CHECKING:
    from app.installation import Installation

ENDINGS = frozenset({".jpg", ".jpeg", ".png", ".webp"})


def register(imports: typer.Typer) -> None:
    """Add the command."""
    imports.command("images")(import_images)


def import_images(
    camera: Annotated[int, typer.Argument(help="The camera's id")],
    paths: Annotated[
        list[Path],
        typer.Argument(
            exists=True, readable=True, help="Photographs, or folders with photographs below them"
        ),
    ],
) -> None:
    """Import a camera's photographs; the same bytes again change nothing.

    When a photograph was taken comes from its EXIF, else from its name by the camera's pattern.
    """
    from app.installation import open_installation

    files, left_out = files_of(paths, ENDINGS)
    with open_installation() as here:
        name, counts = _import_all(here, camera, files)
    typer.echo(
        f"camera {name!r}: {counts['new']} new, {counts['known']} known, "
        f"{counts['refused']} refused"
        + (f"; {left_out} files with other endings left out" if left_out else "")
    )
    if counts["refused"]:
        raise AppError(f"{counts['refused']} of {len(files)} photographs were refused")


def _import_all(
    here: "Installation", camera_id: int, files: list[Path]
) -> tuple[str, Counter[str]]:
    from rich.console import Console
    from rich.progress import track

    from app.auth.audit import record
    from app.imagery.service import Upload, store_image
    from app.sites.service import get_camera

    with here.database.reading() as session:
        camera = get_camera(session, camera_id)
    console = Console(stderr=True)
    counts: Counter[str] = Counter()
    for file in track(
        files, "importing", console=console, disable=not console.is_terminal, transient=True
    ):
        try:
            upload = Upload(_read(file, here.settings.max_upload_bytes), file.name)
            _, is_new = store_image(here.database, here.storage, here.settings, camera.id, upload)
        except AppError as error:
            counts["refused"] += 1
            console.print(f"refused {file}: {error.detail}", markup=False, soft_wrap=True)
        else:
            counts["new" if is_new else "known"] += 1
    if counts["new"]:
        with here.database.writing() as session:
            record(
                session, None, "import", "camera", camera.id, camera.site_id, images=counts["new"]
            )
    return camera.name, counts


def _read(file: Path, max_bytes: int) -> bytes:
    # A byte more than is allowed tells that the file is too large, whatever its size.
    with file.open("rb") as stream:
        return stream.read(max_bytes + 1)
