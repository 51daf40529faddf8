"""Preset `waterline`: one water surface for all ships, on hulls that it was not built from."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.fusion import FusedPose, FusionSettings, Preset, SeenImage, fuse, fuse_series
from app.domain.geodesy import EnuFrame
from app.domain.metrics import BoxPose, PoseError, pose_error
from app.domain.track_places import turn_deg
from app.domain.vessel_state import HeadingSource, VesselState
from app.simulation.roadstead import FRAME, Anchored, Roadstead, RoadsteadSettings, make_roadstead

State = Callable[..., VesselState]
Box = Callable[..., Detection]
PAPER = FusionSettings(maximum_cost=9.0)
WATERLINE = FusionSettings(preset=Preset.WATERLINE, maximum_cost=9.0)


def images_of(ships: Sequence[Anchored]) -> list[SeenImage]:
    """Give each ship an image of its own, a second apart: matching cannot go wrong."""
    return [SeenImage([ship.detection], [ship.state], 0.0, at) for at, ship in enumerate(ships)]


def poses_of(camera: Camera, images: Sequence[SeenImage], how: FusionSettings) -> list[FusedPose]:
    """Fuse images with one ship each."""
    results = fuse_series(camera, FRAME, images, how)
    return [pose for result in results for pose in result.poses]


@cache
def roadstead(seed: int, how: RoadsteadSettings) -> Roadstead:
    """Anchor the ships of a seed once for all presets and tests."""
    return make_roadstead(seed, how)


def errors_of(seed: int, how: FusionSettings, **changes: float) -> list[PoseError]:
    """Give the errors of all poses of a roadstead in the camera's frame."""
    stead = roadstead(seed, replace(RoadsteadSettings(), **changes))  # type: ignore[arg-type]  # numbers
    poses = poses_of(stead.camera, images_of(stead.ships), how)
    return [
        pose_error(BoxPose.of(pose), ship.truth)
        for pose, ship in zip(poses, stead.ships, strict=True)
    ]


@pytest.mark.parametrize(
    ("changes", "horizontal", "add_s"),
    [
        ({}, 0.62, 0.68),
        ({"rotation_sigma_deg": 0.1}, 0.75, 0.8),
        ({"ships": 5}, 0.8, 0.9),
    ],
)
def test_errors_fall_against_the_papers(
    changes: dict[str, float], horizontal: float, add_s: float
) -> None:
    """On unseen hulls the mean errors are below these shares of preset `paper`'s."""
    seeds = range(12 if "ships" not in changes else 24)
    paper = [error for seed in seeds for error in errors_of(seed, PAPER, **changes)]
    ours = [error for seed in seeds for error in errors_of(seed, WATERLINE, **changes)]

    def share(name: str) -> float:
        ratio = np.mean(np.abs([getattr(e, name) for e in ours])) / np.mean(
            np.abs([getattr(e, name) for e in paper])
        )
        return float(ratio)

    assert share("horizontal_m") < horizontal
    assert share("add_s_m") < add_s
    assert share("height_m") < 0.6
    assert share("heading_deg") < 1


def test_the_water_level_is_found() -> None:
    """From twenty ships and a camera that is known the level comes out within 15 cm."""
    known_camera = replace(WATERLINE, rotation_sigma_deg=0.01)
    for seed in range(6):
        stead = make_roadstead(seed)
        poses = poses_of(stead.camera, images_of(stead.ships), known_camera)
        levels = [pose.water_level_m for pose in poses]
        assert np.median(levels) == pytest.approx(stead.water_level_m, abs=0.15)


@pytest.mark.parametrize("rotation_sigma_deg", [0.0, 0.1])
def test_its_covariance_is_honest(rotation_sigma_deg: float) -> None:
    """Squared errors in units of the covariance have the median they should have, within 20 %."""
    normalised = []
    for seed in range(40, 60):
        stead = make_roadstead(seed, RoadsteadSettings(rotation_sigma_deg=rotation_sigma_deg))
        poses = poses_of(stead.camera, images_of(stead.ships), WATERLINE)
        for pose, ship in zip(poses, stead.ships, strict=True):
            off = stead.camera.R_cam_from_world.T @ (
                pose.centroid_in_cam_m - ship.truth.centroid_in_cam_m
            )
            assert pose.position_covariance_in_enu_m2 is not None
            normalised.append(off @ np.linalg.solve(pose.position_covariance_in_enu_m2, off))
    assert np.median(normalised) == pytest.approx(2.366, rel=0.2)  # chi-square, 3 degrees


