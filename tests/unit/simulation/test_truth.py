"""Truth against other ways to compute it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from app.simulation.fleet_view import view_hulls
from app.simulation.harbour import Frame, Harbour
from app.simulation.ships import Ship, ShipType, build_ship
from app.simulation.truth import PlacedVessel, VesselClass, VesselTruth, vessel_truths


def _whole(harbour: Harbour) -> list[tuple[Frame, VesselTruth]]:
    return [(f, t) for f in harbour.frames for t in f.truth if t.part_of is None]


def _ship(harbour: Harbour, truth: VesselTruth) -> Ship:
    return next(v.ship for v in harbour.vessels if v.identifier == truth.identifier)


def test_most_images_hold_vessels(harbour: Harbour) -> None:
    """Images are taken when something passes."""
    moving = [sum(t.speed_m_s > 0.5 for t in f.truth if t.part_of is None) for f in harbour.frames]
    assert np.mean(np.array(moving) >= 1) > 0.8
    assert max(moving) <= 6


def test_corners_project_as_opencv_projects_them(harbour: Harbour) -> None:
    """The eight corners, posed by centroid and rotation vector, land where OpenCV puts them."""
    for frame, truth in _whole(harbour):
        half = np.array([truth.length_m, truth.width_m, truth.height_m]) / 2
        signs = [(1, 1), (1, -1), (-1, -1), (-1, 1)]
        box = np.array([(*s, z) for z in (-1, 1) for s in signs]) * half
        inner = frame.viewport.camera.intrinsics
        pixels, _ = cv2.projectPoints(
            box, truth.rotvec_cam_from_vessel, truth.centroid_in_cam_m, inner.K, inner.distortion
        )
        shown = np.isfinite(truth.corners_in_image_px).all(axis=1)
        assert shown.any()
        assert truth.corners_in_image_px[shown] == pytest.approx(pixels[shown, 0], abs=1e-6)


def test_the_hull_stands_on_the_water_of_that_moment(harbour: Harbour) -> None:
    """The lower corners' middle is at the site's level plus the tide, in ellipsoidal height."""
    levels = set()
    for frame, truth in _whole(harbour):
        middle = harbour.frame.geodetic(truth.corners_in_enu_m[:4].mean(axis=0))
        expected = harbour.site.water_level_m + frame.water_level_m
        assert middle.height_m == pytest.approx(expected, abs=1e-4)
        levels.add(round(expected, 3))
    assert len(levels) > 3


def test_up_is_the_normal_at_the_vessel(harbour: Harbour) -> None:
    """The box's vertical edges follow the ellipsoid's normal where the vessel is."""
    _, truth = _whole(harbour)[0]
    middle = harbour.frame.geodetic(truth.centroid_in_enu_m)
    edge = truth.corners_in_enu_m[4] - truth.corners_in_enu_m[0]
    up = harbour.frame.axes(middle.lat_deg, middle.lon_deg)[2]
    assert edge / np.linalg.norm(edge) == pytest.approx(up, abs=1e-7)


def test_whole_boxes_bound_the_projected_mesh(harbour: Harbour) -> None:
    """The silhouette's box is the bounding box of the mesh's projected vertices, to a sample."""
    for frame, truth in _whole(harbour):
        ship = _ship(harbour, truth)
        R, _ = cv2.Rodrigues(truth.rotvec_cam_from_vessel)
        in_vessel = ship.mesh.vertices - (0, 0, ship.height_m / 2)
        in_cam = in_vessel @ R.T + truth.centroid_in_cam_m
        camera = frame.viewport.camera
        in_enu = in_cam @ camera.R_cam_from_world + camera.center_in_world
        pixels = camera.project(in_enu) + 0.5  # boxes count from the image's edge
        box = np.array(truth.whole_box_px)
        width, height = camera.intrinsics.width_px, camera.intrinsics.height_px
        if not np.isfinite(pixels).all() or (np.abs(pixels) > (1.9 * width, 1.9 * height)).any():
            continue  # only one image size on each side is kept
        edges = np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])
        assert box[2:] == pytest.approx(edges[2:], abs=0.75)
        assert box[0] == pytest.approx(edges[0], abs=0.75)
        # Masts thinner than a sample, as in images this small, fall between sample centres.
        assert edges[1] - 0.26 <= box[1] <= edges[3]


def test_visible_boxes_lie_in_the_image_and_in_the_whole_box(harbour: Harbour) -> None:
    """What can be seen is part of the silhouette and of the image."""
    for frame, truth in _whole(harbour):
        if truth.box_px is None:
            assert truth.visible_fraction == 0
            continue
        inner = frame.viewport.camera.intrinsics
        x1, y1, x2, y2 = truth.box_px
        assert 0 <= x1 < x2 <= inner.width_px
        assert 0 <= y1 < y2 <= inner.height_px
        assert x1 >= truth.whole_box_px[0]
        assert y2 <= truth.whole_box_px[3]
        assert 0 < truth.visible_fraction <= 1


def test_a_ship_across_the_border_is_leaving_the_frame(harbour: Harbour) -> None:
    """The class says so exactly when the silhouette crosses the border."""
    for frame, truth in _whole(harbour):
        inner = frame.viewport.camera.intrinsics
        x1, y1, x2, y2 = truth.whole_box_px
        crosses = x1 < 0 or y1 < 0 or x2 > inner.width_px or y2 > inner.height_px
        if truth.speed_m_s > 0.5:
            assert (truth.class_name is VesselClass.SHIP_LEAVING_FRAME) == crosses
        if crosses:
            assert truth.visible_fraction < 1


def test_convoys_are_one_ship_and_their_hulls_subvessels(harbour: Harbour) -> None:
    """The unit carries the MMSI; the hulls follow it and lie inside its box."""
    ship = build_ship(ShipType.CONVOY, np.random.default_rng(1))
    camera = harbour.camera.viewports[0].camera
    ahead = camera.R_cam_from_world[2] * (1, 1, 0)
    ahead /= np.linalg.norm(ahead)
    axes = np.column_stack([camera.R_cam_from_world[0] * (1, 1, 0), ahead, (0, 0, 1)])
    middle = 330.0 * ahead
    other = next(v for v in harbour.vessels if v.mmsi is not None)
    placed = PlacedVessel(replace(other, ship=ship), middle, axes, 0.0, 2.0)
    meshes = [part.mesh.moved(axes, middle) for part in ship.parts]
    views = view_hulls(camera, meshes, 2, np.zeros((480, 640), dtype=np.float32))
    unit, *parts = vessel_truths(camera, placed, views)
    assert unit.mmsi == other.mmsi
    assert [p.class_name for p in parts] == [VesselClass.SUBVESSEL] * len(ship.parts)
    assert sum(part.length_m for part in parts) == pytest.approx(unit.length_m)
    for part in parts:
        assert part.mmsi is None
        assert part.part_of == unit.identifier
        assert part.whole_box_px[0] >= unit.whole_box_px[0]
        assert part.whole_box_px[2] <= unit.whole_box_px[2]
        along = (part.centroid_in_enu_m - unit.centroid_in_enu_m) @ axes[:, 0]
        assert abs(along) < unit.length_m / 2
