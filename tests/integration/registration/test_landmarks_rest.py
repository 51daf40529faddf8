"""Landmarks over REST: shared by a site, typed as people write, as CSV and GeoJSON both ways."""

from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.integration.registration.conftest import Scene

PLACE = {"lat_deg": "53°32'33.4\"N", "lon_deg": "9 58 51 E", "height_m": 3.5}


@pytest.fixture
def site(client: TestClient, scene: Scene) -> dict[str, Any]:
    """Give the scene's site, its water 39.6 m above the ellipsoid."""
    del scene
    found: dict[str, Any] = client.get("/api/v1/sites").json()["items"][0]
    path = f"/api/v1/sites/{found['id']}"
    version = {"If-Match": client.get(path).headers["etag"]}
    changed: dict[str, Any] = client.patch(
        path, json={"water_level_m": 39.6}, headers=version
    ).json()
    return changed


def test_a_landmark_is_made_moved_and_removed(client: TestClient, site: dict[str, Any]) -> None:
    """Text and a height above the water are stored as degrees above the ellipsoid, by version."""
    path = f"/api/v1/sites/{site['id']}/landmarks"
    made = client.post(path, json=PLACE | {"name": "Crane", "height_datum": "water"})
    assert made.status_code == 201, made.text
    landmark = made.json()
    assert landmark["lat_deg"] == pytest.approx(53.5426111111)
    assert landmark["height_m"] == pytest.approx(43.1)
    assert landmark["height_above_water_m"] == pytest.approx(3.5)
    own, version = made.headers["location"], {"If-Match": made.headers["etag"]}
    assert client.post(path, json=PLACE | {"name": "Crane"}).status_code == 409
    assert client.patch(own, json={"height_m": 50}).status_code == 428
    moved = client.patch(own, json={"height_m": 50, "lon_deg": "9,981"}, headers=version)
    assert (moved.json()["height_m"], moved.json()["lon_deg"]) == (50, 9.981)
    assert client.patch(own, json={"name": "Mast"}, headers=version).status_code == 412
    assert client.get(path).json()["items"] == [client.get(own).json()]
    assert client.delete(own, headers=version).status_code == 412
    assert client.delete(own).status_code == 204
    assert client.get(own).status_code == 404


