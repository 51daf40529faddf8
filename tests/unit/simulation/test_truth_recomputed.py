"""Truth computed once more, from the passage and the ship's mesh, by PROJ and OpenCV alone."""

from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from pyproj import Geod, Transformer

from app.simulation.harbour import Frame, Harbour, make_harbour
from app.simulation.settings import HarbourSettings
from app.simulation.ship_plans import Fleet
from app.simulation.truth import VesselTruth
from app.simulation.vessels import Vessel

SEEDS = (31, 482, 90210)
FINER = 4  # samples a pixel, along each axis, of the silhouettes drawn here


@pytest.fixture(scope="module", params=SEEDS)
def unseen(request: pytest.FixtureRequest) -> Harbour:
    """Give a harbour of some seed with the hulls of the judging fleet."""
    settings = HarbourSettings(fleet=Fleet.JUDGING)
    return make_harbour(request.param, 4, 400, 300, settings=settings)


@dataclass(frozen=True)
class Placed:
    """A ship put on the water by PROJ: columns forward, port, up in ENU, and its middle."""

    axes: np.ndarray
    middle: np.ndarray

    def in_enu(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the ship in ENU."""
        return points @ self.axes.T + self.middle


def placed_by_proj(harbour: Harbour, frame: Frame, vessel: Vessel) -> Placed:
    """Put a vessel where its passage has it at the time of an image, on the tide of that time."""
    origin = harbour.site.origin
    to_enu = Transformer.from_pipeline(
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart "
        f"+step +proj=topocentric +lat_0={origin.lat_deg} +lon_0={origin.lon_deg} "
        f"+h_0={origin.height_m}"
    )

    def enu(lon_deg: float, lat_deg: float, height_m: float) -> np.ndarray:
        return np.array(to_enu.transform(lon_deg, lat_deg, height_m))

    motion = vessel.passage.at((frame.captured_at - harbour.start).total_seconds())
    lon, lat, _ = to_enu.transform(motion.east_m, motion.north_m, 0.0, direction="INVERSE")
    level = origin.height_m + frame.water_level_m
    middle = enu(lon, lat, level)
    up = enu(lon, lat, level + 100.0) - middle
    ahead_lon, ahead_lat, _ = Geod(ellps="WGS84").fwd(lon, lat, motion.heading_deg, 20.0)
    behind_lon, behind_lat, _ = Geod(ellps="WGS84").fwd(lon, lat, motion.heading_deg + 180, 20.0)
    ahead = enu(ahead_lon, ahead_lat, level) - enu(behind_lon, behind_lat, level)
    up, ahead = up / np.linalg.norm(up), ahead / np.linalg.norm(ahead)
    return Placed(np.column_stack([ahead, np.cross(up, ahead), up]), middle)


def projected(frame: Frame, points_in_enu: np.ndarray) -> np.ndarray:
    """Pixels (n, 2) of points by OpenCV."""
    camera = frame.viewport.camera
    rotation, _ = cv2.Rodrigues(camera.R_cam_from_world)
    inner = camera.intrinsics
    pixels, _ = cv2.projectPoints(
        points_in_enu, rotation, camera.t_cam_from_world, inner.K, inner.distortion
    )
    return np.asarray(pixels[:, 0])


def vessels_in(harbour: Harbour, frame: Frame) -> list[tuple[Vessel, VesselTruth]]:
    """Return the whole vessels of an image with what is said of them, convoys as one."""
    by_name = {vessel.identifier: vessel for vessel in harbour.vessels}
    return [(by_name[t.identifier], t) for t in frame.truth if t.part_of is None]


def silhouette(frame: Frame, vessel: Vessel, placed: Placed) -> tuple[np.ndarray, np.ndarray]:
    """Draw a ship over three images' width and height: samples, and those within the image."""
    inner = frame.viewport.camera.intrinsics
    mesh = vessel.ship.mesh
    pixels = projected(frame, placed.in_enu(mesh.vertices))
    size = np.array([inner.width_px, inner.height_px])
    canvas = np.zeros(tuple(3 * FINER * size[::-1]), dtype=np.uint8)
    # OpenCV draws about sample centres; pixel (0, 0) is the centre of the first pixel.
    samples = (pixels + 0.5 + size) * FINER - 0.5
    corners = np.rint(samples[mesh.faces] * 16).astype(np.int32)
    for face in corners:
        cv2.fillPoly(canvas, [face], 1, shift=4)
    inside = np.zeros_like(canvas, dtype=bool)
    left, top = FINER * size
    inside[top : 2 * top, left : 2 * left] = True
    return canvas.astype(bool), inside


def test_poses_and_corners_follow_from_the_passage(unseen: Harbour) -> None:
    """Place, attitude and corners agree with PROJ to two millimetres, pixels with OpenCV's."""
    checked = 0
    for frame in unseen.frames:
        camera = frame.viewport.camera
        for vessel, truth in vessels_in(unseen, frame):
            placed = placed_by_proj(unseen, frame, vessel)
            half = np.array([vessel.ship.length_m / 2, vessel.ship.width_m / 2, 0])
            signs = np.array([(1, 1, 0), (1, -1, 0), (-1, -1, 0), (-1, 1, 0)])
            above = np.array([0, 0, vessel.ship.height_m])
            corners = placed.in_enu(np.vstack([signs * half, signs * half + above]))
            R, _ = cv2.Rodrigues(truth.rotvec_cam_from_vessel)

            assert truth.corners_in_enu_m == pytest.approx(corners, abs=2e-3)
            centroid = camera.R_cam_from_world @ (corners.mean(axis=0) - camera.center_in_world)
            assert truth.centroid_in_cam_m == pytest.approx(centroid, abs=2e-3)
            assert pytest.approx(camera.R_cam_from_world @ placed.axes, abs=1e-5) == R
            shown = np.isfinite(truth.corners_in_image_px).all(axis=1)
            assert truth.corners_in_image_px[shown] == pytest.approx(
                projected(frame, corners)[shown], abs=0.02
            )
            checked += 1
    assert checked >= len(unseen.frames)


def test_silhouettes_and_what_shows_of_them_follow_from_the_mesh(unseen: Harbour) -> None:
    """Boxes agree to a pixel; what the border and other ships take away agrees to some percent."""
    off = []
    for frame in unseen.frames:
        drawn = []
        for vessel, truth in vessels_in(unseen, frame):
            placed = placed_by_proj(unseen, frame, vessel)
            distance = np.linalg.norm(placed.middle - frame.viewport.camera.center_in_world)
            drawn.append((distance, truth, *silhouette(frame, vessel, placed)))
        drawn.sort(key=lambda one: one[0])
        nearer = np.zeros(1, dtype=bool)
        for _, truth, mask, inside in drawn:
            shown = mask & inside & ~nearer
            share = shown.sum() / mask.sum()
            # Land may hide more than ships do; nothing may show more than these leave.
            assert truth.visible_fraction <= share + 0.06
            off.append(share - truth.visible_fraction)
            if truth.box_px is not None and share - truth.visible_fraction < 0.02:
                rows, columns = np.nonzero(shown)
                inner = frame.viewport.camera.intrinsics
                edges = np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1])
                box = edges / FINER - np.tile([inner.width_px, inner.height_px], 2)
                # Masts thinner than half a pixel fall between the renderer's samples.
                assert np.array(truth.box_px)[[0, 2, 3]] == pytest.approx(box[[0, 2, 3]], abs=1.2)
            nearer = nearer | mask
    assert np.median(np.abs(off)) < 0.03
