"""Registrations over REST: solved from keypoints or given, and the camera that comes of them."""

import json
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EcefFrame
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix
from app.registration import service
from app.registration.conversion import frame_of
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.integration.registration.conftest import Scene


def _put_keypoints(client: TestClient, scene: Scene) -> str:
    address = f"/api/v1/viewports/{scene.viewport.id}"
    assert client.put(f"{address}/keypoints", json=scene.keypoints).status_code == 200
    return f"{address}/registrations"


def test_pnp_gives_the_camera_back(client: TestClient, database: Database, scene: Scene) -> None:
    """From exact keypoints the true camera comes back, over REST and as the worker sees it."""
    path = _put_keypoints(client, scene)
    made = client.post(path, json={"method": "pnp"})
    assert made.status_code == 201, made.text
    registration = made.json()
    assert registration["mae_px"] < 0.01
    assert registration["leave_one_out_px"] < 0.05
    assert registration["mae_pct_width"] == pytest.approx(registration["mae_px"] / 25.6)
    assert registration["mae_pct_height"] == pytest.approx(registration["mae_px"] / 19.2)
    assert np.array(registration["covariance"]).shape == (6, 6)
    assert len(registration["residuals"]) == 14
    assert all(item["is_used"] for item in registration["residuals"])
    place = registration["center"]
    center = scene.frame.position(place["lat_deg"], place["lon_deg"], place["height_m"])
    np.testing.assert_allclose(center, scene.camera.center_in_world, atol=0.05)
    with database.reading() as session:
        camera, frame = service.camera_of(session, registration["id"])
    np.testing.assert_allclose(camera.center_in_world, center, atol=1e-6)
    np.testing.assert_allclose(
        camera.R_cam_from_world, matrix_from_rotvec(registration["rotation"]), atol=1e-12
    )
    point = frame.geodetic([-200.0, 250.0, 0.0])
    in_enu = scene.frame.position(point.lat_deg, point.lon_deg, point.height_m)
    np.testing.assert_allclose(
        camera.project(in_enu[None]), scene.camera.project(in_enu[None]), atol=0.1
    )
    viewport = client.get(f"/api/v1/viewports/{scene.viewport.id}").json()
    assert viewport["registration_id"] == registration["id"]
    assert client.get(path).json()["items"] == [registration]


def test_check_points_judge_without_taking_part(client: TestClient, scene: Scene) -> None:
    """A wrong check point shows its own error and leaves the solution as good as it was."""
    wrong = scene.keypoints[3]
    wrong["u_px"] += 30.0
    wrong["role"] = "check"
    scene.keypoints[4]["role"] = "off"
    registration = client.post(_put_keypoints(client, scene), json={"method": "pnp"}).json()
    assert registration["mae_px"] < 0.01
    assert registration["check_mae_px"] == pytest.approx(30.0, abs=0.1)
    by_name = {item["name"]: item for item in registration["residuals"]}
    assert by_name[wrong["name"]]["du_px"] == pytest.approx(-30.0, abs=0.1)
    unused = {name for name, item in by_name.items() if not item["is_used"]}
    assert unused == {"Landmark 4", "Landmark 5"}


@pytest.mark.parametrize("method", ["homography_water", "homography_pca"])
def test_homographies_stand_beside_for_comparison(
    client: TestClient, scene: Scene, method: str
) -> None:
    """A homography has errors and a projection from ENU to px, but no camera."""
    path = _put_keypoints(client, scene)
    made = client.post(path, json={"method": method})
    assert made.status_code == 201, made.text
    registration = made.json()
    assert registration["rotation"] is registration["center"] is registration["covariance"] is None
    assert registration["mae_px"] > 1
    first = registration["residuals"][0]
    landmark = scene.keypoints[0]
    point = scene.frame.position(landmark["lat_deg"], landmark["lon_deg"], landmark["height_m"])
    u, v, w = np.array(registration["homography"]) @ [*point, 1.0]
    assert (u / w, v / w) == pytest.approx(
        (first["u_px"] + first["du_px"], first["v_px"] + first["dv_px"])
    )
    viewport = client.get(f"/api/v1/viewports/{scene.viewport.id}").json()
    assert viewport["registration_id"] is None


