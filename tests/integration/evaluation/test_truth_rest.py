"""Poses against truth and against human boxes over REST, from rows whose figures are known."""

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.domain.metrics import BoxPose
from app.tables.groundtruth import GroundTruthBox, GroundTruthImage, VesselClass, VesselTruth
from app.tables.identity import User
from app.tables.reviews import Grade
from app.tables.runs import Pose
from tests.factories.runs import make_harbour, make_pose, make_review, make_run

POSES, IOU = "/api/v1/evaluation/poses", "/api/v1/evaluation/iou"
CORNERS_PX = [[10.0, 12.0], [40.5, 30.0]] * 4


def _truth(pose: Pose, **columns: Any) -> VesselTruth:
    values = {
        "image_id": pose.image_id,
        "identifier": "tug",
        "mmsi": pose.mmsi,
        "vessel_class": VesselClass.SHIP,
        "centroid_in_cam_m": pose.centroid_in_cam_m,
        "rotvec_cam_from_vessel": pose.rotvec_cam_from_vessel,
        "length_m": pose.length_m,
        "width_m": pose.width_m,
        "height_m": pose.height_m,
        "corners_in_image_px": CORNERS_PX,
        "visible_fraction": 1.0,
        "x1_px": pose.match.detection.x1_px,
        "y1_px": pose.match.detection.y1_px,
        "x2_px": pose.match.detection.x2_px,
        "y2_px": pose.match.detection.y2_px,
    }
    return VesselTruth(**(values | columns))


def test_errors_are_those_of_the_poses_and_wrong_matches_are_counted(
    client: TestClient, database: Database
) -> None:
    """Three metres ahead of the truth with a sigma of three: NEES 1; another vessel's: wrong."""
    with database.writing() as session:
        harbour = make_harbour(session, images=2)
        run = make_run(session, harbour, (0, 0))
        right = make_pose(session, run, harbour.images[0], 211000001)
        wrong = make_pose(session, run, harbour.images[1], 211000002)
        forward = BoxPose.of(right).axes_in_cam[:, 0]
        off = [float(v) for v in np.asarray(right.centroid_in_cam_m) - 3.0 * forward]
        right.position_covariance_in_enu_m2 = np.diag([9.0, 9.0, 9.0]).tolist()
        right.heading_sigma_deg, right.height_sigma_m = 2.0, 1.0
        session.add_all(
            [
                _truth(right, centroid_in_cam_m=off, height_m=right.height_m - 3.0),
                _truth(wrong, mmsi=211000009),
                _truth(wrong, mmsi=211000003, x1_px=500.0, x2_px=600.0),
            ]
        )
        run_id, wrong_id = run.id, wrong.id
    answer = client.get(POSES, params={"run_id": run_id})
    (one,) = answer.json()["runs"]
    assert (one["poses"], one["wrong"]["count"]) == (2, 1)
    assert (one["match_rate"]["count"], one["match_rate"]["total"]) == (1, 3)
    assert one["horizontal_m"]["median"] == pytest.approx(3.0)
    assert one["height_m"]["bias"] == pytest.approx(3.0)
    assert one["heading_deg"]["median"] == pytest.approx(0.0, abs=1e-5)
    assert one["calibration"]["mean_nees"] == pytest.approx(1.0)
    assert one["calibration"]["horizontal_within_95"]["count"] == 1
    assert one["calibration"]["height_within_95"]["count"] == 0
    assert wrong_id not in {pose["pose_id"] for pose in answer.json()["worst"]}
    etag = answer.headers["ETag"]
    known = client.get(POSES, params={"run_id": run_id}, headers={"If-None-Match": etag})
    assert known.status_code == 304
    assert client.get(POSES, params={"format": "csv"}).text.count("\n") == 1 + 2 * 5


def test_iou_is_of_the_projected_box_and_the_human_one_the_detection_covers(
    client: TestClient, database: Database, admin: User
) -> None:
    """Of two human boxes the one under the detection counts; ungraded poses are counted apart."""
    with database.writing() as session:
        harbour = make_harbour(session, images=2)
        run = make_run(session, harbour, (0, 0))
        graded = make_pose(session, run, harbour.images[0], 211000001)
        ungraded = make_pose(session, run, harbour.images[1], 211000002)
        graded.corners_in_image_px = [[0.0, 0.0], [30.0, 20.0]] * 4
        found = graded.match.detection
        make_review(session, graded, admin.id, Grade.OK)
        for pose in (graded, ungraded):
            image = GroundTruthImage(
                site_id=run.site_id,
                image_id=pose.image_id,
                file_name="a.jpg",
                base_name="a.jpg",
                width_px=640,
                height_px=480,
                content_sha256=pose.image.sha256,
            )
            session.add(image)
            session.flush()
            drawn = (found.x1_px, found.y1_px, found.x2_px, found.y2_px)
            for place in (drawn, (300.0, 300.0, 400.0, 400.0)):
                session.add(_box(image.id, place))
        run_id = run.id
        wanted = _iou((0.0, 0.0, 30.0, 20.0), drawn)
    answer = client.get(IOU, params={"run_id": run_id}).json()
    assert (answer["pairs"], answer["poses"], answer["poses_ungraded"]) == (1, 2, 1)
    assert answer["by_grade"]["ok"]["mean"] == pytest.approx(wanted)
    assert answer["each"][0]["iou"] == pytest.approx(wanted)
    assert answer["by_grade"]["good"] is None
    assert answer["paper_pairs"] == 245


def _box(image_id: int, place: tuple[float, float, float, float]) -> GroundTruthBox:
    names = ("x1_px", "y1_px", "x2_px", "y2_px")
    return GroundTruthBox(
        ground_truth_image_id=image_id,
        area_px2=1.0,
        vessel_class=VesselClass.SHIP,
        **dict(zip(names, place, strict=True)),
    )


def _iou(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> float:
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    areas = sum((box[2] - box[0]) * (box[3] - box[1]) for box in (one, other))
    return width * height / (areas - width * height)
