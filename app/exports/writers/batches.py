"""A thousand poses as they were read, and the tables and records that are made of them.

Reading and making are apart, so that another process can make and write while the next poses are
read (see `app.exports.second_hand`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import orjson

from app.domain.rotations import matrices_from_rotvecs
from app.exports.writers.pose_table import PoseTable
from app.exports.writers.records import Identities, ImageRecord, PoseRecord, ViewRecord
from app.exports.writers.stored_values import image_record, review_records
from app.garbage import collection_paused

# Writes poses: pure, and known by its name.
Lines = Callable[[PoseTable], bytes]
_SOURCES: Mapping[bool | str, str] = {False: "generated", True: "person_made"}
# Numbers of which Postgres' JSON keeps no point and no exponent: 1e16 is 17 digits there.
_LARGE = 1e16
_SHAPES = (
    bytes(
        ord("0") if chr(code).isdigit() else ord(" ") if chr(code) in " -[" else ord(".")
        for code in range(128)
    )
    + b"." * 128
)
_LARGE_SHAPE = b" " + b"0" * 17


class PoseColumns(NamedTuple):
    """Poses with boxes, costs and states by id, column by column; lists are still JSON texts.

    Where a person corrected one, `person_made` says how.
    """

    id: Sequence[int]
    run_id: Sequence[int]
    image_id: Sequence[int]
    mmsi: Sequence[int]
    x1_px: Sequence[float]
    y1_px: Sequence[float]
    x2_px: Sequence[float]
    y2_px: Sequence[float]
    score: Sequence[float]
    cost: Sequence[float]
    lat_deg: Sequence[float]
    lon_deg: Sequence[float]
    center_height_m: Sequence[float]
    heading_deg: Sequence[float]
    heading_source: Sequence[str]
    report_age_s: Sequence[float]
    length_m: Sequence[float]
    width_m: Sequence[float]
    height_m: Sequence[float]
    heading_sigma_deg: Sequence[float | None]
    height_sigma_m: Sequence[float | None]
    person_made: Sequence[bool | str]
    centroid_in_cam_m: Sequence[str]
    rotvec_cam_from_vessel: Sequence[str]
    corners_in_image_px: Sequence[str]
    correction_in_enu_m: Sequence[str]
    position_covariance_in_enu_m2: Sequence[str]
    flags: Sequence[str]


class Corrected(NamedTuple):
    """A pose as a person would have it; lists are JSON texts."""

    kind: str
    mmsi: int
    lat_deg: float
    lon_deg: float
    center_height_m: float
    heading_deg: float
    length_m: float
    width_m: float
    height_m: float
    cost: float | None
    centroid_in_cam_m: str
    rotvec_cam_from_vessel: str
    corners_in_image_px: str
    flags: str


@dataclass(frozen=True, slots=True)
class Batch:
    """Poses and what belongs to them: cameras by run, rows of photographs and of verdicts.

    The photographs' numbers are in the order of their rows. `told` says by site what stands for
    vessels; it is the same for all batches, and another process has it already.
    """

    first: int
    columns: PoseColumns
    views: Mapping[int, ViewRecord]
    images: Sequence[Any]
    numbers: Sequence[int]
    reviews: Sequence[Any]
    parts: Sequence[str] | None
    told: Mapping[int, Identities]


def put_right(columns: PoseColumns, corrections: Mapping[int, Corrected]) -> PoseColumns:
    """Put people's boxes in place of generated ones; how sure those were says nothing now."""
    if not corrections:
        return columns
    right = {name: list(column) for name, column in columns._asdict().items()}
    for place, pose_id in enumerate(columns.id):
        corrected = corrections.get(pose_id)
        if corrected is None:
            continue
        for name, value in corrected._asdict().items():
            if name != "kind" and value is not None:
                right[name][place] = value
        right["person_made"][place] = corrected.kind
        right["position_covariance_in_enu_m2"][place] = "null"
        right["heading_sigma_deg"][place] = right["height_sigma_m"][place] = None
        if corrected.kind == "edited":
            right["heading_source"][place] = "person"
    return PoseColumns(**right)


def lines_of(batch: Batch, write: Lines) -> bytes:
    """Return what a writer makes of a batch."""
    with collection_paused():
        return write(table_of(batch))