def test_one_ship_alone_knows_its_range_less() -> None:
    """With others beside it a ship's position is more certain than alone."""
    stead = make_roadstead(3)
    together = poses_of(stead.camera, images_of(stead.ships), WATERLINE)
    alone = poses_of(stead.camera, images_of(stead.ships[:1]), WATERLINE)
    assert variance(together[0]) < 0.7 * variance(alone[0])


def variance(pose: FusedPose) -> float:
    """Give the larger horizontal variance of a pose."""
    assert pose.position_covariance_in_enu_m2 is not None
    return float(np.linalg.eigvalsh(pose.position_covariance_in_enu_m2[:2, :2])[-1])


def test_images_of_other_hours_share_no_water() -> None:
    """Beyond the window a ship's pose is what it is without the others."""
    stead = make_roadstead(5)
    images = images_of(stead.ships)
    late = replace(images[0], at_s=WATERLINE.level_window_s * 3)
    mixed = poses_of(stead.camera, [late, *images[1:]], WATERLINE)
    alone = poses_of(stead.camera, [late], WATERLINE)
    np.testing.assert_allclose(mixed[0].centroid_in_world, alone[0].centroid_in_world, atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(st.permutations(range(12)))
def test_the_order_of_images_does_not_matter(order: list[int]) -> None:
    """Images in any order give the same poses."""
    stead = make_roadstead(7, RoadsteadSettings(ships=12))
    images = images_of(stead.ships)
    straight = poses_of(stead.camera, images, WATERLINE)
    shuffled = poses_of(stead.camera, [images[index] for index in order], WATERLINE)
    for place, index in enumerate(order):
        np.testing.assert_allclose(
            shuffled[place].centroid_in_world, straight[index].centroid_in_world, atol=1e-6
        )


def test_a_ship_seen_often_counts_once() -> None:
    """Ten images of one ship and its one AIS error move the water no more than two do."""
    stead = make_roadstead(11)
    (ship,) = stead.ships[:1]
    state = replace(ship.state, identifier="same")
    often = [SeenImage([ship.detection], [state], 0.0, at) for at in range(10)]
    twice = often[:2]
    levels = [
        poses_of(stead.camera, images, WATERLINE)[0].water_level_m for images in (often, twice)
    ]
    # Boxes that are the same ten times are more exact ones.
    assert levels[0] == pytest.approx(levels[1], abs=0.01)


def test_a_width_nobody_knows_turns_no_ship() -> None:
    """Without widths by AIS headings stay as good as reported, and places better than the paper's.

    Boxes are then not taken for those of ships without any breadth.
    """
    stead = make_roadstead(17)
    ships = [
        replace(ship, state=replace(ship.state, to_port_m=0.0, to_starboard_m=0.0))
        for ship in stead.ships
    ]
    reported = [abs(turn_deg(ship.heading_deg, ship.state.heading_deg)) for ship in ships]
    poses, papers = (poses_of(stead.camera, images_of(ships), how) for how in (WATERLINE, PAPER))
    ours, theirs = (
        [pose_error(BoxPose.of(p), ship.truth) for p, ship in zip(found, ships, strict=True)]
        for found in (poses, papers)
    )
    assert np.mean([error.heading_deg for error in ours]) < 1.1 * np.mean(reported)
    assert np.mean([e.horizontal_m for e in ours]) < np.mean([e.horizontal_m for e in theirs])


def test_a_wrong_match_does_not_drag_the_others() -> None:
    """With one ship 60 m off its place the others stand as if it were not there."""
    stead = make_roadstead(13)
    images = images_of(stead.ships)
    wrong = moved(stead, stead.ships[0], north_m=60)
    clean = poses_of(stead.camera, images[1:], WATERLINE)
    spoilt = poses_of(stead.camera, [wrong, *images[1:]], WATERLINE)[1:]
    shifts = [
        np.linalg.norm(a.centroid_in_world - b.centroid_in_world)
        for a, b in zip(clean, spoilt, strict=True)
    ]
    assert np.median(shifts) < 0.5


def moved(stead: Roadstead, ship: Anchored, north_m: float) -> SeenImage:
    """Give a ship's image with its AIS position moved north."""
    state = ship.state
    place = FRAME.position(state.lat_deg, state.lon_deg, 0.0) + np.array([0.0, north_m, 0.0])
    there = FRAME.geodetic(place)
    assert stead.ships
    return SeenImage(
        [ship.detection],
        [replace(state, lat_deg=there.lat_deg, lon_deg=there.lon_deg)],
        0.0,
    )


def test_a_cut_lower_edge_leaves_the_depth_to_ais(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box
) -> None:
    """Below the image's border nothing tells the range: it stays as reported, flagged."""
    state = vessel(0, 115)
    box = replace(box_of(state), y2_px=1919.0)
    (pose,) = fuse(camera, frame, 0.0, [box], [state], WATERLINE).poses
    assert pose.flags == ["cut_bottom"]
    assert abs(pose.correction_in_enu_m[1]) < 1


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_side_cut_by_the_border_pulls_nothing(
    camera: Camera, frame: EnuFrame, vessel: State, box_of: Box, side: str
) -> None:
    """A ship leaving the frame is placed by the edge that is its own."""
    east_m = -96 if side == "left" else 96
    truth = vessel(east_m, 300)
    whole = box_of(truth)
    shown = replace(whole, x1_px=max(whole.x1_px, 0.0), x2_px=min(whole.x2_px, 2560.0))
    assert shown != whole
    reported = vessel(east_m + 6, 300)
    (pose,) = fuse(camera, frame, 0.0, [shown], [reported], WATERLINE).poses
    assert f"cut_{side}" in pose.flags
    assert pose.correction_in_enu_m[0] == pytest.approx(-6, abs=2.0)
    # A detector's box of it may as well end some pixels before the border.
    (before,) = fuse(camera, frame, 0.0, [inset(shown, side)], [reported], WATERLINE).poses
    assert before.flags == pose.flags
    np.testing.assert_allclose(before.centroid_in_world, pose.centroid_in_world, atol=0.5)


def inset(box: Detection, side: str) -> Detection:
    """End a box five pixels before the image's border."""
    return replace(box, x1_px=5.0) if side == "left" else replace(box, x2_px=2555.0)


def test_what_is_hidden_may_be_higher() -> None:
    """A ship half behind another has an unsure height, and the seen half does not displace it."""
    stead = make_roadstead(5)
    images = images_of(stead.ships)
    whole = poses_of(stead.camera, images, WATERLINE)[0]
    box = images[0].detections[0]
    half = replace(box, x2_px=(box.x1_px + box.x2_px) / 2)
    hidden = poses_of(
        stead.camera, [replace(images[0], detections=[half]), *images[1:]], WATERLINE
    )[0]
    assert "partly_hidden" in hidden.flags
    assert "partly_hidden" not in whole.flags
    assert whole.height_sigma_m is not None
    assert hidden.height_sigma_m is not None
    assert hidden.height_sigma_m > 3 * whole.height_sigma_m
    off = np.linalg.norm(hidden.centroid_in_world - whole.centroid_in_world)
    seen_shift_m = (box.x2_px - half.x2_px) / 2 * stead.ships[0].range_m / 6570
    assert off < 0.7 * seen_shift_m


def test_a_camera_much_worse_than_said_is_found_out() -> None:
    """A registration off by six of its sigmas does not make poses worse than the paper's."""
    paper, ours = (
        [e.horizontal_m for seed in range(4) for e in errors_of(seed, how, rotation_sigma_deg=0.3)]
        for how in (PAPER, WATERLINE)
    )
    assert np.mean(ours) < np.mean(paper)


def test_headings_from_courses_are_believed_as_far_as_ships_bear_them_out() -> None:
    """Where courses are far better than said, the image does not spoil them."""
    errors: dict[str, list[float]] = {"state": [], "pose": []}
    for seed in range(8):
        stead = make_roadstead(seed, RoadsteadSettings(heading_sigma_deg=1.0))
        states = [
            replace(s.state, heading_sigma_deg=7.0, heading_source=HeadingSource.COURSE)
            for s in stead.ships
        ]
        images = [
            replace(image, states=[state])
            for image, state in zip(images_of(stead.ships), states, strict=True)
        ]
        poses = poses_of(stead.camera, images, WATERLINE)
        for pose, state, ship in zip(poses, states, stead.ships, strict=True):
            errors["state"].append(abs(turn_deg(ship.heading_deg, state.heading_deg)))
            errors["pose"].append(abs(turn_deg(ship.heading_deg, pose.heading_deg)))
    assert np.mean(errors["pose"]) < np.mean(errors["state"]) + 0.3


def test_doubtful_geometry_is_flagged() -> None:
    """A place that is known to more than 10 m, and one that contradicts AIS, say so."""
    stead = make_roadstead(13, RoadsteadSettings(position_sigma_m=5.0))
    images = images_of(stead.ships)
    unsure = replace(stead.ships[0].state, position_covariance_m2=(4e4, 0.0, 4e4))
    alone = [SeenImage([stead.ships[0].detection], [unsure], 0.0)]
    (pose,) = poses_of(stead.camera, alone, replace(WATERLINE, level_sigma_m=3.0))
    assert "unsure_place" in pose.flags
    far = moved(stead, stead.ships[0], north_m=150)
    odd, *others = poses_of(stead.camera, [far, *images[1:]], WATERLINE)
    assert "contradicts_ais" in odd.flags
    assert sum("contradicts_ais" in pose.flags for pose in others) <= 1
