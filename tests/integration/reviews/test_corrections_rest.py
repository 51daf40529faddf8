"""Corrections and re-matching over REST, on a run that is geometrically true."""

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.db import Database
from tests.factories.afloat import Afloat, make_afloat
from tests.factories.runs import FIRST_MMSI, Harbour, make_vessel

API = "/api/v1"


@pytest.fixture
def afloat(database: Database, harbour: Harbour) -> Afloat:
    """Give a run with two fused ships and a third that was not matched."""
    with database.writing() as session:
        make_vessel(session, FIRST_MMSI + 2, "GRETE")
        return make_afloat(session, harbour)


def edit_of(client: TestClient, pose_id: int) -> dict[str, Any]:
    """Return what a browser edits a pose with."""
    answer = client.get(f"{API}/poses/{pose_id}/edit")
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    assert answer.headers["etag"] == f'"{found["version"]}"'
    return found


def body_of(box: dict[str, float], **changed: object) -> dict[str, object]:
    """Return a box as it is sent: its place in metres from the reference."""
    return {name: value for name, value in box.items() if name != "up_m"} | changed


def send(client: TestClient, pose_id: int, body: object, version: int | None = None) -> Any:
    """Send a correction based on a version."""
    headers = {} if version is None else {"If-Match": f'"{version}"'}
    return client.post(f"{API}/poses/{pose_id}/corrections", json=body, headers=headers)


