"""A run whose poses are geometrically true: ships on the water before a camera, really fused."""

from dataclasses import dataclass

import cv2
import numpy as np
from sqlalchemy.orm import Session

from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.fusion import fuse
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import EnuFrame
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane_segment
from app.registration.conversion import camera_of, frame_of
from app.runs.pose_columns import pixels, pose_columns
from app.tables.detection import Detection as DetectionRow
from app.tables.detection import DetectionSet
from app.tables.runs import Match, Pose, RunImage, VesselStateRow
from tests.factories.runs import FIRST_MMSI, Harbour, make_run

INTRINSICS = {
    "width_px": 2560,
    "height_px": 1920,
    "fx_px": 2600.0,
    "fy_px": 2600.0,
    "cx_px": 1279.5,
    "cy_px": 959.5,
    "distortion": [-0.1, 0.02, 0.001, -0.001, 0.0],
}
# East and north of the site's origin, heading, length: each ship has its own MMSI.
SHIPS = ((-60.0, 300.0, 80.0, 60.0), (20.0, 420.0, 250.0, 30.0), (110.0, 500.0, 95.0, 90.0))
HEIGHT_M = 9.0


@dataclass(frozen=True, slots=True)
class Afloat:
    """The ids of a run over one image: two matched ships, and a third with its own detection."""

    run_id: int
    image_id: int
    pose_ids: list[int]
    free_detection_id: int
    free_mmsi: int
    far_mmsi: int


def make_afloat(session: Session, harbour: Harbour) -> Afloat:
    """Insert the run. The third ship's detection and vessel are left unmatched, as in bad luck."""
    camera, frame = look_north(session, harbour)
    image = harbour.images[0]
    run = make_run(session, harbour, [0], parameters={"score_threshold": 0.25, "maximum_cost": 0.5})
    states = [_state(frame, FIRST_MMSI + number, *ship) for number, ship in enumerate(SHIPS)]
    boxes = [_detection(camera, frame, state) for state in states]
    found = DetectionSet(
        image_sha256=image.sha256, model_sha256=harbour.model.sha256, settings_sha256="5" * 64
    )
    session.add(found)
    session.flush()
    session.get_one(RunImage, (run.id, image.id)).detection_set_id = found.id
    rows = [_box_row(found.id, box) for box in boxes]
    far = _state(frame, FIRST_MMSI + 9, 0.0, 9000.0, 0.0, 50.0)
    state_rows = [_state_row(run.id, image.id, camera, frame, state) for state in [*states, far]]
    session.add_all([*rows, *state_rows])
    session.flush()
    pose_ids = []
    for number in range(2):
        fused = fuse(camera, frame, 0.0, [boxes[number]], [states[number]], FusionSettings()).poses[
            0
        ]
        match = Match(
            run_id=run.id,
            detection_id=rows[number].id,
            vessel_state_id=state_rows[number].id,
            cost=fused.cost,
            cost_terms=fused.cost_terms,
        )
        session.add(match)
        session.flush()
        pose = Pose(
            **pose_columns(frame, states[number], fused),
            run_id=run.id,
            image_id=image.id,
            match_id=match.id,
        )
        session.add(pose)
        session.flush()
        pose_ids.append(pose.id)
    return Afloat(run.id, image.id, pose_ids, rows[2].id, FIRST_MMSI + 2, FIRST_MMSI + 9)


def look_north(session: Session, harbour: Harbour) -> tuple[Camera, EnuFrame]:
    """Turn a harbour's registered camera to the north, 30 m above the water."""
    down = np.radians(5)
    looks_north = np.array(
        [[1, 0, 0], [0, -np.sin(down), -np.cos(down)], [0, np.cos(down), -np.sin(down)]]
    )
    frame = frame_of(harbour.site)
    place = frame.geodetic(np.array([0.0, 0.0, 30.0]))
    rotvec, _ = cv2.Rodrigues(looks_north)
    registration = harbour.registration
    registration = session.merge(registration)
    registration.rotation = rotvec.ravel().tolist()
    registration.center_lat_deg = place.lat_deg
    registration.center_lon_deg = place.lon_deg
    registration.center_height_m = place.height_m
    registration.intrinsics = INTRINSICS
    session.flush()
    camera = camera_of(registration, frame)
    assert camera is not None
    return camera, frame


def _state(
    frame: EnuFrame, mmsi: int, east: float, north: float, heading: float, length: float
) -> VesselState:
    place = frame.geodetic(np.array([east, north, 0.0]))
    return VesselState(
        identifier=str(mmsi),
        lat_deg=place.lat_deg,
        lon_deg=place.lon_deg,
        heading_deg=heading,
        speed_kn=0.0,
        age_s=4.0,
        to_bow_m=length * 0.7,
        to_stern_m=length * 0.3,
        to_port_m=length * 0.1,
        to_starboard_m=length * 0.1,
    )


def _detection(camera: Camera, frame: EnuFrame, state: VesselState) -> Detection:
    """Return the rectangle around a ship that stands a few metres beside its AIS position."""
    segment = water_plane_segment(frame, 0.0, state)
    bottom = segment.corners_in_world + np.array([3.0, -2.0, 0.0])
    corners = np.vstack([bottom, bottom + np.array([0.0, 0.0, HEIGHT_M])])
    shown = camera.project(corners)
    (x1, y1), (x2, y2) = shown.min(axis=0), shown.max(axis=0)
    return Detection(x1, y1, x2, y2, 0.8, 8)


def _box_row(set_id: int, box: Detection) -> DetectionRow:
    return DetectionRow(
        detection_set_id=set_id,
        x1_px=float(box.x1_px),
        y1_px=float(box.y1_px),
        x2_px=float(box.x2_px),
        y2_px=float(box.y2_px),
        score=box.score,
        class_id=box.class_id,
    )


def _state_row(
    run_id: int, image_id: int, camera: Camera, frame: EnuFrame, state: VesselState
) -> VesselStateRow:
    segment = water_plane_segment(frame, 0.0, state)
    return VesselStateRow(
        run_id=run_id,
        image_id=image_id,
        mmsi=int(state.identifier),
        lat_deg=state.lat_deg,
        lon_deg=state.lon_deg,
        heading_deg=state.heading_deg,
        heading_source=state.heading_source.value,
        speed_kn=state.speed_kn,
        age_s=state.age_s,
        to_bow_m=state.to_bow_m,
        to_stern_m=state.to_stern_m,
        to_port_m=state.to_port_m,
        to_starboard_m=state.to_starboard_m,
        report_ids=[],
        outcome="no_detection_left",
        segments_px={
            "reported": pixels(camera.project(segment.reported_corners_in_world)),
            "dead_reckoned": pixels(camera.project(segment.corners_in_world)),
        },
    )
