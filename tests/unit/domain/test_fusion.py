"""Preset `paper`: the published pose, the border cases, and what fusion must not depend on."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.borders import CutEdges
from app.domain.camera import Camera, Intrinsics
from app.domain.correction import corrections_in_world, edge_normals, pull_weights
from app.domain.detection import Detection
from app.domain.fusion import FusionResult, FusionSettings, fuse
from app.domain.geodesy import EcefFrame, EnuFrame, Geodetic
from app.domain.rotations import matrix_from_rotvec
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane_segment

State = Callable[..., VesselState]
Box = Callable[..., Detection]
SETTINGS = FusionSettings()


def published_input(label: dict[str, object]) -> tuple[Detection, VesselState]:
    """Give the label's box and AIS state."""
    (vessel,) = label["vessels"]  # type: ignore[misc]  # JSON
    (found,) = label["objects"]  # type: ignore[misc]  # JSON
    size = vessel["size"]
    state = VesselState(
        identifier=vessel["identifier"],
        lat_deg=vessel["lat"],
        lon_deg=vessel["long"],
        heading_deg=vessel["heading"],
        speed_kn=vessel["speed"],
        age_s=vessel["secondsSinceLastPositionReport"],
        to_bow_m=size["to_bow"],
        to_stern_m=size["to_stern"],
        to_port_m=size["to_port"],
        to_starboard_m=size["to_starboard"],
    )
    return Detection(*found["bbImage2d"], score=1.0), state


def test_the_published_pose_is_reproduced(published: tuple[Camera, dict[str, object]]) -> None:
    """Centroid within 1e-3 m, rotation within 1e-6 rad, dimensions as published."""
    camera, label = published
    detection, state = published_input(label)
    (pose,) = fuse(camera, EcefFrame(), 0.0, [detection], [state], SETTINGS).poses
    expected = label["objects"][0]  # type: ignore[index]  # JSON
    np.testing.assert_allclose(
        pose.centroid_in_cam_m, expected["position"]["centroid"], rtol=0, atol=2e-5
    )
    rotvec = np.ravel(expected["position"]["eulerAngles"])
    turn = matrix_from_rotvec(rotvec).T @ matrix_from_rotvec(pose.rotvec_cam_from_vessel)
    assert np.linalg.norm(turn - np.eye(3)) < 1e-9
    assert (pose.length_m, pose.width_m, np.ceil(pose.height_m)) == (19, 7, 8)
    assert pose.cost == pytest.approx(0.0914, abs=1e-4)
    assert pose.correction_in_enu_m[2] == pytest.approx(2.46, abs=0.01)
    assert pose.flags == []


@given(
    lat=st.floats(53.4, 53.7),
    lon=st.floats(9.8, 10.2),
    height=st.floats(-50, 200),
)
def test_the_pose_does_not_depend_on_the_world_frame(
    published: tuple[Camera, dict[str, object]], lat: float, lon: float, height: float
) -> None:
    """ECEF and an ENU frame at any origin nearby give the same pose within 1e-6 m."""
    camera, label = published
    detection, state = published_input(label)
    frame = EnuFrame(Geodetic(lat, lon, height))
    moved = Camera(
        camera.intrinsics,
        camera.R_cam_from_world @ frame.R_enu_from_ecef.T,
        frame.R_enu_from_ecef @ (camera.center_in_world - frame.origin_in_ecef),
    )
    (pose,) = fuse(camera, EcefFrame(), 0.0, [detection], [state], SETTINGS).poses
    (other,) = fuse(moved, frame, 0.0, [detection], [state], SETTINGS).poses
    np.testing.assert_allclose(other.centroid_in_cam_m, pose.centroid_in_cam_m, atol=1e-6)
    np.testing.assert_allclose(other.rotvec_cam_from_vessel, pose.rotvec_cam_from_vessel, atol=1e-9)
    np.testing.assert_allclose(other.corners_in_image_px, pose.corners_in_image_px, atol=1e-4)
    np.testing.assert_allclose(other.correction_in_enu_m, pose.correction_in_enu_m, atol=1e-6)


