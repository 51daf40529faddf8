"""Many poses at once, in a statement a table: figures are tested with as many as they are about."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from datetime import timedelta
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import Base, now
from app.tables.detection import Detection, DetectionSet
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.reviews import (
    Grade,
    ImageCompletion,
    MissedReason,
    MissedVessel,
    Review,
)
from app.tables.runs import Match, Pose, Run, RunImage, VesselStateRow
from tests.factories.imagery import NOON
from tests.factories.runs import CORNERS_PX, FIRST_MMSI, Harbour, make_harbour, make_run

Rows = list[dict[str, Any]]


def make_large_run(
    session: Session, images: int, poses: int, **site_columns: object
) -> tuple[Run, list[int], list[int]]:
    """Insert a finished run; its poses are dealt out to the images in turn.

    Returns the run, the ids of the images and those of the poses.
    """
    harbour = make_harbour(session, images=0, **site_columns)
    image_ids = _add(session, Image, _images(harbour, images))
    run = make_run(session, harbour, image_count=images)
    _fill(
        session,
        RunImage,
        [
            {"run_id": run.id, "image_id": image_id, "position": position, "done_at": now()}
            for position, image_id in enumerate(image_ids)
        ],
    )
    sets = _add(
        session,
        DetectionSet,
        [
            {
                "image_sha256": _sha(f"image {image_id}"),
                "model_sha256": harbour.model.sha256,
                "settings_sha256": _sha("settings"),
            }
            for image_id in image_ids
        ],
    )
    places = [divmod(number, images)[::-1] for number in range(poses)]
    states = _add(
        session,
        VesselStateRow,
        [_state(run.id, image_ids[image], FIRST_MMSI + turn) for image, turn in places],
    )
    detections = _add(session, Detection, [_detection(sets[image]) for image, _ in places])
    matches = _add(
        session,
        Match,
        [
            {
                "run_id": run.id,
                "detection_id": detection,
                "vessel_state_id": state,
                "cost": 0.1,
                "cost_terms": {},
            }
            for detection, state in zip(detections, states, strict=True)
        ],
    )
    pose_ids = _add(
        session,
        Pose,
        [
            _pose(run.id, image_ids[image], match, FIRST_MMSI + turn, number)
            for number, ((image, turn), match) in enumerate(zip(places, matches, strict=True))
        ],
    )
    return run, image_ids, pose_ids


def grade_many(
    session: Session,
    pose_ids: Sequence[int],
    verdicts: Sequence[tuple[Grade, Sequence[str]]],
    user_id: int | None,
    **columns: object,
) -> None:
    """Insert a standing review of each pose."""
    rows = [
        {
            "pose_id": pose_id,
            "user_id": user_id,
            "grade": grade,
            "reasons": list(reasons),
            "guideline_version": 1,
        }
        | columns
        for pose_id, (grade, reasons) in zip(pose_ids, verdicts, strict=True)
    ]
    _fill(session, Review, rows)


def complete_many(session: Session, run_id: int, image_ids: Sequence[int]) -> None:
    """Mark images of a run complete."""
    _fill(
        session,
        ImageCompletion,
        [{"run_id": run_id, "image_id": image_id} for image_id in image_ids],
    )


def miss_many(
    session: Session, run_id: int, image_id: int, counts: Mapping[MissedReason, int]
) -> None:
    """Mark so many vessels of an image as missed."""
    box = {"x1_px": 1.0, "y1_px": 2.0, "x2_px": 9.0, "y2_px": 8.0}
    _fill(
        session,
        MissedVessel,
        [
            {"run_id": run_id, "image_id": image_id, "reason": reason, "version": 1} | box
            for reason, count in counts.items()
            for _ in range(count)
        ],
    )


def _fill(session: Session, table: type[Base], rows: Rows) -> None:
    if rows:
        session.execute(sa.insert(table), rows)


def _add(session: Session, table: type[Base], rows: Rows) -> list[int]:
    """Insert rows and return their ids in the same order."""
    if not rows:
        return []
    identifier = table.__table__.c.id
    statement = sa.insert(table).returning(identifier, sort_by_parameter_order=True)
    return list(session.scalars(statement, rows))


def _images(harbour: Harbour, count: int) -> Rows:
    return list(_each_image(harbour, count))


def _each_image(harbour: Harbour, count: int) -> Iterator[dict[str, Any]]:
    for number in range(count):
        captured_at = NOON + timedelta(minutes=number)
        yield {
            "site_id": harbour.site.id,
            "camera_id": harbour.camera.id,
            "viewport_id": harbour.viewport.id,
            "sha256": _sha(f"{harbour.camera.id} {number}"),
            "media_type": "image/jpeg",
            "file_name": f"{captured_at:%Y%m%d_%H%M%S}.jpg",
            "size_bytes": 1000,
            "width_px": 64,
            "height_px": 48,
            "captured_at": captured_at,
            "captured_at_source": CaptureTimeSource.GIVEN,
        }


def _state(run_id: int, image_id: int, mmsi: int) -> dict[str, Any]:
    return {
        "run_id": run_id,
        "image_id": image_id,
        "mmsi": mmsi,
        "lat_deg": 53.5425,
        "lon_deg": 9.984,
        "heading_deg": 90.0,
        "heading_source": "reported",
        "speed_kn": 5.5,
        "age_s": 12.0,
        "to_bow_m": 60.0,
        "to_stern_m": 20.0,
        "to_port_m": 6.0,
        "to_starboard_m": 6.0,
        "report_ids": [1],
        "outcome": "matched",
        "segments_px": {"reported": CORNERS_PX[:4], "dead_reckoned": CORNERS_PX[:4]},
    }


def _detection(set_id: int) -> dict[str, Any]:
    box = {"x1_px": 10.0, "y1_px": 12.0, "x2_px": 40.0, "y2_px": 30.0}
    return {"detection_set_id": set_id, "score": 0.5, "class_id": 8} | box


def _pose(run_id: int, image_id: int, match_id: int, mmsi: int, number: int) -> dict[str, Any]:
    return {
        "run_id": run_id,
        "image_id": image_id,
        "match_id": match_id,
        "mmsi": mmsi,
        "lat_deg": 53.5425 + (number % 50) * 1e-4,
        "lon_deg": 9.984,
        "center_height_m": 45.5,
        "heading_deg": float(number * 7 % 360),
        "centroid_in_cam_m": [1.5, -2.5, 300.0],
        "rotvec_cam_from_vessel": [0.0, 0.0, 0.5],
        "length_m": 80.0,
        "width_m": 12.0,
        "height_m": 9.25,
        "corners_in_image_px": CORNERS_PX,
        "corrected_segment_px": CORNERS_PX[:4],
        "correction_in_enu_m": [0.25, -0.5, 2.0],
        "flags": [],
    }


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