def drawn(edit: dict[str, Any], box: dict[str, float]) -> Any:
    """Project a box as a browser does, without distortion's help from the server's code."""
    camera, h = edit["camera"], np.radians(box["heading_deg"])
    forward, port = np.array([np.sin(h), np.cos(h), 0]), np.array([-np.cos(h), np.sin(h), 0])
    base = np.array([box["east_m"], box["north_m"], box["up_m"]])
    corners = [
        base + f * box["length_m"] / 2 * forward + p * box["width_m"] / 2 * port + [0, 0, up]
        for up in (0, box["height_m"])
        for f, p in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    x, y, z = (
        np.array(camera["R_cam_from_local"]) @ (np.array(corners) - camera["center_in_local_m"]).T
    )
    x, y = x / z, y / z
    k1, k2, p1, p2, k3 = camera["distortion"]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.column_stack(
        [u * camera["fx_px"] + camera["cx_px"], v * camera["fy_px"] + camera["cy_px"]]
    )


def test_the_generated_box_is_where_the_pose_was_drawn(ada: TestClient, afloat: Afloat) -> None:
    """Its bottom, drawn from the edit view alone, lies within 0.1 px of the stored segment."""
    for pose_id in afloat.pose_ids:
        edit = edit_of(ada, pose_id)
        pose = ada.get(f"{API}/poses/{pose_id}").json()
        assert edit["current"] == edit["generated"]
        assert (edit["generated"]["east_m"], edit["generated"]["north_m"]) == (0, 0)
        bottom = drawn(edit, edit["generated"])[:4]
        assert np.abs(bottom - pose["segments_px"]["corrected"]).max() < 0.1


def test_a_correction_stands_beside_the_generated_pose(ada: TestClient, afloat: Afloat) -> None:
    """It is drawn where it was put, keeps who and when, and changes nothing that was generated."""
    pose_id = afloat.pose_ids[0]
    before = ada.get(f"{API}/poses/{pose_id}").json()
    edit = edit_of(ada, pose_id)
    wanted = edit["generated"] | {
        "east_m": 4.5,
        "north_m": -2.0,
        "heading_deg": 91.5,
        "height_m": 12,
    }
    answer = send(ada, pose_id, body_of(wanted, comment="mast left out"))
    assert answer.status_code == 201, answer.text
    correction = answer.json()
    assert (correction["version"], correction["kind"], correction["user"]) == (
        1,
        "edited",
        "Test Person",
    )
    assert correction["box"] == pytest.approx(wanted, abs=1e-3)
    assert np.abs(drawn(edit, wanted) - correction["corners_in_image_px"]).max() < 0.1
    after = ada.get(f"{API}/poses/{pose_id}")
    assert after.headers["etag"] == '"1"'
    shown = after.json()
    assert shown["correction"]["id"] == correction["id"]
    assert shown["correction"]["vessel"]["mmsi"] == FIRST_MMSI
    untouched = set(before) - {"correction", "correction_version"}
    assert {name: shown[name] for name in untouched} == {name: before[name] for name in untouched}


def test_the_place_can_be_given_in_three_ways(ada: TestClient, afloat: Afloat) -> None:
    """Degrees, metres east and north, and metres across and away lead to the same box."""
    pose_id = afloat.pose_ids[0]
    box = edit_of(ada, pose_id)["generated"]
    sizes = {name: box[name] for name in ("heading_deg", "length_m", "width_m", "height_m")}
    first = send(ada, pose_id, {"across_m": 6, "away_m": 8, **sizes}).json()
    assert np.hypot(first["box"]["east_m"], first["box"]["north_m"]) == pytest.approx(10, abs=1e-3)
    place = {"lat_deg": first["lat_deg"], "lon_deg": first["lon_deg"]}
    second = send(ada, pose_id, {**place, **sizes}, 1).json()
    metres = {name: second["box"][name] for name in ("east_m", "north_m")}
    third = send(ada, pose_id, {**metres, **sizes}, 2).json()
    for other in (second, third):
        assert other["box"] == pytest.approx(first["box"], abs=1e-3)
    east, north, _ = edit_of(ada, pose_id)["camera"]["center_in_local_m"]
    away = -np.array([east, north]) / np.hypot(east, north)
    moved = np.array([metres["east_m"], metres["north_m"]])
    assert away @ moved == pytest.approx(8, abs=1e-3)
    assert np.array([away[1], -away[0]]) @ moved == pytest.approx(6, abs=1e-3)


def test_versions_keep_two_people_apart(ada: TestClient, ben: TestClient, afloat: Afloat) -> None:
    """An edit of an older version is refused with what stands and how it differs."""
    pose_id = afloat.pose_ids[0]
    box = edit_of(ada, pose_id)["generated"]
    assert send(ada, pose_id, body_of(box, heading_deg=85.0), 0).status_code == 201
    late = send(ben, pose_id, body_of(box, height_m=10.0), 0)
    problem = late.json()
    assert (late.status_code, late.headers["etag"], problem["version"]) == (412, '"1"', 1)
    assert problem["current"]["box"]["heading_deg"] == 85.0
    changed = {part["field"]: (part["yours"], part["theirs"]) for part in problem["changed"]}
    assert changed["heading_deg"] == (box["heading_deg"], 85.0)
    assert set(changed) == {"heading_deg", "height_m"}
    assert send(ben, pose_id, body_of(box)).status_code == 428
    assert send(ben, pose_id, body_of(box, heading_deg=85.0, height_m=10.0), 1).status_code == 201


def test_deleting_brings_the_generated_pose_back(ada: TestClient, afloat: Afloat) -> None:
    """The history stays, the deletion is a version, and the next edit follows it."""
    pose_id = afloat.pose_ids[0]
    url = f"{API}/poses/{pose_id}/corrections"
    assert ada.delete(url).status_code == 404
    box = edit_of(ada, pose_id)["generated"]
    send(ada, pose_id, body_of(box, width_m=9.0))
    assert ada.delete(url).status_code == 428
    deleted = ada.delete(url, headers={"If-Match": '"1"'})
    assert deleted.json() == {"pose_id": pose_id, "version": 2}
    edit = edit_of(ada, pose_id)
    assert (edit["version"], edit["correction"], edit["current"]) == (2, None, box)
    assert ada.get(f"{API}/poses", params={"corrected": True}).json()["items"] == []
    assert send(ada, pose_id, body_of(box, width_m=8.0), 2).json()["version"] == 3
    history = ada.get(url).json()["items"]
    assert [(one["version"], one["deleted_at"] is None) for one in history] == [
        (3, True),
        (2, False),
    ]
    listed = ada.get(f"{API}/poses", params={"corrected": True}).json()["items"]
    assert [pose["id"] for pose in listed] == [pose_id]


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"length_m": 0}, "length_m"),
        ({"height_m": -1}, "height_m"),
        ({"north_m": -2000}, "lat_deg"),
        ({"east_m": None}, "body"),
        ({"across_m": 1, "away_m": 1}, "body"),
    ],
)
def test_an_impossible_box_is_refused(
    ada: TestClient, afloat: Afloat, changed: dict[str, object], field: str
) -> None:
    """Empty boxes, two places or half of one, and boxes behind the camera store nothing."""
    pose_id = afloat.pose_ids[0]
    box = edit_of(ada, pose_id)["generated"]
    answer = send(ada, pose_id, body_of(box, **changed))
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, field)
    assert edit_of(ada, pose_id)["version"] == 0


def test_candidates_come_by_cost_with_those_refused(ada: TestClient, afloat: Afloat) -> None:
    """The pose's own vessel is the cheapest here; what cannot be is told with its reason."""
    found = ada.get(f"{API}/poses/{afloat.pose_ids[0]}/candidates").json()
    costs = [one["cost"] for one in found["candidates"]]
    assert costs == sorted(costs)
    assert len(costs) == 3
    first = found["candidates"][0]
    assert (first["mmsi"], first["current"], first["pose_id"]) == (FIRST_MMSI, True, None)
    assert set(first["cost_terms"]) == {"center_x", "bottom", "width", "score"}
    other = next(one for one in found["candidates"] if one["mmsi"] == FIRST_MMSI + 1)
    assert other["pose_id"] == afloat.pose_ids[1]
    assert [(one["mmsi"], one["reason"]) for one in found["refused"]] == [
        (afloat.far_mmsi, "out_of_range")
    ]
    assert found["refused"][0]["text"] == "it is too far away"


