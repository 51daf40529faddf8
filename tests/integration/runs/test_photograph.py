"""The main job on a real photograph, with real weights, from upload to pose, over REST alone."""

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.runs import RunImage
from tests.factories.norderelbe import CAPTURED_AT, IMAGE, MMSI, Published
from tests.worker_process import WorkerProcess, wait_until


def ais_csv(vessel: dict[str, Any]) -> str:
    """Write a label's vessel as the plain table, heard as long before the image as it says."""
    heard_at = CAPTURED_AT - timedelta(seconds=vessel["secondsSinceLastPositionReport"])
    size = vessel["size"]
    header = "mmsi,time,lat,lon,sog,cog,heading,rot,to_bow,to_stern,to_port,to_starboard,name"
    row = (
        f"{MMSI},{heard_at.isoformat()},{vessel['lat']},{vessel['long']},{vessel['speed']},"
        f"{vessel['heading']},{vessel['heading']},,{size['to_bow']},{size['to_stern']},"
        f"{size['to_port']},{size['to_starboard']},HARBOUR FERRY"
    )
    return f"{header}\n{row}\n"


def created(response: Any) -> dict[str, Any]:
    """Return the JSON of a successful answer."""
    assert response.status_code in {200, 201, 202}, response.text
    body: dict[str, Any] = response.json()
    return body


@pytest.mark.slow
def test_a_real_photograph_becomes_a_pose_of_its_vessel(
    client: TestClient,
    database: Database,
    start_worker: Callable[..., WorkerProcess],
    shared_dir: Path,
) -> None:
    """Photograph, camera, AIS and the tide become the published pose, within 5 m."""
    published = Published.read(shared_dir)
    camera, origin = published.camera, published.origin
    vessel = published.label["vessels"][0]
    start_worker()

    site = created(
        client.post(
            "/api/v1/sites",
            json={
                "name": "Norderelbe",
                "origin": {"lat_deg": origin.lat_deg, "lon_deg": origin.lon_deg, "height_m": 0.0},
                "water_level_m": 20.0,
                "timezone": "Europe/Berlin",
            },
        )
    )
    # The constant is wrong; a gauge that was read before and after the photograph is right.
    readings = [f"{(CAPTURED_AT + timedelta(hours=hours)).isoformat()},0.0" for hours in (-1, 1)]
    gauge = client.post(f"/api/v1/sites/{site['id']}/water-levels", content="\n".join(readings))
    assert gauge.json()["readings"] == 2
    registered = created(
        client.post(
            "/api/v1/cameras",
            json={
                "site_id": site["id"],
                "name": "Kehrwieder",
                "width_px": camera["width"],
                "height_px": camera["height"],
                "K": camera["K"],
            },
        )
    )
    viewport = created(
        client.post("/api/v1/viewports", json={"camera_id": registered["id"], "name": "south"})
    )
    created(
        client.post(
            f"/api/v1/viewports/{viewport['id']}/registrations",
            json={
                "method": "given",
                "rotation": published.rotation_cam_from_enu(),
                "center": {
                    "lat_deg": camera["center_lat_deg"],
                    "lon_deg": camera["center_lon_deg"],
                    "height_m": camera["center_height_m"],
                },
            },
        )
    )
    image = created(
        client.post(
            "/api/v1/images",
            files={"file": (f"{IMAGE}.jpg", published.photograph)},
            data={"camera_id": registered["id"], "captured_at": CAPTURED_AT.isoformat()},
        )
    )
    created(
        client.post(
            "/api/v1/ais/files",
            files={"file": ("heard.csv", ais_csv(vessel).encode())},
        )
    )
    model = created(
        client.post(
            "/api/v1/models",
            files={"file": ("yolox_nano.onnx", published.weights)},
            data={"name": "yolox-nano", "family": "yolox"},
        )
    )
    wait_until(
        lambda: client.get(f"/api/v1/models/{model['id']}").json()["status"] == "ready",
        what="a ready model",
    )
    run = created(
        client.post(
            "/api/v1/runs",
            # The published label is what the published method makes of it.
            json={"viewport_id": viewport["id"], "detector": "yolox-nano", "preset": "paper"},
        )
    )
    wait_until(
        lambda: client.get(f"/api/v1/runs/{run['id']}").json()["status"] == "succeeded",
        what="a finished run",
    )

    poses = client.get("/api/v1/poses", params={"run_id": run["id"]}).json()["items"]
    assert [pose["vessel"]["mmsi"] for pose in poses] == [MMSI]
    pose = poses[0]
    assert pose["image"]["id"] == image["id"]
    assert pose["vessel"]["name"] == "HARBOUR FERRY"
    # Across and along the view; the vertical axis carries the water level's error.
    published = np.array(published.label["objects"][0]["position"]["centroid"])
    apart = np.array(pose["centroid_in_cam_m"]) - published
    up_in_cam = np.array(camera["R_cam_from_local_enu"])[:, 2]
    horizontal_m = np.linalg.norm(apart - (apart @ up_in_cam) * up_in_cam)
    assert horizontal_m < 5.0
    with database.reading() as session:
        done = session.get_one(RunImage, (run["id"], image["id"]))
    assert (done.water_level_m, done.water_level_source) == (0.0, "series")
