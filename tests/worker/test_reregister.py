"""Real workers tell turns from photographs, and find the corners of chequerboards."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.calibration import service as calibrations
from app.calibration.schemas import BoardIn
from app.calibration.uploads import Taken
from app.config import Settings
from app.db import Database
from app.domain.arrays import UInt8Array
from app.domain.rotations import matrix_from_rotvec
from app.jobs import JobClient
from app.reregistration import service
from app.reregistration.schemas import ReregistrationIn
from app.storage import Storage
from app.tables.calibration import CalibrationStatus
from app.tables.registration import Registration, RegistrationMethod
from app.tables.reregistration import PointingState, ReregistrationStatus
from tests.factories.boards import LENS, TILTED, as_jpeg, render_board
from tests.factories.imagery import make_image
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.worker.conftest import StartWorker
from tests.worker_process import wait_until

SIZE = (960, 720)
K = np.array([[2400.0, 0.0, 479.5], [0.0, 2400.0, 359.5], [0.0, 0.0, 1.0]])
LENS_OF_SCENE = {
    "width_px": 960,
    "height_px": 720,
    "fx_px": 2400.0,
    "fy_px": 2400.0,
    "cx_px": 479.5,
    "cy_px": 359.5,
    "distortion": [0.0] * 5,
}
NOON = datetime(2026, 5, 1, 12, tzinfo=UTC)


@pytest.fixture
def jobs(settings: Settings) -> Iterator[JobClient]:
    """Give the web's view of the jobs."""
    opened = JobClient(settings.database_url)
    yield opened
    opened.destroy()


@pytest.fixture
def scene(shared_dir: Path) -> UInt8Array:
    """Give the far bank of a real photograph, in a quarter of its pixels."""
    path = shared_dir / "real" / "bonk" / "preview" / "0b03876aae8ccfec.jpg"
    return np.asarray(cv2.resize(cv2.imread(str(path))[:1440, :1920], SIZE), np.uint8)


def turned(scene: UInt8Array, turn_deg: tuple[float, float, float]) -> bytes:
    """Return what the turned camera sees, as a JPEG."""
    H = K @ matrix_from_rotvec(np.radians(turn_deg)) @ np.linalg.inv(K)
    return as_jpeg(np.asarray(cv2.warpPerspective(scene, H, SIZE), np.uint8))


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
def test_a_worker_finds_pointings_and_accepts_by_the_gate(
    database: Database,
    settings: Settings,
    jobs: JobClient,
    start_worker: StartWorker,
    scene: UInt8Array,
) -> None:
    """Two moved images become a viewport by themselves; mirrored, damaged and blank ones do not."""
    files = [
        turned(scene, (0.0, 0.0, 0.0)),
        turned(scene, (0.3, -0.8, 0.2)),
        turned(scene, (0.3, -0.8, 0.2)) + b"\0",
        as_jpeg(np.ascontiguousarray(scene[:, ::-1])),
        b"no photograph at all",
        as_jpeg(np.full((SIZE[1], SIZE[0], 3), 128, np.uint8)),
    ]
    storage = Storage(settings.storage_url)
    with database.writing() as session:
        camera = make_camera(session, make_site(session), "Roof", **LENS_OF_SCENE)
        viewport = make_viewport(session, camera, "North", valid_until=NOON + timedelta(hours=1))
        session.add(
            Registration(
                viewport_id=viewport.id,
                method=RegistrationMethod.GIVEN,
                rotation=[1.5, 0.0, 0.0],
                center_lat_deg=53.54,
                center_lon_deg=9.98,
                center_height_m=70.0,
                intrinsics=LENS_OF_SCENE,
            )
        )
        for hour, data in enumerate(files):
            sha256 = storage.put(data).sha256
            holder = None if hour else viewport
            moment = NOON + timedelta(hours=2 * hour)
            make_image(session, camera, holder, moment, sha256=sha256)
        asked = ReregistrationIn(accept_from_inliers=50)
        row = service.start(session, jobs, viewport, asked, None)
    start_worker()
    wait_until(lambda: _status(database, row.id) in service.ENDED, within_s=300, what="the end")
    with database.reading() as session:
        images = service.images(session, row.id)
        assert service.get(session, row.id).status is ReregistrationStatus.SUCCEEDED
        assert [image.refusal for image in images] == [
            None,
            None,
            "too_few_inliers",
            "unreadable",
            "no_structure",
        ]
        assert [image.attempts for image in images] == [1, 1, 2, 1, 1]
        (pointing,) = service.pointings(session, row.id)
        assert pointing.state is PointingState.ACCEPTED
        truth = matrix_from_rotvec(np.radians((0.3, -0.8, 0.2)))
        found = matrix_from_rotvec(pointing.rotation_from_reference)
        assert np.allclose(found, truth, atol=np.radians(0.02))
        moved = [image.image for image in images if image.refusal is None]
        assert {image.viewport_id for image in moved} == {pointing.viewport_id}


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_a_worker_calibrates(
    database: Database, settings: Settings, jobs: JobClient, start_worker: StartWorker
) -> None:
    """From photographs to a lens: corners stored, the bad one named, the focal length right."""
    storage = Storage(settings.storage_url)
    pictures = [as_jpeg(render_board(turn, place)) for turn, place in TILTED[:6]]
    pictures.append(as_jpeg(np.full((600, 800, 3), 90, np.uint8)))
    with database.writing() as session:
        camera = make_camera(
            session, make_site(session), width_px=LENS.width_px, height_px=LENS.height_px
        )
        board = BoardIn(columns=9, rows=6, square_mm=30)
        taken = [
            Taken(storage.put(data).sha256, "image/jpeg", f"{number}.jpg", 800, 600)
            for number, data in enumerate(pictures)
        ]
        row = calibrations.start(session, jobs, camera, board, taken, None)
    start_worker()

    def is_done() -> bool:
        with database.reading() as session:
            return calibrations.get(session, row.id).status not in calibrations.OPEN

    wait_until(is_done, within_s=300, what="the lens")
    with database.reading() as session:
        solved = calibrations.get(session, row.id)
        assert solved.status is CalibrationStatus.SOLVED
        assert solved.intrinsics is not None
        assert solved.intrinsics["fx_px"] == pytest.approx(LENS.K[0, 0], rel=0.01)
        found = calibrations.photos(session, row.id)
        assert [photo.corners is not None for photo in found] == [True] * 6 + [False]
        assert "inner corners" in str(found[6].problem)


def _status(database: Database, reregistration_id: int) -> ReregistrationStatus:
    with database.reading() as session:
        return service.get(session, reregistration_id).status
