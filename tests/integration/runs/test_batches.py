"""A batch's rows: many images in few statements, and still each pose with its own box and state."""

from typing import Any

import pytest
import sqlalchemy as sa

from app.db import Database
from app.domain.detection import Detection as Box
from app.runs import batch_repository as batches
from app.runs.outcome_repository import ImageOutcome, PoseRows
from app.tables.detection import Detection, DetectionSet
from app.tables.imagery import Image
from app.tables.runs import Match, Pose, Run, RunImage, RunStatus, VesselStateRow
from tests.factories.runs import CORNERS_PX, FIRST_MMSI, Harbour, make_harbour, make_run

MODEL, SETTINGS = "a" * 64, "b" * 64


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a registered viewport with four images."""
    with database.writing() as session:
        return make_harbour(session, images=4)


def start(database: Database, harbour: Harbour) -> int:
    """Store a run that is under way; returns its id."""
    with database.writing() as session:
        return make_run(session, harbour, status=RunStatus.RUNNING).id


def boxes(*scores: float) -> list[Box]:
    """Return boxes that are told apart by their scores."""
    return [Box(1.0, 2.0, 30.0, 40.0, score) for score in scores]


def state(vessel: int) -> dict[str, Any]:
    """Return the columns of a vessel's state."""
    return {
        "mmsi": FIRST_MMSI + vessel,
        "lat_deg": 53.5,
        "lon_deg": 9.9,
        "heading_deg": 90.0,
        "heading_source": "reported",
        "speed_kn": 5.0,
        "age_s": 1.0,
        "to_bow_m": 10.0,
        "to_stern_m": 10.0,
        "to_port_m": 2.0,
        "to_starboard_m": 2.0,
        "report_ids": [vessel],
        "outcome": "matched",
        "segments_px": {"reported": [None] * 4, "dead_reckoned": [None] * 4},
    }


def pose(vessel: int, *, box: int) -> PoseRows:
    """Return a vessel's pose, made of a box and its state."""
    return PoseRows(
        detection_index=box,
        cost=0.1,
        cost_terms={"score": 0.5},
        pose={
            "mmsi": FIRST_MMSI + vessel,
            "lat_deg": 53.5,
            "lon_deg": 9.9,
            "center_height_m": 4.0,
            "heading_deg": 90.0,
            "centroid_in_cam_m": [0.0, 0.0, 100.0],
            "rotvec_cam_from_vessel": [0.0, 0.0, 0.0],
            "length_m": 20.0,
            "width_m": 4.0,
            "height_m": 5.0,
            "corners_in_image_px": CORNERS_PX,
            "corrected_segment_px": CORNERS_PX[:4],
            "correction_in_enu_m": [0.0, 0.0, 0.0],
            "flags": [],
        },
    )


def outcome(
    image: Image,
    found: list[Box] | None,
    vessels: list[int],
    poses: list[PoseRows],
    **changes: Any,
) -> ImageOutcome:
    """Return what came of an image."""
    fields = {
        "image_id": image.id,
        "image_sha256": image.sha256,
        "detection_set_id": None,
        "new_boxes": found,
        "states": [state(vessel) for vessel in vessels],
        "poses": poses,
    }
    return ImageOutcome(**(fields | changes))


def store(database: Database, run_id: int, *outcomes: ImageOutcome) -> None:
    """Store a batch as a worker does."""
    with database.writing() as session:
        batches.store(session, run_id, MODEL, SETTINGS, outcomes)


def links(database: Database, run_id: int) -> list[tuple[int, int, float, int, int]]:
    """Return each pose's image and vessel, its box's score, its state's vessel and image."""
    with database.reading() as session:
        rows = session.execute(
            sa.select(
                Pose.image_id,
                Pose.mmsi,
                Detection.score,
                VesselStateRow.mmsi,
                VesselStateRow.image_id,
            )
            .join(Match, Match.id == Pose.match_id)
            .join(Detection, Detection.id == Match.detection_id)
            .join(VesselStateRow, VesselStateRow.id == Match.vessel_state_id)
            .where(Pose.run_id == run_id)
            .order_by(Pose.id)
        )
        return [tuple(row) for row in rows]


