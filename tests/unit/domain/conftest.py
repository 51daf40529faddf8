"""The published camera and label, and a simple camera over still water."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.vessel_state import VesselState

SITE = Geodetic(53.54, 9.98, 0.0)


@pytest.fixture(scope="session")
def published(shared_dir: Path) -> tuple[Camera, dict[str, object]]:
    """Camera (ECEF) and label of image 00139255c1d7dd9c."""
    folder = shared_dir / "real/bonk"
    camera = json.loads((folder / "camera.json").read_text())
    label = json.loads((folder / "label/00139255c1d7dd9c.json").read_text())
    return (
        Camera(
            Intrinsics(2560, 1920, camera["K"]),
            camera["R_cam_from_ecef"],
            camera["center_ecef_m"],
        ),
        label,
    )


@pytest.fixture
def frame() -> EnuFrame:
    """East-north-up at the simple camera's foot, the water at height 0."""
    return EnuFrame(SITE)


@pytest.fixture
def camera() -> Camera:
    """Give a level camera 30 m above the water, looking north, with 4000 px focal length."""
    R = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    K = np.array([[4000.0, 0, 1280], [0, 4000, 960], [0, 0, 1]])
    return Camera(Intrinsics(2560, 1920, K), R, np.array([0.0, 0, 30]))


@pytest.fixture
def vessel(frame: EnuFrame) -> Callable[..., VesselState]:
    """Make a vessel `east_m`, `north_m` of the camera: 30 x 8 m, heading east, at rest."""

    def make(east_m: float, north_m: float, **changes: object) -> VesselState:
        # The tangent plane leaves the water with distance; height 0 is the ellipsoid itself.
        place = frame.geodetic(np.array([east_m, north_m, 0.0]))
        state = VesselState(
            identifier="v",
            lat_deg=place.lat_deg,
            lon_deg=place.lon_deg,
            heading_deg=90.0,
            speed_kn=0.0,
            age_s=0.0,
            to_bow_m=15.0,
            to_stern_m=15.0,
            to_port_m=4.0,
            to_starboard_m=4.0,
        )
        return replace(state, **changes)  # type: ignore[arg-type]  # a test's own changes

    return make


@pytest.fixture
def box_of(camera: Camera, frame: EnuFrame) -> Callable[..., Detection]:
    """Give the tight detection box of a vessel's true cuboid of `height_m`."""
    from app.domain.waterplane import water_plane_segment  # noqa: PLC0415 - only where asked for

    def make(state: VesselState, height_m: float = 10.0, score: float = 1.0) -> Detection:
        segment = water_plane_segment(frame, 0.0, state)
        bottom = segment.corners_in_world
        top = bottom + height_m * segment.vessel_axes_in_world[2]
        pixels = camera.project(np.vstack([bottom, top]))
        (x1, y1), (x2, y2) = pixels.min(axis=0), pixels.max(axis=0)
        return Detection(float(x1), float(y1), float(x2), float(y2), score)

    return make
