"""The solve preview: everything an editor shows, for keypoints that are not stored."""

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.registration import Registration
from tests.integration.registration.conftest import Scene


def _solve(client: TestClient, scene: Scene, **body: Any) -> dict[str, Any]:
    answer = client.post(f"/api/v1/viewports/{scene.viewport.id}/solve", json=body)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def _edited(scene: Scene) -> list[dict[str, Any]]:
    return [point | {"key": f"k{n}"} for n, point in enumerate(scene.keypoints)]


def test_all_methods_come_side_by_side_and_nothing_is_stored(
    client: TestClient, database: Database, scene: Scene
) -> None:
    """PnP finds the true camera, both homographies stand beside it, the database is untouched."""
    points = _edited(scene)
    points[3]["role"], points[4]["role"] = "check", "off"
    solved = _solve(client, scene, keypoints=points)
    pnp, water, pca = solved["methods"]
    assert [one["method"] for one in (pnp, water, pca)] == [
        "pnp",
        "homography_water",
        "homography_pca",
    ]
    assert pnp["mae_px"] < 1e-3
    assert water["leave_one_out_px"] > water["mae_px"] > 1
    np.testing.assert_allclose(
        solved["camera"]["center_enu_m"], scene.camera.center_in_world, atol=1e-3
    )
    assert [one["key"] for one in pnp["points"]] == [one["key"] for one in points]
    assert pnp["points"][3]["leave_one_out_px"] is None
    assert pnp["check_mae_px"] == pytest.approx(pnp["points"][3]["error_px"])
    assert not pnp["points"][4]["is_used"]
    heading = np.degrees(np.arctan2(-312, 357)) % 360
    assert solved["camera"]["heading_deg"] == pytest.approx(heading, abs=0.1)
    assert solved["camera"]["pitch_deg"] == pytest.approx(-3.0, abs=0.2)
    assert solved["camera"]["roll_deg"] == pytest.approx(0.0, abs=0.05)
    with database.reading() as session:
        assert session.query(Registration).count() == 0
    assert client.get(f"/api/v1/viewports/{scene.viewport.id}/keypoints").json()["items"] == []


def test_the_water_is_drawn_where_the_camera_sees_it(client: TestClient, scene: Scene) -> None:
    """Horizon, ranges and heat map agree with the true camera; metres grow with the range."""
    rng = np.random.default_rng(1)
    points = _edited(scene)
    for point in points:
        point["u_px"] += rng.normal(0, 2)
        point["v_px"] += rng.normal(0, 2)
    solved = _solve(client, scene, keypoints=points)
    height_m = solved["camera"]["height_above_water_m"]
    assert solved["horizon"]["distance_m"] == pytest.approx(
        np.sqrt(2 * 7.323e6 * height_m), rel=1e-3
    )
    (horizon,) = solved["horizon"]["lines"]
    ranges = {line["range_m"]: line for line in solved["grid"] if line["kind"] == "range"}
    labels = [line["at_px"][1] for _, line in sorted(ranges.items())]
    assert labels == sorted(labels, reverse=True)
    assert labels[-1] > min(v for _, v in horizon)
    heat = solved["heat_map"]
    sigma_m, range_m = (np.array(heat[name], dtype=float) for name in ("sigma_m", "range_m"))
    assert np.isnan(sigma_m[0]).all() == np.isnan(range_m[0]).all()
    column = sigma_m[:, 16][np.isfinite(sigma_m[:, 16])]
    assert column[0] > 3 * column[-1]
    assert 0.1 < solved["camera"]["water_sigma_px"] < 20