def test_each_pose_has_its_own_box_and_state(database: Database, harbour: Harbour) -> None:
    """Whatever the images before it held, nothing of another image gets into a pose."""
    run_id = start(database, harbour)
    first, second, third, fourth = harbour.images
    store(
        database,
        run_id,
        outcome(
            first,
            boxes(0.9, 0.8, 0.7),
            [0, 1, 2],
            [pose(2, box=0), pose(0, box=2)],
        ),
        outcome(second, None, [], [], error="the image cannot be decoded"),
        outcome(third, [], [1], []),
        outcome(fourth, boxes(0.6, 0.5), [1, 3], [pose(3, box=1)]),
    )
    vessel = [FIRST_MMSI + number for number in range(4)]
    assert links(database, run_id) == [
        (first.id, vessel[2], 0.9, vessel[2], first.id),
        (first.id, vessel[0], 0.7, vessel[0], first.id),
        (fourth.id, vessel[3], 0.5, vessel[3], fourth.id),
    ]
    with database.reading() as session:
        rows = session.scalars(
            sa.select(RunImage).where(RunImage.run_id == run_id).order_by(RunImage.position)
        ).all()
        assert session.scalar(sa.select(sa.func.count()).select_from(VesselStateRow)) == 6
    assert all(row.done_at is not None for row in rows)
    assert [row.error for row in rows] == [None, "the image cannot be decoded", None, None]
    assert [row.detection_set_id is None for row in rows] == [False, True, False, False]


def test_boxes_another_run_stored_meanwhile_are_taken(database: Database, harbour: Harbour) -> None:
    """A run that detected the same at the same time refers to the boxes that came first."""
    first, second = harbour.images[:2]
    runs = [start(database, harbour) for _ in range(2)]
    store(database, runs[0], outcome(first, boxes(0.9), [0], [pose(0, box=0)]))
    store(
        database,
        runs[1],
        outcome(first, boxes(0.9), [0], [pose(0, box=0)]),
        outcome(second, boxes(0.8), [1], [pose(1, box=0)]),
    )
    assert [link[2] for link in links(database, runs[1])] == [0.9, 0.8]
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(DetectionSet)) == 2
        assert session.scalar(sa.select(sa.func.count()).select_from(Detection)) == 2


def test_known_boxes_are_referred_to(database: Database, harbour: Harbour) -> None:
    """An outcome that rests on a set already there stores no boxes and points to it."""
    image = harbour.images[0]
    runs = [start(database, harbour) for _ in range(2)]
    store(database, runs[0], outcome(image, boxes(0.9, 0.8), [], []))
    with database.reading() as session:
        known = batches.known_detections(session, [image.sha256], MODEL, SETTINGS)[image.sha256]
    store(
        database,
        runs[1],
        outcome(image, None, [4], [pose(4, box=1)], detection_set_id=known.id),
    )
    assert [link[2] for link in links(database, runs[1])] == [0.8]


def test_an_empty_batch_is_nothing(database: Database, harbour: Harbour) -> None:
    """A batch whose images were all done before stores nothing and fails nothing."""
    run_id = start(database, harbour)
    store(database, run_id)
    with database.reading() as session:
        done = sa.select(sa.func.count(RunImage.done_at)).where(RunImage.run_id == run_id)
        assert session.scalar(done) == 0


def test_a_run_that_ended_is_not_ended_again(database: Database, harbour: Harbour) -> None:
    """A cancelled run stays cancelled, whatever its job says later."""
    run_id = start(database, harbour)
    with database.writing() as session:
        batches.finish(session, run_id, RunStatus.CANCELLED)
        batches.finish(session, run_id, RunStatus.SUCCEEDED)
        workflow_id = session.get_one(Run, run_id).workflow_id
        batches.fail_job(session, workflow_id, "its worker died")
        batches.fail_job(session, "no job of a run", "its worker died")
    with database.reading() as session:
        run = session.get_one(Run, run_id)
    assert (run.status, run.error) == (RunStatus.CANCELLED, None)
