"""A thousand poses as they were read, and the tables and records that are made of them.

Reading and making are apart, so that another process can make and write while the next poses are
read (see `app.exports.second_hand`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import starmap
from operator import attrgetter
from typing import Any, NamedTuple

import orjson

from app.domain.rotations import matrices_from_rotvecs
from app.exports.writers.pose_table import PoseTable
from app.exports.writers.records import ImageRecord, PoseRecord, ReviewRecord, ViewRecord
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
_IMAGE_FIELDS, _REVIEW_FIELDS = (
    attrgetter(*(field.name for field in fields(each))) for each in (ImageRecord, ReviewRecord)
)


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
    """Poses and what belongs to them: cameras by run, photographs, verdicts by pose."""

    first: int
    columns: PoseColumns
    views: Mapping[int, ViewRecord]
    images: Mapping[int, ImageRecord]
    vessels: Sequence[str]
    reviews: Mapping[int, ReviewRecord]
    parts: Sequence[str] | None

    def __reduce__(self) -> tuple[object, ...]:
        """Go to another process as plain values, which takes half the time of records."""
        images, reviews = self.images.values(), self.reviews.values()
        return _received, (
            self.first,
            tuple(self.columns),
            self.views,
            list(map(_IMAGE_FIELDS, images)),
            self.vessels,
            list(self.reviews),
            list(map(_REVIEW_FIELDS, reviews)),
            self.parts,
        )


def _received(
    first: int,
    columns: Sequence[Any],
    views: Mapping[int, ViewRecord],
    images: Sequence[tuple[Any, ...]],
    vessels: Sequence[str],
    reviewed: Sequence[int],
    reviews: Sequence[tuple[Any, ...]],
    parts: Sequence[str] | None,
) -> Batch:
    return Batch(
        first=first,
        columns=PoseColumns(*columns),
        views=views,
        images={image[0]: ImageRecord(*image) for image in images},
        vessels=vessels,
        reviews=dict(zip(reviewed, starmap(ReviewRecord, reviews), strict=True)),
        parts=parts,
    )


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
    return PoseTable(
        first=batch.first,
        ids=of.id,
        run_ids=of.run_id,
        registration_ids=[registrations[run] for run in of.run_id],
        viewport_ids=[viewports[run] for run in of.run_id],
        images=[batch.images[image] for image in of.image_id],
        vessels=batch.vessels,
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
        reviews=list(map(batch.reviews.get, of.id)),
        sources=[_SOURCES.get(by, str(by)) for by in of.person_made],
        parts=[None] * len(of.id) if batch.parts is None else batch.parts,
    )


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
