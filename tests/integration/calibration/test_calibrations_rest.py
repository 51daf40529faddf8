"""Calibrations by REST and by page: uploads, left-out photographs, versions in use."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.calibration import service
from app.db import Database
from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.rotations import matrix_from_rotvec
from app.tables.calibration import (
    CalibrationPhoto,
    CalibrationSource,
    CalibrationStatus,
    CameraCalibration,
)
from app.tables.identity import User
from tests.factories.boards import BOARD, LENS, TILTED, Turn
from tests.factories.imagery import photograph
from tests.factories.sites import make_camera, make_site

API = "/api/v1"
FORM = {"columns": "9", "rows": "6", "square_mm": "30"}
GUESS = {
    "width_px": 800,
    "height_px": 600,
    "fx_px": 1000.0,
    "fy_px": 1000.0,
    "cx_px": 400.0,
    "cy_px": 300.0,
}


@dataclass(frozen=True)
class Calibrated:
    """Ids of a camera and of its solved calibration, photograph 5 of which is bad."""

    camera_id: int
    calibration_id: int


@pytest.fixture
def camera_id(database: Database) -> int:
    """Give a camera of the rendered boards' size with a guessed lens."""
    with database.writing() as session:
        return make_camera(session, make_site(session, "Elbe"), "Roof", **GUESS).id


@pytest.fixture
def calibrated(database: Database, camera_id: int) -> Calibrated:
    """Give a calibration as the worker leaves it, from exact corners; in one they are wrong."""
    with database.writing() as session:
        row = CameraCalibration(
            camera_id=camera_id,
            number=1,
            source=CalibrationSource.CHEQUERBOARD,
            status=CalibrationStatus.RUNNING,
            corner_columns=BOARD.columns,
            corner_rows=BOARD.rows,
            square_mm=1000 * BOARD.square_m,
        )
        session.add(row)
        session.flush()
        for number, (turn, place) in enumerate(TILTED, 1):
            corners = corners_of(turn, place, number)
            if number == 5:
                corners[::7] += (9.0, -6.0)
            session.add(
                CalibrationPhoto(
                    calibration_id=row.id,
                    position=number,
                    file_name=f"board_{number}.jpg",
                    sha256=f"{number:064d}",
                    media_type="image/jpeg",
                    corners=corners.tolist(),
                )
            )
        session.flush()
        found = service.photos(session, row.id)
        service.keep_solution(row, found, (), service.solved(row, found, ()))
        session.flush()
        return Calibrated(camera_id, row.id)


def corners_of(turn: Turn, place: Turn, seed: int) -> FloatArray:
    """Return where the lens shows the board's corners, to a twentieth of a pixel."""
    R = matrix_from_rotvec(turn)
    middle = BOARD.corners_m().mean(axis=0)
    exact = Camera(LENS, R, middle - R.T @ np.array(place)).project(BOARD.corners_m())
    return exact + np.random.default_rng(seed).normal(0, 0.05, exact.shape)


def photos(count: int) -> list[tuple[str, tuple[str, bytes, str]]]:
    """Return the parts of an upload of different photographs."""
    return [
        ("files", (f"board {number}.jpg", photograph(number, 800, 600), "image/jpeg"))
        for number in range(count)
    ]


def test_photographs_are_taken_in(client: TestClient, camera_id: int) -> None:
    """POST answers 202 with where to look; the same bytes twice are one, a wrong size is named."""
    parts = [*photos(3), photos(1)[0]]
    parts.append(("files", ("small.jpg", photograph(9, 64, 48), "image/jpeg")))
    asked = client.post(f"{API}/cameras/{camera_id}/calibrations", files=parts, data=FORM)
    assert asked.status_code == 202, asked.text
    shown = client.get(asked.headers["location"]).json()
    assert (shown["status"], shown["number"], shown["columns"]) == ("queued", 1, 9)
    assert [photo["file_name"] for photo in shown["photos"]] == [
        "board 0.jpg",
        "board 1.jpg",
        "board 2.jpg",
        "small.jpg",
    ]
    assert "wrong size: 64 x 48 px" in shown["photos"][3]["problem"]
    preview = client.get(f"{asked.headers['location']}/photos/1/preview")
    assert preview.headers["content-type"] == "image/jpeg"


@pytest.mark.parametrize(
    ("name", "data", "status"),
    [
        ("page.jpg", b"<html><script>alert(1)</script>", 415),
        ("drawing.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>", 415),
        ("cut.jpg", photograph(1, 800, 600)[:4000], 422),
        ("empty.jpg", b"", 415),
    ],
)
def test_what_is_no_photograph_is_refused_by_name(
    client: TestClient, camera_id: int, name: str, data: bytes, status: int
) -> None:
    """A web page, a drawing, half a file: the answer names the file, and nothing is stored."""
    path = f"{API}/cameras/{camera_id}/calibrations"
    parts = [*photos(3), ("files", (name, data, "image/jpeg"))]
    refused = client.post(path, files=parts, data=FORM)
    assert refused.status_code == status, refused.text
    assert name in refused.json()["detail"]
    assert client.get(path).json()["items"] == []