def test_a_landmark_in_use_stays(client: TestClient, scene: Scene) -> None:
    """What a viewport has a keypoint of is not removed, and the viewport is named."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    first = client.put(path, json=scene.keypoints).json()["items"][0]
    refused = client.delete(f"/api/v1/landmarks/{first['landmark_id']}")
    assert refused.status_code == 409
    assert "North-west" in refused.json()["detail"]
    assert client.get(f"/api/v1/landmarks/{first['landmark_id']}").json()["viewport_count"] == 1


@pytest.mark.parametrize(
    ("change", "field", "reason"),
    [
        ({"lat_deg": "53°61'0\"N"}, "lat_deg", "61 minutes"),
        ({"lat_deg": "9.98", "lon_deg": "53.54"}, "lat_deg", "exchanged"),
        ({"lon_deg": "53 N"}, "lon_deg", "is a latitude"),
        ({"height_m": "high"}, "height_m", "number"),
        ({"name": "\x00"}, "name", ""),
    ],
)
def test_a_wrong_landmark_is_refused_by_field(
    client: TestClient, site: dict[str, Any], change: dict[str, str], field: str, reason: str
) -> None:
    """The field and the fix are named, and nothing is stored."""
    path = f"/api/v1/sites/{site['id']}/landmarks"
    answer = client.post(path, json=PLACE | {"name": "Crane"} | change)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"].endswith(field)
    assert reason in error["message"]
    assert client.get(path).json()["items"] == []


@pytest.mark.parametrize("kind", ["csv", "geojson"])
def test_landmarks_travel_as_files(client: TestClient, site: dict[str, Any], kind: str) -> None:
    """What is exported can be imported again unchanged; moving known ones must be asked for."""
    path = f"/api/v1/sites/{site['id']}/landmarks"
    for name in ("Crane, top", "=1+1", "'quoted"):
        assert client.post(path, json=PLACE | {"name": name, "height_m": 7.125}).status_code == 201
    file = client.get(f"{path}.{kind}")
    again = client.post(f"{path}.{kind}", content=file.content)
    assert again.json() == {"created": 0, "moved": 0, "unchanged": 3}, again.text
    moved = file.text.replace("7.125", "8.125")
    refused = client.post(f"{path}.{kind}", content=moved)
    assert refused.status_code == 422
    assert "update=true" in refused.json()["detail"]
    asked = client.post(f"{path}.{kind}?update=true", content=moved)
    assert asked.json() == {"created": 0, "moved": 3, "unchanged": 0}
    if kind == "csv":
        assert "'=1+1," in file.text


def test_a_table_with_decimal_commas_is_understood_or_refused(
    client: TestClient, site: dict[str, Any]
) -> None:
    """Semicolons between columns let commas be decimal; between commas they cannot be told."""
    path = f"/api/v1/sites/{site['id']}/landmarks.csv"
    german = "name;lat_deg;lon_deg;height_m\nKran;53,5426;9,9808;43,1\n"
    assert client.post(path, content=german).json()["created"] == 1
    found = client.get(path.removesuffix(".csv")).json()["items"][0]
    assert (found["lat_deg"], found["lon_deg"], found["height_m"]) == (53.5426, 9.9808, 43.1)
    commas = "Mast,53,5426,9,9808,43,1\n"
    refused = client.post(path, content=commas)
    assert refused.status_code == 422
    assert "semicolons" in refused.json()["detail"]
    twice = "Pier;53,54;9,98;1\nPier;53,54;9,98;1\n"
    assert "twice" in client.post(path, content=twice).json()["detail"]
    assert client.post(path, content=b"\xff\xfe").status_code == 422
    assert client.post(path, content=b"a" * 1_100_000).status_code == 413


@pytest.mark.parametrize("kind", ["csv", "geojson"])
def test_keypoints_travel_as_files(client: TestClient, scene: Scene, kind: str) -> None:
    """A viewport's keypoints leave and come back with pixels and roles, by version."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints"
    scene.keypoints[2]["role"] = "check"
    stored = client.put(path, json=scene.keypoints).json()
    file = client.get(f"{path}.{kind}")
    assert client.put(f"{path}.{kind}", content=file.content).status_code == 428
    version = {"If-Match": file.headers["etag"]}
    again = client.put(f"{path}.{kind}", content=file.content, headers=version)
    assert again.status_code == 200, again.text
    assert again.json() == stored
    assert client.put(f"{path}.{kind}", content=file.content, headers=version).status_code == 412


@pytest.mark.parametrize(
    "text",
    ["{", "[]", '{"type": "FeatureCollection"}', '{"type":"FeatureCollection","features":[1]}'],
)
def test_what_is_no_geojson_is_refused(client: TestClient, scene: Scene, text: str) -> None:
    """Broken JSON and other documents give 422 with the reason."""
    path = f"/api/v1/viewports/{scene.viewport.id}/keypoints.geojson"
    answer = client.put(path, content=text)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"].startswith("features")


def test_a_typed_place_is_understood(client: TestClient, site: dict[str, Any]) -> None:
    """One text or two, the height above the water: degrees, ENU and the distance come back."""
    path = f"/api/v1/sites/{site['id']}/place"
    typed = {"lat": "53 32 33.4 N, 9 58 51 E", "height_m": 3.5, "height_datum": "water"}
    one = client.get(path, params=typed).json()
    two = client.get(
        path, params={"lat": "53,5426111111", "lon": "9.9808333333", "height_m": 43.1}
    ).json()
    assert one["lat_deg"] == pytest.approx(two["lat_deg"])
    assert one["enu_m"] == pytest.approx(two["enu_m"], abs=1e-3)
    refused = client.get(path, params={"lat": "53.5", "lon": "9 61 0"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "lon_deg"