def test_a_true_box_leaves_a_vessel_where_it_is(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """With exact AIS and a tight box of the true cuboid nothing moves, and the height is right."""
    state = vessel(0, 300)
    (pose,) = fuse(camera, frame, 0.0, [box_of(state, 12.0)], [state], SETTINGS).poses
    np.testing.assert_allclose(pose.correction_in_enu_m, 0, atol=1e-2)
    # Raised along delta's normal the top leans a little: 12 m within a few per cent.
    assert pose.height_m == pytest.approx(12, rel=0.05)
    np.testing.assert_allclose(pose.centroid_in_world, pose.corners_in_world.mean(axis=0))


def test_the_box_touches_the_edges_of_its_detection(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """AIS 6 m off sideways is pulled back: the bottom touches gamma, the sides alpha and beta."""
    truth = vessel(0, 300)
    reported = vessel(6, 300)
    box = box_of(truth, 12.0)
    (pose,) = fuse(camera, frame, 0.0, [box], [reported], SETTINGS).poses
    assert pose.correction_in_enu_m[0] == pytest.approx(-6, abs=0.2)
    shown = pose.corners_in_image_px
    assert shown[:4, 1].max() == pytest.approx(box.y2_px, abs=1)
    assert shown[:, 0].min() == pytest.approx(box.x1_px, abs=6)
    assert shown[:, 0].max() == pytest.approx(box.x2_px, abs=6)
    assert shown[4:, 1].min() == pytest.approx(box.y1_px, abs=1)
    np.testing.assert_allclose(pose.segment_corrected_px, shown[:4])


def cut(**edges: bool) -> CutEdges:
    """Give cut edges, none unless named."""
    return CutEdges(**{"left": False, "right": False, "top": False, "bottom": False, **edges})


@pytest.mark.parametrize(
    ("edges", "alpha", "beta", "gamma"),
    [
        ({}, 0.5, 0.5, 1),
        ({"right": True}, 1, 0, 1),
        ({"left": True}, 0, 1, 1),
        ({"left": True, "right": True}, 0, 0, 1),
        ({"bottom": True}, 0.5, 0.5, 0),
        ({"bottom": True, "right": True}, 1, 0, 0),
        ({"top": True}, 0.5, 0.5, 1),
    ],
)
def test_cut_edges_pull_nothing(
    camera: Camera,
    frame: EnuFrame,
    vessel: State,
    edges: dict[str, bool],
    alpha: float,
    beta: float,
    gamma: float,
) -> None:
    """Each border case weighs alpha, beta and gamma as the paper says, a cut bottom drops gamma."""
    corners = water_plane_segment(frame, 0.0, vessel(10, 300)).corners_in_world
    box = Detection(1000, 1000, 1500, 1400, 1.0)
    normals = edge_normals(camera, np.array([box.edges_px]), np.array([[0.0, 0, 1]]))
    left, right, lower, _ = normals[0]
    away = corners - camera.center_in_world
    expected = -(
        alpha * max(away @ left) * left
        + beta * min(away @ right) * right
        + gamma * max(away @ lower) * lower
    )
    (found,) = corrections_in_world(normals, away[None], pull_weights([cut(**edges)]))
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("side", "box"),
    [
        ("cut_left", (0, 1300, 700, 1400)),
        ("cut_right", (1900, 1300, 2560, 1400)),
        ("cut_bottom", (1000, 1300, 1600, 1919)),
        ("cut_top", (1000, 0, 1600, 1400)),
    ],
)
def test_poses_cut_by_a_border_are_flagged(
    camera: Camera,
    frame: EnuFrame,
    vessel: State,
    side: str,
    box: tuple[float, float, float, float],
) -> None:
    """A pose whose box the image cuts says so."""
    settings = replace(SETTINGS, maximum_cost=5.0)
    result = fuse(camera, frame, 0.0, [Detection(*box, 1.0)], [vessel(0, 300)], settings)
    assert result.poses[0].flags == [side]


def test_everything_is_accounted_for(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """Each detection and each state is either in a pose or listed, states with their reason."""
    near, far = vessel(-30, 300), vessel(40, 500)
    states = [
        vessel(0, -300),  # behind the camera
        far,
        vessel(0, 300, heading_deg=float("nan")),
        near,
        vessel(60, 250),  # none left for it
    ]
    detections = [box_of(near), Detection(1200, 100, 1300, 200, 0.1), box_of(far)]
    result = fuse(camera, frame, 0.0, detections, states, SETTINGS)
    assert [(p.detection_index, p.state_index) for p in result.poses] == [(0, 3), (2, 1)]
    assert result.unmatched_detections == [1]
    assert result.unmatched_states == {
        0: "behind_camera",
        2: "no_heading",
        4: "no_detection_left",
    }


def test_a_pair_above_the_maximum_cost_is_dropped(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """The only pair there is, but too unlike, is no match: both sides are listed."""
    detection = box_of(vessel(-80, 300))
    result = fuse(camera, frame, 0.0, [detection], [vessel(60, 300)], SETTINGS)
    assert result.poses == []
    assert result.unmatched_detections == [0]
    assert result.unmatched_states == {0: "cost_too_high"}


def test_a_vessel_of_unknown_size_keeps_its_detection_without_a_pose(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """All dimensions 0: matched by position, so no other vessel takes the box, but no 3D box."""
    unsized = vessel(0, 300, to_bow_m=0, to_stern_m=0, to_port_m=0, to_starboard_m=0)
    result = fuse(
        camera, frame, 0.0, [box_of(vessel(0, 300))], [unsized, vessel(40, 300)], SETTINGS
    )
    assert result.poses == []
    assert result.unmatched_states == {0: "size_unknown", 1: "no_detection_left"}


def test_a_vessel_without_width_is_flagged(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """A known length with width 0 gives a flat box, and says so."""
    state = vessel(0, 300, to_port_m=0, to_starboard_m=0)
    (pose,) = fuse(camera, frame, 0.0, [box_of(state)], [state], SETTINGS).poses
    assert pose.flags == ["no_width"]


def test_nothing_in_gives_nothing_out(camera: Camera, frame: EnuFrame, vessel: State) -> None:
    """Empty images and empty seas are no error."""
    empty: FusionResult = fuse(camera, frame, 0.0, [], [], SETTINGS)
    assert (empty.poses, empty.unmatched_detections, empty.unmatched_states) == ([], [], {})
    alone = fuse(camera, frame, 0.0, [], [vessel(0, 300)], SETTINGS)
    assert alone.unmatched_states == {0: "no_detection_left"}


@pytest.mark.parametrize("box", [(10, 10, 10, 20), (10, 20, 30, 10), (10, 10, np.inf, 20)])
def test_an_impossible_box_is_refused_by_its_number(
    camera: Camera, frame: EnuFrame, box: tuple[float, float, float, float]
) -> None:
    """An empty or endless box is refused with its position in the list."""
    boxes = [Detection(1, 1, 2, 2, 1.0), Detection(*box, 1.0)]
    with pytest.raises(ValueError, match="detection 1"):
        fuse(camera, frame, 0.0, boxes, [], SETTINGS)


def test_distortion_is_taken_out_of_the_edges(
    camera: Camera, frame: EnuFrame, vessel: State
) -> None:
    """With a barrel lens the tight box of the distorted image still leaves the vessel in place."""
    K = camera.intrinsics.K
    lens = Camera(
        Intrinsics(2560, 1920, K, np.array([-0.2, 0, 0, 0, 0])),
        camera.R_cam_from_world,
        camera.center_in_world,
    )
    state = vessel(50, 300)
    corners = water_plane_segment(frame, 0.0, state).corners_in_world
    pixels = lens.project(np.vstack([corners, corners + np.array([0.0, 0, 10])]))
    box = Detection(*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist(), score=1.0)
    (pose,) = fuse(lens, frame, 0.0, [box], [state], SETTINGS).poses
    assert np.abs(pose.correction_in_enu_m).max() < 0.2
    ideal = fuse(camera, frame, 0.0, [box], [state], SETTINGS).poses[0]
    assert np.abs(ideal.correction_in_enu_m).max() > 0.2