@pytest.mark.parametrize(
    "wrong", [{"columns": "2"}, {"rows": "nine"}, {"square_mm": "0"}, {"square_mm": "inf"}]
)
def test_a_board_that_cannot_be_is_refused(
    client: TestClient, camera_id: int, wrong: dict[str, str]
) -> None:
    """Too few corners, words for numbers and squares without a size name their field."""
    path = f"{API}/cameras/{camera_id}/calibrations"
    refused = client.post(path, files=photos(1), data=FORM | wrong)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] in wrong


def test_a_bad_photograph_is_left_out_and_the_rest_solved_again(
    client: TestClient, calibrated: Calibrated
) -> None:
    """The bad one is named; without it the error falls to the noise; edits need If-Match."""
    path = f"{API}/calibrations/{calibrated.calibration_id}"
    before = client.get(path)
    problems = [photo["problem"] for photo in before.json()["photos"]]
    assert [number for number, problem in enumerate(problems, 1) if problem] == [5]
    body = {"left_out": [5]}
    assert client.put(f"{path}/left-out", json=body).status_code == 428
    stale = client.put(f"{path}/left-out", json=body, headers={"If-Match": '"99"'})
    assert stale.status_code == 412
    match = {"If-Match": before.headers["etag"]}
    unknown = client.put(f"{path}/left-out", json={"left_out": [77]}, headers=match)
    assert unknown.status_code == 422
    after = client.put(f"{path}/left-out", json=body, headers=match)
    assert after.status_code == 200, after.text
    solved = after.json()
    assert solved["rms_px"] < 0.1 < 3 * 0.1 < before.json()["rms_px"]
    assert solved["intrinsics"]["fx_px"] == pytest.approx(922.0, rel=2e-3)
    assert solved["photos"][4]["is_left_out"]
    assert solved["photos"][4]["rms_px"] is None


def test_leaving_too_many_out_says_why_there_is_no_lens(
    client: TestClient, calibrated: Calibrated
) -> None:
    """With two photographs left the calibration has failed, with the number that is needed."""
    path = f"{API}/calibrations/{calibrated.calibration_id}"
    match = {"If-Match": client.get(path).headers["etag"]}
    body = {"left_out": list(range(3, 13))}
    after = client.put(f"{path}/left-out", json=body, headers=match).json()
    assert after["status"] == "failed"
    assert "at least 3" in after["error"]
    assert after["intrinsics"] is None
    assert client.post(f"{path}/activate").status_code == 409


def test_a_version_is_used_by_registrations_made_after_it(
    client: TestClient, calibrated: Calibrated
) -> None:
    """Activating changes the camera, not registrations made before; one can go back."""
    viewport = client.post(
        f"{API}/viewports", json={"camera_id": calibrated.camera_id, "name": "North"}
    ).json()
    path = f"{API}/viewports/{viewport['id']}/registrations"
    given = {"method": "given", "rotation": [1.2, 0, 0], "center": [53.54, 9.98, 70.0]}
    before = client.post(path, json=given).json()
    calibration = f"{API}/calibrations/{calibrated.calibration_id}"
    assert client.post(f"{calibration}/activate").json()["is_active"]
    after = client.post(path, json=given).json()
    assert before["intrinsics"]["fx_px"] == 1000.0
    assert after["intrinsics"]["fx_px"] == pytest.approx(922.0, rel=0.02)
    assert client.get(path).json()["items"][0]["intrinsics"] == before["intrinsics"]
    versions = client.get(f"{API}/cameras/{calibrated.camera_id}/calibrations").json()["items"]
    assert [(item["source"], item["is_active"]) for item in versions] == [
        ("chequerboard", True),
        ("entered", False),
    ]
    client.post(f"{API}/calibrations/{versions[1]['id']}/activate")
    camera = client.get(f"{API}/cameras/{calibrated.camera_id}").json()
    assert camera["fx_px"] == 1000.0
    match = {"If-Match": client.get(calibration).headers["etag"]}
    used = client.put(f"{calibration}/left-out", json={"left_out": [5]}, headers=match)
    assert used.status_code == 409


def test_pages_upload_show_solve_and_activate(
    browser_of: Callable[[User], TestClient], admin: User, calibrated: Calibrated
) -> None:
    """The pages take an upload, show errors by photograph, solve again and switch versions."""
    browser = browser_of(admin)
    here = f"/cameras/{calibrated.camera_id}/calibrations"
    empty = browser.post(here, data=FORM)
    assert empty.status_code == 422
    assert "at least three photographs" in empty.text
    sent = browser.post(here, data=FORM, files=photos(3))
    assert sent.status_code == 303
    assert "Looking for the board" in browser.get(sent.headers["location"]).text
    shown = browser.get(f"/calibrations/{calibrated.calibration_id}").text
    assert "fits far worse than the others" in shown
    version = shown.partition('name="version" value="')[2].partition('"')[0]
    again = browser.post(
        f"/calibrations/{calibrated.calibration_id}/left-out",
        data={"version": version, "left_out_5": "true"},
    )
    assert again.status_code == 303
    used = browser.post(f"/calibrations/{calibrated.calibration_id}/activate")
    assert used.status_code == 303
    assert "In use" in browser.get(used.headers["location"]).text
