"""CPU time of matching and fusion of an image with 20 vessels, beside the paper's formulas plainly.

One image a call, and whiles of images as runs fuse them. The plain version is what one would type
from the paper: a loop over pairs, a loop over poses, nothing checked, flagged or explained.
"""

import statistics
import time
from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np
from scipy.optimize import linear_sum_assignment

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.fusion import FusionSettings, MatchingMethod, Preset, SeenImage, fuse_series
from app.domain.vessel_state import VesselState
from app.garbage import set_startup_aside
from benchmarks.other_ships import FRAME, Weather, make_roads
from benchmarks.workbench import show_load

ROUNDS = 15
AIM_MS = 1.0
WAYS = {
    "paper": FusionSettings(),
    "waterline, matching paper": FusionSettings(preset=Preset.WATERLINE),
    "waterline, matching likelihood": FusionSettings(
        preset=Preset.WATERLINE, matching=MatchingMethod.LIKELIHOOD
    ),
}


def main() -> None:
    """Print milliseconds of CPU an image, each way beside the plain one of the same round."""
    roads = make_roads(3, Weather(position_sigma_m=3.0, family="round stern"))
    detections = [ship.detection for ship in roads.ships]
    states = [ship.state for ship in roads.ships]
    set_startup_aside()  # as in the worker: collections look at what fusion makes, and no more
    print(f"{'ms of CPU an image of 20 vessels':<40}{'median':>8}{'least':>8}   of the plain way")
    plain = [_taken_ms(lambda: plainly(roads.camera, detections, states), 1) for _ in range(ROUNDS)]
    print(f"{'the paper, plainly':<40}{statistics.median(plain):8.2f}{min(plain):8.2f}")
    for label, settings in WAYS.items():
        for count in (1, 10, 25):
            images = [SeenImage(detections, states, 0.0, 10.0 * i) for i in range(count)]
            shares, taken = [], []
            for _ in range(ROUNDS):
                beside = _taken_ms(lambda: plainly(roads.camera, detections, states), 1)
                fused = partial(fuse_series, roads.camera, FRAME, images, settings)
                taken.append(_taken_ms(fused, count))
                shares.append(taken[-1] / beside)
            name = f"{label}, {count} image{'s' if count > 1 else ''} a call"
            figures = f"{statistics.median(taken):8.2f}{min(taken):8.2f}"
            met = "met" if min(taken) <= AIM_MS else "MISSED"
            print(
                f"{name:<40}{figures}{statistics.median(shares):8.2f}   1 ms: {met}",
            )
    show_load()


def _taken_ms(do: Callable[[], object], count: int) -> float:
    begun = time.process_time()
    do()
    return (time.process_time() - begun) * 1000 / count


def plainly(
    camera: Camera, detections: list[Detection], states: list[VesselState]
) -> list[tuple[FloatArray, FloatArray]]:
    """Match and fuse as printed: returns centroids in the camera and corners (8, 3)."""
    R, C, K = camera.R_cam_from_world, camera.center_in_world, camera.intrinsics.K
    width, height = camera.intrinsics.width_px, camera.intrinsics.height_px
    segments = [plane_segment(state) for state in states]
    costs = np.zeros((len(detections), len(segments)))
    for (i, box), (j, (corners, _)) in product(enumerate(detections), enumerate(segments)):
        pixels = (R @ (corners - C).T).T @ K.T
        pixels = pixels[:, :2] / pixels[:, 2:]
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        center = abs((box.x1_px + box.x2_px) / 2 - (low[0] + high[0]) / 2) / width
        bottom = abs(box.y2_px - high[1]) / height
        wide = abs((box.x2_px - box.x1_px) - (high[0] - low[0])) / width
        costs[i, j] = (2 * center + bottom + wide) / box.score
    rows, columns = linear_sum_assignment(costs)
    return [box_of(camera, detections[i], *segments[j]) for i, j in zip(rows, columns, strict=True)]


def plane_segment(state: VesselState) -> tuple[FloatArray, FloatArray]:
    """Return the corners (4, 3) of a vessel's plane segment and its z_v."""
    antenna = FRAME.position(state.lat_deg, state.lon_deg, 0.0)
    east, north, up = FRAME.axes(state.lat_deg, state.lon_deg)
    heading = np.radians(state.heading_deg)
    forward = np.sin(heading) * east + np.cos(heading) * north
    port = np.cross(up, forward)
    antenna = antenna + forward * state.speed_kn * 1852 / 3600 * state.age_s
    bow, stern = antenna + state.to_bow_m * forward, antenna - state.to_stern_m * forward
    left, right = state.to_port_m * port, -state.to_starboard_m * port
    return np.array([bow + left, bow + right, stern + right, stern + left]), up


def box_of(
    camera: Camera, box: Detection, corners: FloatArray, up: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Correct a segment by its detection and raise it (paper, delta v and h)."""
    R, C, K = camera.R_cam_from_world, camera.center_in_world, camera.intrinsics.K
    inverse = R.T @ np.linalg.inv(K)
    pixels = product((box.x1_px, box.x2_px), (box.y1_px, box.y2_px))
    p1, p2, p3, p4 = (inverse @ np.array([u, v, 1.0]) for u, v in pixels)
    normals = np.array([np.cross(up, p2), np.cross(up, p4), np.cross(p2, p4), np.cross(p1, p3)])
    a, b, g, d = (normal / np.linalg.norm(normal) for normal in normals)
    away = corners - C
    moved = corners - ((away @ g).max() * g + (away @ a).max() * a / 2 + (away @ b).min() * b / 2)
    top = moved - ((moved - C) @ d).min() * d
    all_corners = np.vstack([moved, top])
    return R @ (all_corners.mean(axis=0) - C), all_corners


if __name__ == "__main__":
    main()
