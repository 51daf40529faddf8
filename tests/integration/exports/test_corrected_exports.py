"""Exports of poses as generated, or as people corrected them."""

import io
import json
from collections.abc import Callable
from typing import Any

import pytest

from app.db import Database, now
from app.exports.making import write_export
from app.tables.exports import Export
from app.tables.identity import User
from app.tables.reviews import Correction, CorrectionKind
from app.tables.runs import Pose
from tests.factories.runs import CORNERS_PX, FIRST_MMSI, Harbour, make_pose, make_run, make_vessel

NEW_MMSI = FIRST_MMSI + 5


def correction(pose: Pose, version: int, user: User, **changed: object) -> Correction:
    """Return a correction of a pose."""
    values: dict[str, object] = {
        "pose_id": pose.id,
        "version": version,
        "kind": CorrectionKind.EDITED,
        "user_id": user.id,
        "mmsi": pose.mmsi,
        "lat_deg": 53.6,
        "lon_deg": 9.9,
        "base_height_m": 40.0,
        "center_height_m": 45.0,
        "heading_deg": 45.0,
        "length_m": 81.0,
        "width_m": 12.5,
        "height_m": 10.0,
        "centroid_in_cam_m": [1.0, 2.0, 301.0],
        "rotvec_cam_from_vessel": [0.0, 0.0, 0.25],
        "corners_in_image_px": [[point + 1 for point in corner] for corner in CORNERS_PX if corner],
        "flags": [],
    }
    return Correction(**(values | changed))


@pytest.fixture
def run_id(database: Database, harbour: Harbour, make_user: Callable[..., User]) -> int:
    """Give a run's poses: edited twice, correction deleted, re-matched, person's, untouched."""
    ada = make_user("reviewer")
    with database.writing() as session:
        run = make_run(session, harbour)
        edited, undone, rematched = (
            make_pose(session, run, harbour.images[0], FIRST_MMSI + i) for i in range(3)
        )
        make_pose(session, run, harbour.images[1], FIRST_MMSI, person_made=True)
        make_pose(session, run, harbour.images[2], FIRST_MMSI)
        make_vessel(session, NEW_MMSI, "SECRETIA")
        session.add_all(
            [
                correction(edited, 1, ada, heading_deg=10.0),
                correction(edited, 2, ada),
                correction(undone, 2, ada, deleted_at=now()),
                correction(
                    rematched,
                    1,
                    ada,
                    kind=CorrectionKind.REMATCHED,
                    mmsi=NEW_MMSI,
                    cost=0.75,
                    flags=["cut_top"],
                ),
            ]
        )
        return run.id


def exported(database: Database, run_id: int, **filters: str) -> list[dict[str, Any]]:
    """Return the poses of an export."""
    asked = Export(
        format="ndjson", filters={"run_id": run_id, **filters}, site_ids=None, anonymise=False
    )
    target = io.BytesIO()
    write_export(database, asked, target)
    lines = [json.loads(line) for line in target.getvalue().splitlines()]
    return [line for line in lines if line["type"] == "pose"]


def test_corrected_boxes_take_the_place_of_generated_ones(database: Database, run_id: int) -> None:
    """The newest correction counts, a deleted one does not, a re-match changes the vessel too."""
    poses = exported(database, run_id, poses="corrected")
    assert [pose["source"] for pose in poses] == [
        "edited",
        "generated",
        "rematched",
        "person_made",
        "generated",
    ]
    edited, undone, rematched = poses[:3]
    assert (edited["heading_deg"], edited["length_m"]) == (45.0, 81.0)
    assert (edited["heading_source"], edited["vessel"]) == ("person", str(FIRST_MMSI))
    assert edited["corners_in_image_px"][0] == [11.0, 21.0]
    assert edited["centroid_in_cam_m"] == [1.0, 2.0, 301.0]
    assert (undone["heading_deg"], undone["length_m"]) == (90.0, 80.0)
    assert (rematched["vessel"], rematched["cost"]) == (str(NEW_MMSI), 0.75)
    assert (rematched["flags"], rematched["heading_source"]) == (["cut_top"], "reported")


def test_generated_boxes_stay_what_they_were(database: Database, run_id: int) -> None:
    """Without the choice, and with `generated`, no correction is in the file."""
    poses = exported(database, run_id)
    assert exported(database, run_id, poses="generated") == poses
    assert {pose["source"] for pose in poses} == {"generated", "person_made"}
    assert {pose["heading_deg"] for pose in poses} == {90.0}
    assert str(NEW_MMSI) not in json.dumps(poses)