def test_landmarks_of_the_site_are_projected_and_said_to_be_placed(
    client: TestClient, scene: Scene
) -> None:
    """A landmark another viewport placed is projected; it enters no fit by itself."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    assert client.put(path, json=scene.keypoints).status_code == 200
    solved = _solve(client, scene, keypoints=_edited(scene)[1:])
    by_name = {one["name"]: one for one in solved["landmarks"]}
    assert not by_name["Landmark 1"]["is_placed"]
    assert by_name["Landmark 2"]["is_placed"]
    assert by_name["Landmark 1"]["u_px"] == pytest.approx(scene.keypoints[0]["u_px"], abs=0.1)
    stored = _solve(client, scene)
    assert len(stored["points"]) == 14


def test_readiness_counts_what_is_missing_and_where_the_next_helps(
    client: TestClient, scene: Scene
) -> None:
    """Too few, fair and good keypoints get their level and a place for the next one."""
    points = _edited(scene)
    none = _solve(client, scene, keypoints=[])["readiness"]
    assert (none["level"], none["missing_for_solution"], none["missing_for_good"]) == (
        "too_few",
        6,
        10,
    )
    few = _solve(client, scene, keypoints=points[:4])["readiness"]
    assert (few["level"], few["missing_for_solution"]) == ("too_few", 2)
    assert few["next_point"]["sentence"] in few["sentences"]
    fair = _solve(client, scene, keypoints=points[:7])["readiness"]
    assert (fair["level"], fair["missing_for_good"]) == ("fair", 3)
    rng = np.random.default_rng(2)
    for point in points:
        point["u_px"] += rng.normal(0, 1)
    better = _solve(client, scene, keypoints=points[:8])["readiness"]["next_point"]
    assert better["sigma_after_px"] < better["sigma_before_px"]
    assert better["range_m"][0] < better["range_m"][1]
    assert _solve(client, scene, keypoints=points)["readiness"]["level"] == "good"


def test_what_cannot_be_solved_says_why_and_what_is_suspected(
    client: TestClient, scene: Scene
) -> None:
    """A swapped pair among seven is refused by PnP, named by key, and the rest still answers."""
    points = _edited(scene)[:7]
    for axis in ("u_px", "v_px"):
        points[1][axis], points[4][axis] = points[4][axis], points[1][axis]
    solved = _solve(client, scene, keypoints=points)
    assert "agree on any camera" in solved["methods"][0]["error"]
    assert solved["methods"][1]["error"] is None
    assert solved["suspicions"][0]["kind"] == "swapped"
    assert solved["suspicions"][0]["keys"] == ["k1", "k4"]
    assert solved["readiness"]["level"] == "refused"
    assert solved["camera"] is None
    assert solved["heat_map"] is None


@pytest.mark.parametrize(
    ("change", "field", "reason"),
    [
        ({"lat_deg": "53°61'0\"N"}, "keypoints.0.lat_deg", "61 minutes"),
        ({"lat_deg": 9.98, "lon_deg": 53.54}, "keypoints.0", "exchanged"),
        ({"lat_deg": None, "lon_deg": None, "height_m": None}, "keypoints.0", "landmark_id"),
        ({"key": "k1"}, "", "same key"),
        ({"u_px": "NaN"}, "keypoints.0.u_px", ""),
    ],
)
def test_wrong_entries_name_the_keypoint_and_the_fix(
    client: TestClient, scene: Scene, change: dict[str, Any], field: str, reason: str
) -> None:
    """Impossible angles, exchanged axes, unknown places and repeated keys are refused by name."""
    points = _edited(scene)
    points[0] |= change
    answer = client.post(f"/api/v1/viewports/{scene.viewport.id}/solve", json={"keypoints": points})
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"].endswith(field)
    assert reason in error["message"]


def test_text_and_heights_above_the_water_mean_the_same_place(
    client: TestClient, scene: Scene
) -> None:
    """DMS text and a height above the site's water level give the landmark its very place."""
    points = _edited(scene)
    plain = _solve(client, scene, keypoints=points)["points"][0]["enu_m"]
    level_m = client.get("/api/v1/sites").json()["items"][0]["water_level_m"]
    points[0] |= {
        "lat_deg": f"{points[0]['lat_deg']:.10f} N".replace(".", ","),
        "height_m": points[0]["height_m"] - level_m,
        "height_datum": "water",
    }
    np.testing.assert_allclose(
        _solve(client, scene, keypoints=points)["points"][0]["enu_m"], plain, atol=1e-4
    )
