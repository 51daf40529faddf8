"""`quaymark import bonk`: a data set laid out like BONK-pose, as a site ready to be run.

    DIR/camera.json            size, K and geocentric pose of one viewport, maybe its water level
    DIR/image/ID.jpg           photographs
    DIR/label/ID.json          their boxes and the AIS states of the vessels on them
    DIR/calib/ID.txt           K of a photograph, where it is known (3 x 3)

The boxes come in as imported detections, the vessels as AIS reports, the boxes that people drew
(`2d_annotation_gt`) as ground truth. What the data set does not
publish is chosen, always in the same way:

- Moments: the first photograph by name is taken at `EPOCH` (or --start), each further one an hour
  later, so that no report of one photograph is young enough for another.
- MMSI: 200 000 000 plus a number made of the vessel's identifier; no country has the digits 200,
  so no real vessel is meant.

A photograph whose K is not that of camera.json belongs to another camera and is left out.
"""

import csv
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.errors import AppError, Invalid
from app.stand_ins import FIRST_STAND_IN, STAND_INS

if TYPE_CHECKING:
    from app.domain.camera import Camera
    from app.domain.detection import Detection
    from app.installation import Installation
    from app.published_boxes import Annotated as Annotated2d
    from app.published_files import PublishedVessel

EPOCH = datetime(2022, 1, 1, tzinfo=UTC)
APART = timedelta(hours=1)
OLDEST_REPORT_S = 3000  # less than `APART`
SAME_K_PX = 1e-3
COCO_BOAT_CATEGORY = 9
SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".tif")
AIS_COLUMNS = (
    *("mmsi", "time", "lat", "lon", "sog", "heading"),
    *("to_bow", "to_stern", "to_port", "to_starboard", "name"),
)


@dataclass(frozen=True, slots=True)
class Sample:
    """One labelled photograph of the data set."""

    path: Path
    captured_at: datetime
    boxes: Sequence["Detection"]
    vessels: Sequence["PublishedVessel"]
    drawn: "Annotated2d | None"


@dataclass(frozen=True, slots=True)
class Place:
    """Where the data set goes: ids of the new rows."""

    site_id: int
    camera_id: int
    viewport_id: int


def register(imports: typer.Typer) -> None:
    """Add the command."""
    imports.command("bonk")(import_bonk)


def import_bonk(
    folder: Annotated[Path, typer.Argument(exists=True, file_okay=False, help="The data set")],
    name: Annotated[str, typer.Option(help="What to call the new site")] = "BONK-pose",
    start: Annotated[
        datetime | None,
        typer.Option(help="When the first photograph was taken, UTC; else 2022-01-01"),
    ] = None,
) -> None:
    """Import a data set laid out like BONK-pose: site, camera, photographs, AIS and boxes."""
    from app.installation import open_installation
    from app.published_files import read_camera, read_water_level_m

    camera = read_camera(folder / "camera.json")
    water_level_m = read_water_level_m(folder / "camera.json")
    samples, left_out = read_samples(folder, camera, (start or EPOCH).replace(tzinfo=UTC))
    with open_installation() as here:
        place = _make_site(here, name, camera, water_level_m)
        refused = _import_samples(here, place, f"{name} boxes", samples)
        _import_drawn(here, place, name, samples, _size_px(camera))
    typer.echo(
        f"site {name!r}: {len(samples) - refused} photographs"
        + (f"; {left_out} of other cameras left out" if left_out else "")
    )
    typer.echo("with a worker running, fuse them with:")
    typer.echo(
        f"  quaymark run --viewport {place.viewport_id} --detector '{name} boxes' --preset paper "
        f"--set maximum_report_age_s={OLDEST_REPORT_S}"
    )
    if refused:
        raise AppError(f"{refused} of {len(samples)} photographs were refused")


def read_samples(folder: Path, camera: "Camera", start: datetime) -> tuple[list[Sample], int]:
    """Read all labels of a camera's photographs; also return how many belong to other cameras.

    Raises Invalid for a label that cannot be used or has no photograph, before anything is stored.
    """
    from app.published_boxes import Annotated as Annotated2d
    from app.published_boxes import refuse_unusable
    from app.published_files import boxes_of, read_label

    samples: list[Sample] = []
    left_out = 0
    for path in sorted((folder / "label").glob("*.json")):
        if not _is_of(camera, folder / "calib" / f"{path.stem}.txt"):
            left_out += 1
            continue
        photograph = _photograph(folder / "image", path)
        label = read_label(path)
        boxes = list(boxes_of(path, label.objects).values())
        drawn = None
        if label.boxes is not None:
            drawn = Annotated2d(photograph.name, label.boxes)
            refuse_unusable(str(path), drawn, *_size_px(camera))
        moment = start + len(samples) * APART
        samples.append(Sample(photograph, moment, boxes, label.vessels, drawn))
    if not samples:
        raise Invalid(f"{folder / 'label'}: there is no label of this camera")
    return samples, left_out


def _size_px(camera: "Camera") -> tuple[int, int]:
    return camera.intrinsics.width_px, camera.intrinsics.height_px


def _photograph(folder: Path, label: Path) -> Path:
    for suffix in SUFFIXES:
        if (found := folder / f"{label.stem}{suffix}").is_file():
            return found
    raise Invalid(f"{label}: its photograph {folder / label.stem}.jpg is missing")


