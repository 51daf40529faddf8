"""Verdicts that hold in a new run: for poses of the same box and vessel that hardly moved."""

from collections.abc import Callable
from typing import Any

import pytest
import sqlalchemy as sa

from app.db import Database
from app.domain.detection import Detection as Box
from app.runs import batch_repository as batches
from app.runs.outcome_repository import ImageOutcome, PoseRows
from app.tables.identity import User
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose, RunStatus
from tests.factories.runs import (
    CORNERS_PX,
    FIRST_MMSI,
    Harbour,
    make_harbour,
    make_review,
    make_run,
)

MODEL, SETTINGS = "a" * 64, "b" * 64
M_PER_DEG_NORTH = 111_300


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a registered viewport with one image."""
    with database.writing() as session:
        return make_harbour(session)


def run_over(
    database: Database, harbour: Harbour, *, vessel: int = 0, **moved: float
) -> tuple[int, int]:
    """Store a run whose one pose is of the image's one box; returns run and pose."""
    with database.writing() as session:
        run_id = make_run(session, harbour, status=RunStatus.RUNNING).id
        image = harbour.images[0]
        known = batches.known_detections(session, [image.sha256], MODEL, SETTINGS)
        found = known.get(image.sha256)
        outcome = ImageOutcome(
            image.id,
            image.sha256,
            found.id if found else None,
            None if found else [Box(1.0, 2.0, 30.0, 40.0, 0.9)],
            [_state(vessel)],
            [PoseRows(0, 0.1, {"score": 0.9}, _pose(vessel, **moved))],
        )
        batches.store(session, run_id, MODEL, SETTINGS, [outcome])
        pose_id = session.scalars(sa.select(Pose.id).where(Pose.run_id == run_id)).one()
        return run_id, pose_id


def _state(vessel: int) -> dict[str, Any]:
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
        "report_ids": [],
        "outcome": "matched",
        "segments_px": {},
    }


def _pose(vessel: int, north: float = 0, up: float = 0, turn: float = 0) -> dict[str, Any]:
    return {
        "mmsi": FIRST_MMSI + vessel,
        "lat_deg": 53.5 + north / M_PER_DEG_NORTH,
        "lon_deg": 9.9,
        "center_height_m": 4.0 + up,
        "heading_deg": (359.5 + turn) % 360,
        "centroid_in_cam_m": [0.0, 0.0, 100.0],
        "rotvec_cam_from_vessel": [0.0, 0.0, 0.0],
        "length_m": 20.0,
        "width_m": 4.0,
        "height_m": 5.0,
        "corners_in_image_px": CORNERS_PX,
        "corrected_segment_px": CORNERS_PX[:4],
        "correction_in_enu_m": [0.0, 0.0, 0.0],
        "flags": [],
    }


def grade(database: Database, pose_id: int, user: User, grade: Grade, **columns: object) -> int:
    """Store a verdict; returns its id."""
    with database.writing() as session:
        pose = session.get_one(Pose, pose_id)
        return make_review(session, pose, user.id, grade, **columns).id


def reviews(database: Database, pose_id: int) -> list[Review]:
    """Return the reviews of a pose."""
    with database.reading() as session:
        return list(
            session.scalars(sa.select(Review).where(Review.pose_id == pose_id).order_by(Review.id))
        )


def test_a_pose_that_hardly_moved_inherits_its_verdicts(
    database: Database, harbour: Harbour, make_user: Callable[..., User]
) -> None:
    """What each person said comes along, marked, with when and under which guideline."""
    ada, ben = make_user("reviewer"), make_user("reviewer")
    _, first = run_over(database, harbour)
    said = grade(database, first, ada, Grade.OK, reasons=["heading"], guideline_version=7)
    grade(database, first, ben, Grade.BAD, second_opinion=True)
    _, second = run_over(database, harbour, north=0.3, up=0.3, turn=1.9)
    before, after = reviews(database, first), reviews(database, second)
    assert [(one.grade, one.user_id, one.second_opinion) for one in after] == [
        (Grade.OK, ada.id, False),
        (Grade.BAD, ben.id, True),
    ]
    assert (after[0].inherited_from_id, after[0].reasons) == (said, ["heading"])
    assert (after[0].guideline_version, after[0].created_at) == (7, before[0].created_at)


@pytest.mark.parametrize(
    "moved",
    [{"north": 0.51}, {"up": -0.51}, {"north": 0.4, "up": 0.4}, {"turn": 2.1}, {"vessel": 1}],
)
def test_another_pose_is_judged_anew(
    database: Database, harbour: Harbour, make_user: Callable[..., User], moved: dict[str, Any]
) -> None:
    """Half a metre, two degrees or another vessel is another pose."""
    _, first = run_over(database, harbour)
    grade(database, first, make_user("reviewer"), Grade.GOOD)
    _, second = run_over(database, harbour, **moved)
    assert reviews(database, second) == []


def test_small_moves_do_not_add_up(
    database: Database, harbour: Harbour, make_user: Callable[..., User]
) -> None:
    """A verdict is inherited from who judged, not from who inherited; the newest word counts."""
    ada = make_user("reviewer")
    _, first = run_over(database, harbour)
    grade(database, first, ada, Grade.GOOD)
    _, second = run_over(database, harbour, north=0.3)
    assert len(reviews(database, second)) == 1
    _, third = run_over(database, harbour, north=0.6)
    assert reviews(database, third) == []
    grade(database, third, ada, Grade.BAD)
    _, fourth = run_over(database, harbour, north=0.4)
    assert [one.grade for one in reviews(database, fourth)] == [Grade.BAD]
