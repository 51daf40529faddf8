"""Runs with poses, put into the database by hand: no worker, no pixels."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from itertools import count

from sqlalchemy.orm import Session

from app.db import now
from app.tables.ais import Vessel
from app.tables.detection import Detection, DetectionSet, Model, ModelStatus
from app.tables.imagery import Image
from app.tables.registration import Registration, RegistrationMethod
from app.tables.reviews import Grade, Review
from app.tables.runs import Match, Pose, Run, RunImage, RunStatus, VesselStateRow
from app.tables.sites import Camera, Site, Viewport
from tests.factories.imagery import NOON, make_image
from tests.factories.sites import make_camera, make_site, make_viewport

FIRST_MMSI = 211_000_000
CORNERS_PX: list[list[float] | None] = [[10.0 + i, 20.0 + i] for i in range(8)]
_number = count(1)


@dataclass(frozen=True, slots=True)
class Harbour:
    """A site with one registered viewport, its images and a detector."""

    site: Site
    camera: Camera
    viewport: Viewport
    registration: Registration
    model: Model
    images: Sequence[Image]


def make_harbour(session: Session, images: int = 1, **site_columns: object) -> Harbour:
    """Insert a site whose viewport could be run: registered, with images a minute apart."""
    site = make_site(session, **site_columns)
    camera = make_camera(session, site)
    viewport = make_viewport(session, camera)
    registration = make_registration(session, viewport)
    number = next(_number)
    model = Model(
        name=f"yolox-{number}",
        family="yolox",
        sha256=hashlib.sha256(f"model {number}".encode()).hexdigest(),
        size_bytes=1000,
        status=ModelStatus.READY,
    )
    session.add(model)
    session.flush()
    photographs = [
        make_image(session, camera, viewport, NOON + timedelta(minutes=minute))
        for minute in range(images)
    ]
    return Harbour(site, camera, viewport, registration, model, photographs)


def make_registration(session: Session, viewport: Viewport) -> Registration:
    """Insert a camera pose for a viewport."""
    registration = Registration(
        viewport_id=viewport.id,
        method=RegistrationMethod.GIVEN,
        rotation=[1.2, 0.0, 0.0],
        center_lat_deg=53.5422,
        center_lon_deg=9.9835,
        center_height_m=70.0,
        intrinsics={
            "width_px": 64,
            "height_px": 48,
            "fx_px": 60.0,
            "fy_px": 60.0,
            "cx_px": 31.5,
            "cy_px": 23.5,
            "distortion": [0.0] * 5,
        },
    )
    session.add(registration)
    session.flush()
    return registration


def make_run(
    session: Session,
    harbour: Harbour,
    poses_per_image: Sequence[int] = (),
    *,
    status: RunStatus = RunStatus.SUCCEEDED,
    **columns: object,
) -> Run:
    """Insert a run over all images of a harbour; those named with a number are done.

    `poses_per_image[i]` poses are in image i, of the vessels FIRST_MMSI, FIRST_MMSI + 1, ...
    """
    values: dict[str, object] = {
        "site_id": harbour.site.id,
        "viewport_id": harbour.viewport.id,
        "registration_id": harbour.registration.id,
        "model_id": harbour.model.id,
        "preset": "paper",
        "parameters": {"score_threshold": 0.25, "maximum_cost": 0.5},
        "code_version": "1.2.3",
        "workflow_id": f"run-{next(_number)}",
        "image_count": len(harbour.images),
        "status": status,
        "started_at": None if status is RunStatus.QUEUED else now(),
    }
    run = Run(**(values | columns))
    session.add(run)
    session.flush()
    for position, image in enumerate(harbour.images):
        row = RunImage(run_id=run.id, image_id=image.id, position=position)
        session.add(row)
        if position < len(poses_per_image):
            row.done_at = now()
            for vessel in range(poses_per_image[position]):
                make_pose(session, run, image, FIRST_MMSI + vessel)
    session.flush()
    return run


def make_pose(
    session: Session, run: Run, image: Image, mmsi: int = FIRST_MMSI, **columns: object
) -> Pose:
    """Insert a pose with its detection, vessel state and match."""
    state = _state(run, image, mmsi)
    detection = _detection(session, run, image)
    session.add_all([state, detection])
    session.flush()
    match = Match(
        run_id=run.id,
        detection_id=detection.id,
        vessel_state_id=state.id,
        cost=0.125,
        cost_terms={"center_x": 0.01, "bottom": 0.02, "score": 0.5, "width": 0.0225},
    )
    session.add(match)
    session.flush()
    values: dict[str, object] = {
        "run_id": run.id,
        "image_id": image.id,
        "match_id": match.id,
        "mmsi": mmsi,
        "lat_deg": 53.5425,
        "lon_deg": 9.984,
        "center_height_m": 45.5,
        "heading_deg": 90.0,
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
    pose = Pose(**(values | columns))
    session.add(pose)
    session.flush()
    return pose


def _state(run: Run, image: Image, mmsi: int) -> VesselStateRow:
    return VesselStateRow(
        run_id=run.id,
        image_id=image.id,
        mmsi=mmsi,
        lat_deg=53.5425,
        lon_deg=9.984,
        heading_deg=90.0,
        heading_source="reported",
        speed_kn=5.5,
        age_s=12.0,
        to_bow_m=60.0,
        to_stern_m=20.0,
        to_port_m=6.0,
        to_starboard_m=6.0,
        report_ids=[1, 2],
        outcome="matched",
        segments_px={"reported": CORNERS_PX[:4], "dead_reckoned": CORNERS_PX[:4]},
    )


def _detection(session: Session, run: Run, image: Image) -> Detection:
    number = next(_number)
    found = DetectionSet(
        image_sha256=image.sha256,
        model_sha256=session.get_one(Model, run.model_id).sha256,
        settings_sha256=hashlib.sha256(f"settings {number}".encode()).hexdigest(),
    )
    session.add(found)
    session.flush()
    return Detection(
        detection_set_id=found.id,
        x1_px=10.0,
        y1_px=12.0,
        x2_px=40.5,
        y2_px=30.0,
        score=0.5,
        class_id=8,
    )


def make_vessel(session: Session, mmsi: int = FIRST_MMSI, name: str = "ANNEGRET") -> Vessel:
    """Insert a vessel that was heard of."""
    vessel = Vessel(mmsi=mmsi, name=name, ship_type=70, first_seen_at=NOON, last_seen_at=NOON)
    session.add(vessel)
    session.flush()
    return vessel


def make_review(
    session: Session, pose: Pose, user_id: int, grade: Grade = Grade.GOOD, **columns: object
) -> Review:
    """Insert a person's standing verdict on a pose."""
    values: dict[str, object] = {
        "pose_id": pose.id,
        "user_id": user_id,
        "grade": grade,
        "reasons": [],
        "guideline_version": 1,
    }
    review = Review(**(values | columns))
    session.add(review)
    session.flush()
    return review