def _is_of(camera: "Camera", calibration: Path) -> bool:
    import numpy as np

    if not calibration.exists():
        return True
    try:
        K = np.loadtxt(calibration)  # noqa: N806  the field's symbol
    except ValueError as error:
        raise Invalid(f"{calibration}: wanted are three rows of three numbers") from error
    return K.shape == (3, 3) and bool(np.abs(K - camera.intrinsics.K).max() <= SAME_K_PX)


def _make_site(here: "Installation", name: str, camera: "Camera", water_level_m: float) -> Place:
    """Make the site with its origin at the camera, the camera, and its registered viewport."""
    from app.domain.geodesy import EcefFrame, EnuFrame
    from app.registration import service as registration
    from app.registration.schemas import RegistrationIn, ViewportIn
    from app.sites import fields
    from app.sites import service as sites
    from app.sites.schemas import CameraIn, SiteIn
    from app.tables.registration import RegistrationMethod

    center = EcefFrame().geodetic(camera.center_in_world)
    origin = fields.Place(lat_deg=center.lat_deg, lon_deg=center.lon_deg, height_m=center.height_m)
    R_enu_from_ecef = EnuFrame(center).R_enu_from_ecef  # noqa: N806  the field's symbol
    with here.database.writing() as session:
        site = sites.create_site(
            session, SiteIn(name=name, origin=origin, water_level_m=water_level_m)
        )
        row = sites.create_camera(
            session,
            CameraIn(
                site_id=site.id,
                name="camera",
                width_px=camera.intrinsics.width_px,
                height_px=camera.intrinsics.height_px,
                K=camera.intrinsics.K.tolist(),
                distortion=camera.intrinsics.distortion.tolist(),
            ),
        )
        viewport = registration.create_viewport(
            session, ViewportIn(camera_id=row.id, name="viewport")
        )
    registration.register(
        here.database,
        viewport.id,
        RegistrationIn(
            method=RegistrationMethod.GIVEN,
            rotation=(camera.R_cam_from_world @ R_enu_from_ecef.T).tolist(),
            center=origin,
        ),
    )
    return Place(site.id, row.id, viewport.id)


def _import_samples(
    here: "Installation", place: Place, detector: str, samples: Sequence[Sample]
) -> int:
    """Store photographs, AIS reports and boxes; return how many photographs were refused."""
    from app.ais.service import import_ais_file
    from app.detectors.imported import import_coco_detections
    from app.imagery.service import Upload, store_image

    boxes: list[dict[str, object]] = []
    refused = 0
    for sample in samples:
        upload = Upload(sample.path.read_bytes(), sample.path.name, sample.captured_at)
        try:
            image, _ = store_image(
                here.database, here.storage, here.settings, place.camera_id, upload
            )
        except AppError as error:
            refused += 1
            typer.echo(f"refused {sample.path}: {error.detail}", err=True)
        else:
            boxes += [coco_result(image.id, box) for box in sample.boxes]
    import_ais_file(
        here.database,
        here.storage,
        io.BytesIO(ais_table(samples).encode()),
        site_id=place.site_id,
        file_name=f"{detector}.csv",
    )
    import_coco_detections(
        here.database, json.dumps(boxes).encode(), name=detector, camera_id=place.camera_id
    )
    return refused


def _import_drawn(
    here: "Installation",
    place: Place,
    name: str,
    samples: Sequence[Sample],
    size_px: tuple[int, int],
) -> None:
    """Store the boxes that people drew, as ground truth linked with the photographs."""
    from app.groundtruth import importing
    from app.groundtruth.coco_file import read_coco
    from app.published_boxes import SAID, gathered

    drawn = [sample.drawn for sample in samples if sample.drawn is not None]
    if not drawn:
        return
    data = gathered(drawn, *size_px)
    choices = importing.ImportChoices(f"{name} 2d_annotation_gt", SAID)
    with here.database.writing() as session:
        importing.store(
            session, place.site_id, importing.sha256_of(data), read_coco(data), choices, None
        )


def coco_result(image_id: int, box: "Detection") -> dict[str, object]:
    """Return a box as an entry of COCO's results format."""
    return {
        "image_id": image_id,
        "category_id": COCO_BOAT_CATEGORY,
        "bbox": [box.x1_px, box.y1_px, box.x2_px - box.x1_px, box.y2_px - box.y1_px],
        "score": box.score,
    }


def ais_table(samples: Sequence[Sample]) -> str:
    """Return all vessels as a plain AIS table, each heard as long before as its label says."""
    rows = [
        {
            "mmsi": pseudo_mmsi(str(vessel.identifier)),
            "time": (sample.captured_at - _age(vessel)).isoformat(),
            "lat": vessel.lat,
            "lon": vessel.long,
            "sog": vessel.speed,
            "heading": vessel.heading,
            **(vessel.size.model_dump() if vessel.size else {}),
            "name": vessel.identifier,
        }
        for sample in samples
        for vessel in sample.vessels
    ]
    table = io.StringIO()
    writer = csv.DictWriter(table, AIS_COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return table.getvalue()


def _age(vessel: "PublishedVessel") -> timedelta:
    return timedelta(seconds=vessel.secondsSinceLastPositionReport or 0.0)


def pseudo_mmsi(identifier: str) -> int:
    """Return a number that stands for a vessel; the same identifier always has the same."""
    digest = hashlib.sha256(identifier.encode()).digest()
    return FIRST_STAND_IN + int.from_bytes(digest[:8]) % STAND_INS