def test_a_rematch_is_a_correction_of_another_vessel(ada: TestClient, afloat: Afloat) -> None:
    """The box is computed for the chosen vessel; the generated pose and its vessel stay."""
    pose_id = afloat.pose_ids[0]
    answer = ada.post(f"{API}/poses/{pose_id}/rematch", json={"mmsi": afloat.free_mmsi})
    assert answer.status_code == 201, answer.text
    correction = answer.json()
    assert (correction["kind"], correction["mmsi"]) == ("rematched", afloat.free_mmsi)
    assert correction["vessel"]["name"] == "GRETE"
    assert (correction["length_m"], correction["cost"] > 0) == (90.0, True)
    pose = ada.get(f"{API}/poses/{pose_id}").json()
    assert (pose["vessel"]["mmsi"], pose["length_m"]) == (FIRST_MMSI, 60.0)
    assert pose["correction"]["vessel"]["name"] == "GRETE"
    box = pose["detection"]
    corners = np.array(correction["corners_in_image_px"])
    # The chosen vessel lies 200 m farther; fused, its box stands before the detection.
    assert corners[:, 0].mean() == pytest.approx((box["x1_px"] + box["x2_px"]) / 2, abs=30)
    now = ada.get(f"{API}/poses/{pose_id}/candidates").json()["candidates"]
    assert [one["mmsi"] for one in now if one["current"]] == [afloat.free_mmsi]
    edited = send(ada, pose_id, body_of(correction["box"], height_m=11.0), 1).json()
    assert (edited["kind"], edited["mmsi"]) == ("edited", afloat.free_mmsi)
    assert edited["box"] == pytest.approx(correction["box"] | {"height_m": 11.0}, abs=1e-3)


def test_a_vessel_that_cannot_be_is_refused_with_the_reason(
    ada: TestClient, afloat: Afloat
) -> None:
    """Not heard, and too far away, are different answers; both name `mmsi`."""
    url = f"{API}/poses/{afloat.pose_ids[0]}/rematch"
    for mmsi, words in ((123456789, "not heard"), (afloat.far_mmsi, "too far away")):
        answer = ada.post(url, json={"mmsi": mmsi})
        error = answer.json()["errors"][0]
        assert (answer.status_code, error["field"]) == (422, "mmsi")
        assert words in error["message"]


def test_a_detection_without_a_pose_gets_one_by_a_person(ada: TestClient, afloat: Afloat) -> None:
    """The new pose is marked, can be graded, and neither vessel nor detection gets a second."""
    params = {"run_id": afloat.run_id}
    boxes = ada.get(f"{API}/images/{afloat.image_id}/detections", params=params).json()["items"]
    assert [box["pose_id"] for box in boxes] == [*afloat.pose_ids, None]
    url = f"{API}/detections/{afloat.free_detection_id}"
    found = ada.get(f"{url}/candidates", params=params).json()["candidates"]
    assert found[0]["mmsi"] == afloat.free_mmsi
    taken = ada.post(f"{url}/poses", json={**params, "mmsi": FIRST_MMSI})
    assert (taken.status_code, taken.json()["pose_id"]) == (409, afloat.pose_ids[0])
    made = ada.post(f"{url}/poses", json={**params, "mmsi": afloat.free_mmsi})
    assert made.status_code == 201, made.text
    pose = made.json()
    assert (pose["person_made"], pose["vessel"]["name"]) == (True, "GRETE")
    again = ada.post(f"{url}/poses", json={**params, "mmsi": afloat.free_mmsi})
    assert (again.status_code, again.json()["pose_id"]) == (409, pose["id"])
    graded = ada.post(f"{API}/poses/{pose['id']}/reviews", json={"grade": "good"})
    assert graded.status_code == 201
    listed = ada.get(f"{API}/poses", params={**params, "person_made": True}).json()["items"]
    assert [one["id"] for one in listed] == [pose["id"]]
    elsewhere = ada.get(f"{url}/candidates", params={"run_id": 999_999})
    assert elsewhere.status_code == 404


def test_the_camera_of_a_run_is_told(ada: TestClient, afloat: Afloat) -> None:
    """Its place is the registration's; a pose's centroid, projected through it, fits."""
    camera = ada.get(f"{API}/runs/{afloat.run_id}/camera").json()
    assert camera["center_in_enu_m"] == pytest.approx([0, 0, 30], abs=1e-3)
    assert camera["height_m"] - camera["origin"]["height_m"] == pytest.approx(30, abs=1e-3)
    assert (camera["width_px"], camera["distortion"][0]) == (2560, -0.1)
    R = np.array(camera["R_cam_from_enu"])
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-9