def test_keypoints_that_carry_no_camera_are_explained(client: TestClient, scene: Scene) -> None:
    """Too few keypoints, or all on a line, give 422 with the reason and the fix."""
    path = _put_keypoints(client, scene).removesuffix("/registrations")
    few = client.put(f"{path}/keypoints", json=scene.keypoints[:5], headers={"If-Match": '"2"'})
    refused = client.post(f"{path}/registrations", json={"method": "pnp"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "keypoints"
    assert "mark more landmarks" in refused.json()["detail"]
    line = []
    for number in range(8):
        ahead = np.array([-220.0 - 15.0 * number, 250.0, -20.0])
        point = scene.camera.center_in_world + ahead
        place = scene.frame.geodetic(point)
        ((u_px, v_px),) = scene.camera.project(point[None])
        if 0 <= u_px < 2560:
            line.append(
                {
                    "name": f"Quay {number}",
                    "lat_deg": place.lat_deg,
                    "lon_deg": place.lon_deg,
                    "height_m": place.height_m,
                    "u_px": u_px,
                    "v_px": v_px,
                }
            )
    assert len(line) >= 6
    version = {"If-Match": few.headers["etag"]}
    assert client.put(f"{path}/keypoints", json=line, headers=version).status_code == 200
    refused = client.post(f"{path}/registrations", json={"method": "pnp"})
    assert refused.status_code == 422
    assert "line" in refused.json()["detail"]
    assert client.get(f"{path}/registrations").json()["items"] == []


@pytest.mark.parametrize(
    "body",
    [
        {"method": "given"},
        {"method": "given", "rotation": [1, 0, 0]},
        {"method": "given", "rotation": [1, 0], "center": [53.5, 9.9, 30]},
        {"method": "given", "rotation": [[1, 0, 0], [0, 2, 0], [0, 0, 1]], "center": [53, 9, 30]},
        {"method": "given", "rotation": [1, 0, 0], "center": [91, 9.9, 30]},
        {
            "method": "given",
            "rotation": [1, 0, 0],
            "center": [53.5, 9.9, 30],
            "intrinsics": {"width_px": 640, "height_px": 480},
        },
        {"method": "pnp", "rotation": [1, 0, 0]},
        {"method": "guess"},
    ],
)
def test_a_pose_that_is_none_is_refused(
    client: TestClient, scene: Scene, body: dict[str, object]
) -> None:
    """Incomplete, impossible and contradicting requests give 422 and store nothing."""
    path = f"/api/v1/viewports/{scene.viewport.id}/registrations"
    assert client.post(path, json=body).status_code == 422
    assert client.get(path).json()["items"] == []


def test_the_published_camera_goes_in_and_comes_out(
    client: TestClient, database: Database, shared_dir: Path
) -> None:
    """A real camera, published in ECEF, sees the same pixels after the way through a site's ENU."""
    published = json.loads((shared_dir / "real/bonk/camera.json").read_text())
    K = np.array(published["K"])
    truth = Camera(
        Intrinsics(published["width"], published["height"], K),
        np.array(published["R_cam_from_ecef"]),
        np.array(published["center_ecef_m"]),
    )
    with database.writing() as session:
        site = make_site(session, origin_lat_deg=53.545, origin_lon_deg=9.97, origin_height_m=39.0)
        row = make_camera(session, site, width_px=2560, height_px=1920)
        viewport = make_viewport(session, row)
    frame = frame_of(site)
    R_cam_from_enu = truth.R_cam_from_world @ frame.R_enu_from_ecef.T
    place = EcefFrame().geodetic(truth.center_in_world)
    body = {
        "method": "given",
        "rotation": rotvec_from_matrix(R_cam_from_enu).tolist(),
        "center": {
            "lat_deg": place.lat_deg,
            "lon_deg": place.lon_deg,
            "height_m": place.height_m,
        },
        "intrinsics": {"K": published["K"]},
    }
    path = f"/api/v1/viewports/{viewport.id}/registrations"
    made = client.post(path, json=body)
    assert made.status_code == 201, made.text
    registration = made.json()
    assert registration["rotation"] == pytest.approx(body["rotation"], abs=1e-12)
    assert registration["center"] == pytest.approx(body["center"], abs=1e-6)
    assert registration["intrinsics"]["K"] == published["K"]
    assert registration["residuals"] == []
    assert registration["mae_px"] is None
    as_lists = body | {"rotation": R_cam_from_enu.tolist(), "center": [*body["center"].values()]}
    again = client.post(path, json=as_lists).json()
    assert again["rotation"] == pytest.approx(body["rotation"], abs=1e-9)
    with database.reading() as session:
        camera, frame = service.camera_of(session, registration["id"])
    points_in_ecef = truth.center_in_world + truth.rays([[10, 20], [2000, 1500]]) * 400.0
    points_in_enu = (points_in_ecef - frame.origin_in_ecef) @ frame.R_enu_from_ecef.T
    np.testing.assert_allclose(
        camera.project(points_in_enu), truth.project(points_in_ecef), atol=1e-4
    )


def test_solved_registrations_keep_their_intrinsics(
    client: TestClient, database: Database, scene: Scene
) -> None:
    """Editing a camera's focal length changes no registration that was solved before."""
    body = {
        "method": "given",
        "rotation": rotvec_from_matrix(scene.camera.R_cam_from_world).tolist(),
        "center": [53.5422, 9.9835, 70.0],
    }
    path = f"/api/v1/viewports/{scene.viewport.id}/registrations"
    registration = client.post(path, json=body).json()
    address = f"/api/v1/cameras/{scene.viewport.camera_id}"
    version = {"If-Match": client.get(address).headers["etag"]}
    assert client.patch(address, json={"fx_px": 7000}, headers=version).status_code == 200
    with database.reading() as session:
        camera, _ = service.camera_of(session, registration["id"])
    assert camera.intrinsics.K[0, 0] == 6500.0
