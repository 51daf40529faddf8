"""A few thousand poses as they were read, and the records that are made of them.

Reading and making are apart, so that another process can make and write while the next poses are
read (see `app.exports.second_hand`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import Any, NamedTuple

import orjson

from app.domain.rotations import matrices_from_rotvecs
from app.exports.writers.records import ImageRecord, PoseRecord, ReviewRecord, ViewRecord
from app.garbage import collection_paused

# Writes poses, of which the first has a number, counted from 0: pure, and known by its name.
Lines = Callable[[int, Sequence[PoseRecord]], bytes]


class PoseColumns(NamedTuple):
    """Poses with boxes, costs and states by id, column by column; lists are still JSON texts."""

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
    person_made: Sequence[bool]
    centroid_in_cam_m: Sequence[str]
    rotvec_cam_from_vessel: Sequence[str]
    corners_in_image_px: Sequence[str]
    correction_in_enu_m: Sequence[str]
    position_covariance_in_enu_m2: Sequence[str]
    flags: Sequence[str]


class Corrected(NamedTuple):
    """A pose as a person would have it."""

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
    centroid_in_cam_m: list[float]
    rotvec_cam_from_vessel: list[float]
    corners_in_image_px: list[list[float] | None]
    flags: list[str]


@dataclass(frozen=True, slots=True)
class Batch:
    """Poses and what belongs to them: cameras by run, photographs, verdicts, corrections by id."""

    first: int
    columns: PoseColumns
    views: Mapping[int, ViewRecord]
    images: Mapping[int, ImageRecord]
    vessels: Sequence[str]
    reviews: Mapping[int, ReviewRecord]
    parts: Sequence[str] | None
    corrections: Mapping[int, Corrected]


def lines_of(batch: Batch, write: Lines) -> bytes:
    """Return what a writer makes of a batch."""
    return write(batch.first, records_of(batch))


def records_of(batch: Batch) -> list[PoseRecord]:
    """Put records together; what a person corrected takes the place of what was generated.

    Column by column: a loop over rows would cost twice as much.
    """
    with collection_paused():
        of, corrections = batch.columns, batch.corrections
        centroids, rotvecs = parsed(of.centroid_in_cam_m), parsed(of.rotvec_cam_from_vessel)
        for number, pose_id in enumerate(of.id) if corrections else ():
            if pose_id in corrections:
                centroids[number] = corrections[pose_id].centroid_in_cam_m
                rotvecs[number] = corrections[pose_id].rotvec_cam_from_vessel
        parts: Iterable[str | None] = repeat(None) if batch.parts is None else batch.parts
        poses = list(
            map(
                PoseRecord,
                of.id,
                of.run_id,
                map(batch.views.__getitem__, of.run_id),
                map(batch.images.__getitem__, of.image_id),
                batch.vessels,
                zip(of.x1_px, of.y1_px, of.x2_px, of.y2_px, strict=True),
                of.score,
                of.cost,
                centroids,
                matrices_from_rotvecs(rotvecs).tolist(),
                rotvecs,
                of.lat_deg,
                of.lon_deg,
                of.center_height_m,
                of.heading_deg,
                of.heading_source,
                of.report_age_s,
                of.length_m,
                of.width_m,
                of.height_m,
                parsed(of.corners_in_image_px),
                parsed(of.correction_in_enu_m),
                parsed(of.position_covariance_in_enu_m2),
                of.heading_sigma_deg,
                of.height_sigma_m,
                parsed(of.flags),
                map(batch.reviews.get, of.id),
                ("person_made" if by_person else "generated" for by_person in of.person_made),
                parts,
            )
        )
        if len(poses) != len(of.id):
            raise ValueError(f"a pose from {of.id[0]} to {of.id[-1]} has no whole rotation")
        for pose in poses if corrections else ():
            if pose.id in corrections:
                _put_right(pose, corrections[pose.id])
        return poses


def parsed(texts: Iterable[str]) -> list[Any]:
    """Return what JSON texts say. Postgres keeps no sign of a zero, so none is kept here."""
    text = "[" + ",".join(texts) + "]"
    values: list[Any] = orjson.loads(text.replace("-0.0,", "0.0,").replace("-0.0]", "0.0]"))
    return values


def _put_right(pose: PoseRecord, corrected: Corrected) -> None:
    """Put a person's box in place of the generated one; how sure that one was says nothing now."""
    pose.source = corrected.kind
    pose.lat_deg, pose.lon_deg = corrected.lat_deg, corrected.lon_deg
    pose.center_height_m, pose.heading_deg = corrected.center_height_m, corrected.heading_deg
    pose.length_m, pose.width_m = corrected.length_m, corrected.width_m
    pose.height_m = corrected.height_m
    pose.corners_in_image_px = corrected.corners_in_image_px
    pose.flags = corrected.flags
    pose.position_covariance_in_enu_m2 = None
    pose.heading_sigma_deg = pose.height_sigma_m = None
    if corrected.cost is not None:
        pose.cost = corrected.cost
    if corrected.kind == "edited":
        pose.heading_source = "person"
