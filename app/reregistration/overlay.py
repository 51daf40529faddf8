"""What is drawn over a new photograph to judge its turn: before and after.

Before: where the reference's registration puts landmarks and horizon, as if nothing had moved.
After: where the turned one puts them. With the right turn they lie on what they name. The
reference photograph itself, turned likewise, can be laid over the new one.
"""

from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.domain.arrays import Float32Array, FloatArray
from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame
from app.domain.rotations import matrix_from_rotvec
from app.errors import Conflict
from app.imagery import upright
from app.registration.service import camera_of
from app.reregistration import repository
from app.storage import Storage
from app.tables.imagery import Image
from app.tables.reregistration import Reregistration, ReregistrationImage

EARTH_RADIUS_M = 6_371_000.0
HORIZON_STEPS = 49
WARPED_WIDTH_PX = 1280
QUALITY = 85


def overlay_of(
    session: Session, row: ReregistrationImage, parent: Reregistration
) -> dict[str, Any]:
    """Return landmarks and horizon in an image's pixels with the old and with the turned pose."""
    before, frame = camera_of(session, parent.registration_id)
    turned = matrix_from_rotvec(row.rotation_from_reference or (0.0, 0.0, 0.0))
    after = Camera(before.intrinsics, turned @ before.R_cam_from_world, before.center_in_world)
    landmarks = [point.landmark for point in repository.keypoints(session, parent.viewport_id)]
    places: FloatArray = np.array(
        [frame.position(at.lat_deg, at.lon_deg, at.height_m) for at in landmarks]
    ).reshape(-1, 3)
    water_level_m = parent.viewport.camera.site.water_level_m
    names = [landmark.name for landmark in landmarks]
    return {
        "width_px": before.intrinsics.width_px,
        "height_px": before.intrinsics.height_px,
        "before": _drawn(before, frame, water_level_m, places, names),
        "after": _drawn(after, frame, water_level_m, places, names),
    }


def warped_reference(
    storage: Storage, image: Image, row: ReregistrationImage, camera: Camera
) -> bytes:
    """Return the reference photograph as the turned camera would have shown it, a JPEG.

    1280 px wide; what the reference did not show is black. Kept, because it never changes.
    """
    name = "-".join(f"{part:.6f}" for part in row.rotation_from_reference or (0.0, 0.0, 0.0))
    return storage.derived(
        f"turned/{image.sha256[:2]}/{image.sha256}-{name}.jpg",
        lambda: _warped(
            storage.read(image.sha256),
            camera,
            matrix_from_rotvec(row.rotation_from_reference or (0.0, 0.0, 0.0)),
        ),
    )


def _drawn(
    camera: Camera,
    frame: EnuFrame,
    water_level_m: float,
    places: FloatArray,
    names: list[str],
) -> dict[str, Any]:
    landmarks = [
        {"name": name, "u_px": float(u_px), "v_px": float(v_px)}
        for name, (u_px, v_px) in zip(names, camera.project(places), strict=True)
        if np.isfinite(u_px) and np.isfinite(v_px)
    ]
    return {"landmarks": landmarks, "horizon": _horizon(camera, frame, water_level_m)}


def _horizon(camera: Camera, frame: EnuFrame, water_level_m: float) -> list[list[float]]:
    """Return the sea's horizon as pixels from left to right, also beyond the image's sides."""
    place = frame.geodetic(camera.center_in_world)
    axes = frame.axes(place.lat_deg, place.lon_deg)
    height_m = max(place.height_m - water_level_m, 0.0)
    dip = np.sqrt(2 * height_m / EARTH_RADIUS_M)
    east, north, _ = axes @ camera.R_cam_from_world[2]
    half = np.arctan(camera.intrinsics.width_px / camera.intrinsics.K[0, 0])
    bearing = np.arctan2(east, north) + np.linspace(-half, half, HORIZON_STEPS)
    ahead = np.column_stack(
        [
            np.sin(bearing) * np.cos(dip),
            np.cos(bearing) * np.cos(dip),
            np.full(len(bearing), -np.sin(dip)),
        ]
    )
    pixels = camera.project(camera.center_in_world + 1e5 * ahead @ axes)
    kept: list[list[float]] = pixels[np.isfinite(pixels).all(axis=1)].tolist()
    return kept


def _warped(data: bytes, camera: Camera, turned: FloatArray) -> bytes:
    import cv2  # noqa: PLC0415 - the web process starts without it

    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    if picture is None:
        raise Conflict("the reference photograph cannot be decoded")
    seen = upright.turned(np.asarray(picture, np.uint8), upright.orientation_of(data))
    from_u, from_v = _sources(camera, turned)
    warped = cv2.remap(seen, from_u, from_v, cv2.INTER_LINEAR)
    _, encoded = cv2.imencode(".jpg", warped, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return encoded.tobytes()


def _sources(camera: Camera, turned: FloatArray) -> tuple[Float32Array, Float32Array]:
    """Return where in the reference each pixel of the smaller, turned picture comes from."""
    import cv2  # noqa: PLC0415 - the web process starts without it

    intrinsics = camera.intrinsics
    scale = min(1.0, WARPED_WIDTH_PX / intrinsics.width_px)
    width, height = round(intrinsics.width_px * scale), round(intrinsics.height_px * scale)
    # A turn is smooth: the exact way for every sixteenth pixel, straight lines between.
    nodes_u, nodes_v = np.arange(0, width + 16, 16), np.arange(0, height + 16, 16)
    nodes = np.stack(np.meshgrid(nodes_u, nodes_v), axis=2).reshape(-1, 2)
    lens = Camera(intrinsics, np.eye(3), np.zeros(3))
    seen = lens.project(lens.rays((nodes + 0.5) / scale - 0.5) @ turned)
    coarse = np.nan_to_num(seen, nan=-1e4).reshape(len(nodes_v), len(nodes_u), 2)
    u, v = np.meshgrid(
        np.arange(width, dtype=np.float32) / 16, np.arange(height, dtype=np.float32) / 16
    )
    fine = cv2.remap(coarse.astype(np.float32), u, v, cv2.INTER_LINEAR)
    return np.asarray(fine[..., 0], np.float32), np.asarray(fine[..., 1], np.float32)