def table_of(batch: Batch) -> PoseTable:
    """Return a batch as writers get it. Raises ValueError for a pose without a whole rotation."""
    of = batch.columns
    rotvecs = parsed(of.rotvec_cam_from_vessel)
    rotations = matrices_from_rotvecs(rotvecs)
    if len(rotations) != len(of.id):
        raise ValueError(f"a pose from {of.id[0]} to {of.id[-1]} has no whole rotation")
    registrations = {run: view.registration_id for run, view in batch.views.items()}
    viewports = {run: view.viewport_id for run, view in batch.views.items()}
    images, reviews = _images(batch), review_records(batch.reviews)
    return PoseTable(
        first=batch.first,
        ids=of.id,
        run_ids=of.run_id,
        registration_ids=[registrations[run] for run in of.run_id],
        viewport_ids=[viewports[run] for run in of.run_id],
        images=[images[image] for image in of.image_id],
        vessels=_vessels(batch),
        boxes_px=list(zip(of.x1_px, of.y1_px, of.x2_px, of.y2_px, strict=True)),
        scores=of.score,
        costs=of.cost,
        centroids_in_cam_m=parsed(of.centroid_in_cam_m),
        rotations_cam_from_vessel=rotations,
        rotvecs_cam_from_vessel=rotvecs,
        lats_deg=of.lat_deg,
        lons_deg=of.lon_deg,
        center_heights_m=of.center_height_m,
        headings_deg=of.heading_deg,
        heading_sources=of.heading_source,
        report_ages_s=of.report_age_s,
        lengths_m=of.length_m,
        widths_m=of.width_m,
        heights_m=of.height_m,
        corners_in_image_px=parsed(of.corners_in_image_px),
        corrections_in_enu_m=parsed(of.correction_in_enu_m),
        position_covariances_in_enu_m2=parsed(of.position_covariance_in_enu_m2),
        heading_sigmas_deg=of.heading_sigma_deg,
        height_sigmas_m=of.height_sigma_m,
        flags=parsed(of.flags),
        reviews=list(map(reviews.get, of.id)),
        sources=[_SOURCES.get(by, str(by)) for by in of.person_made],
        parts=[None] * len(of.id) if batch.parts is None else batch.parts,
    )


def _images(batch: Batch) -> dict[int, ImageRecord]:
    run_of_image = dict(zip(batch.columns.image_id, batch.columns.run_id, strict=True))
    told = {image: batch.told[batch.views[run].site_id] for image, run in run_of_image.items()}
    rows = zip(batch.images, batch.numbers, strict=True)
    return {row[0]: image_record(row, number, told[row[0]]) for row, number in rows}


def _vessels(batch: Batch) -> list[str]:
    """Return what stands for each pose's vessel."""
    pairs = list(zip(batch.columns.run_id, batch.columns.mmsi, strict=True))
    stands = {
        (run, mmsi): batch.told[batch.views[run].site_id].vessel(mmsi) for run, mmsi in set(pairs)
    }
    return [stands[pair] for pair in pairs]


def records_of(batch: Batch) -> list[PoseRecord]:
    """Return a batch pose by pose."""
    with collection_paused():
        table = table_of(batch)
        return list(
            map(
                PoseRecord,
                table.ids,
                table.run_ids,
                map(batch.views.__getitem__, table.run_ids),
                table.images,
                table.vessels,
                table.boxes_px,
                table.scores,
                table.costs,
                table.centroids_in_cam_m,
                table.rotations_cam_from_vessel.tolist(),
                table.rotvecs_cam_from_vessel,
                table.lats_deg,
                table.lons_deg,
                table.center_heights_m,
                table.headings_deg,
                table.heading_sources,
                table.report_ages_s,
                table.lengths_m,
                table.widths_m,
                table.heights_m,
                table.corners_in_image_px,
                table.corrections_in_enu_m,
                table.position_covariances_in_enu_m2,
                table.heading_sigmas_deg,
                table.height_sigmas_m,
                table.flags,
                table.reviews,
                table.sources,
                table.parts,
            )
        )


def parsed(texts: Iterable[str]) -> list[Any]:
    """Return what JSON texts say, the same of both databases.

    Postgres keeps no sign of a zero, so none is kept here, and writes large numbers as whole ones.
    """
    text = "[" + ",".join(texts) + "]"
    values: list[Any] = orjson.loads(text.replace("-0.0,", "0.0,").replace("-0.0]", "0.0]"))
    from_postgres = ", " in text[:200]
    if from_postgres and _LARGE_SHAPE in text.encode().translate(_SHAPES):
        return [_with_points(value) for value in values]
    return values


def _with_points(value: Any) -> Any:  # noqa: ANN401  whatever JSON holds
    """Return a JSON value whose large whole numbers are floats, at every depth."""
    if isinstance(value, list):
        return [_with_points(each) for each in value]
    return float(value) if isinstance(value, int) and abs(value) >= _LARGE else value
