"""Registration against simulated cameras: accuracy, outliers, unknown lenses, honest doubts."""

from collections.abc import Iterator
from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EcefFrame, EnuFrame, Geodetic
from app.domain.keypoints import Keypoints, RegistrationError, keypoints_in, spread_warnings
from app.domain.pnp import Priors, refine
from app.domain.projection import projection_jacobian
from app.domain.registration import (
    Registration,
    RegistrationMethod,
    RegistrationSettings,
    register_given,
    register_homography,
    register_pnp,
    water_point_sigma_px,
)
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix

FRAME = EnuFrame(Geodetic(53.54, 9.98, 0.0))
POSE_ONLY = RegistrationSettings(refine_intrinsics=False)
SEEDS = range(20)


def lens(focal_px: float = 6570.0, k1: float = 0.0) -> Intrinsics:
    """Give the published camera's lens, or one like it."""
    K = np.array([[focal_px, 0, 1187], [0, 1.003 * focal_px, 935], [0, 0, 1]])
    return Intrinsics(2560, 1920, K, np.array([k1, 0, 0, 0, 0]))


def harbour_camera(intrinsics: Intrinsics) -> Camera:
    """Put a camera 30 m above the water, looking 3 degrees down to the north."""
    level = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    down = matrix_from_rotvec([np.radians(3.0), 0, 0])
    return Camera(intrinsics, down @ level, np.array([0.0, 0, 30]))


def seen(camera: Camera, count: int, seed: int, noise_px: float = 2.0, wrong: int = 0) -> Keypoints:
    """Mark `count` landmarks 100 to 800 m away with noise, the first `wrong` of them far off."""
    rng = np.random.default_rng(seed)
    north = rng.uniform(100, 800, 800)
    bearing = rng.uniform(-0.19, 0.19, 800)
    points = np.column_stack([north * bearing, north, rng.uniform(0, 40, 800)])
    pixels = camera.project(points)
    inside = ((pixels > 0) & (pixels < [2560, 1920])).all(axis=1)
    points, pixels = points[inside][:count], pixels[inside][:count]
    pixels = pixels + rng.normal(0, noise_px, pixels.shape)
    pixels[:wrong] += rng.uniform(40, 400, (wrong, 2)) * rng.choice([-1, 1], (wrong, 2))
    return Keypoints(points, pixels)


def solutions(
    camera: Camera,
    start: Intrinsics,
    count: int,
    settings: RegistrationSettings,
    **how: float,
) -> Iterator[Registration]:
    """Register the same camera from the keypoints of each seed."""
    for seed in SEEDS:
        keypoints = seen(camera, count, seed, **how)  # type: ignore[arg-type]  # noise, wrong
        yield register_pnp(FRAME, start, keypoints, settings)


def center_error_m(registration: Registration, truth: Camera) -> float:
    """Give the distance between the found and the true centre."""
    assert registration.camera is not None
    return float(np.linalg.norm(registration.camera.center_in_world - truth.center_in_world))


def water_error_px(registration: Registration, truth: Camera) -> float:
    """Give the error of a water point 300 m away."""
    assert registration.camera is not None
    point = np.array([[0.0, 300, 0]])
    return float(np.linalg.norm(registration.camera.project(point) - truth.project(point)))


@pytest.mark.parametrize(
    ("count", "center_m", "water_px"), [(6, 0.8, 8), (10, 0.6, 5), (15, 0.4, 4)]
)
def test_two_pixels_of_noise_leave_the_camera_within_decimetres(
    count: int, center_m: float, water_px: float
) -> None:
    """Median centre error and the p95 of a water point at 300 m, for 6, 10 and 15 points."""
    truth = harbour_camera(lens())
    found = list(solutions(truth, truth.intrinsics, count, POSE_ONLY))
    assert np.median([center_error_m(r, truth) for r in found]) < center_m
    assert np.percentile([water_error_px(r, truth) for r in found], 95) < water_px


def test_wrong_keypoints_are_found_and_left_out() -> None:
    """With 3 of 14 keypoints wrong the camera stays within decimetres and the wrong are named."""
    truth = harbour_camera(lens())
    found = list(solutions(truth, truth.intrinsics, 14, POSE_ONLY, wrong=3))
    assert np.median([center_error_m(r, truth) for r in found]) < 0.5
    assert all(not r.inliers[:3].any() and r.inliers[3:].all() for r in found)
    first = found[0]
    assert any("3 of 14" in w and "number 1, number 2, number 3" in w for w in first.warnings)
    # The headline error hides no keypoint; the fit's own error is shown beside it.
    assert first.mae_px is not None
    assert first.mae_inliers_px is not None
    assert first.mae_px > 10 * first.mae_inliers_px


def test_an_unknown_lens_is_refined() -> None:
    """A focal length 5 % off and a k1 of -0.21 that nobody gave are both recovered."""
    truth = harbour_camera(lens(k1=-0.21))
    start = lens(focal_px=1.05 * 6570)
    found = list(solutions(truth, start, 16, RegistrationSettings()))
    focal = [r.intrinsics.K[0, 0] / 6570 for r in found]
    assert np.percentile(np.abs(np.array(focal) - 1), 95) < 0.01
    assert np.median([abs(r.intrinsics.distortion[0] + 0.21) for r in found]) < 0.1
    assert np.median([center_error_m(r, truth) for r in found]) < 1
    kept = list(solutions(truth, start, 16, POSE_ONLY))
    assert np.median([center_error_m(r, truth) for r in kept]) > 5
    assert all(any("agree" in w for w in r.warnings) for r in kept)


def test_few_points_leave_the_lens_alone() -> None:
    """Below ten keypoints only the pose is solved."""
    truth = harbour_camera(lens())
    registration = register_pnp(FRAME, lens(6700), seen(truth, 9, 1))
    np.testing.assert_array_equal(registration.intrinsics.K, lens(6700).K)
    assert registration.parameter_covariance is not None
    assert registration.parameter_covariance.shape == (6, 6)


def test_the_covariance_tells_the_truth() -> None:
    """Centre errors measured in their own covariance average to about one."""
    truth = harbour_camera(lens())
    shares = []
    for registration in solutions(truth, truth.intrinsics, 15, POSE_ONLY):
        assert registration.camera is not None
        assert registration.covariance is not None
        error = registration.camera.center_in_world - truth.center_in_world
        shares.append(error @ np.linalg.solve(registration.covariance[3:, 3:], error) / 3)
    assert 0.4 < np.mean(shares) < 2.2


def test_water_points_grow_surer_with_more_keypoints() -> None:
    """The predicted pixel uncertainty at 300 m falls from 6 to 10 to 20 points."""
    truth = harbour_camera(lens())
    medians = [
        np.median(
            [
                water_point_sigma_px(r, 300, 0)
                for r in solutions(truth, truth.intrinsics, count, POSE_ONLY)
            ]
        )
        for count in (6, 10, 20)
    ]
    assert all(more > less for more, less in pairwise(medians))
    assert 0.1 < medians[-1] < 2


def test_leaving_one_out_is_harder_than_fitting() -> None:
    """The error against a fit without the keypoint exceeds the fit's own, most with few points."""
    truth = harbour_camera(lens())
    for count, excess in ((6, 1.5), (15, 1.1)):
        found = list(solutions(truth, truth.intrinsics, count, POSE_ONLY))
        fit = np.median([r.mae_px for r in found])
        left_out = np.median([r.leave_one_out_px for r in found])
        assert left_out > excess * fit


def test_percentages_relate_to_the_image() -> None:
    """Mean errors are given in px and in per cent of the width and height."""
    truth = harbour_camera(lens())
    registration = register_pnp(FRAME, truth.intrinsics, seen(truth, 12, 3))
    assert registration.mae_px == pytest.approx(
        np.linalg.norm(registration.residuals_px, axis=1).mean()
    )
    assert registration.mae_pct_width == pytest.approx(100 * registration.mae_px / 2560)
    assert registration.mae_pct_height == pytest.approx(100 * registration.mae_px / 1920)


@settings(max_examples=25, deadline=None)
@given(
    rotvec=st.tuples(*[st.floats(-3, 3)] * 3),
    center=st.tuples(*[st.floats(-5000, 5000)] * 3),
    seed=st.integers(0, 1000),
)
def test_any_pose_is_recovered_from_exact_keypoints(
    rotvec: tuple[float, float, float], center: tuple[float, float, float], seed: int
) -> None:
    """Without noise the camera comes back exactly, wherever it stands and looks."""
    truth = Camera(lens(), matrix_from_rotvec(rotvec), np.array(center))
    rng = np.random.default_rng(seed)
    in_cam = np.column_stack([rng.uniform(-0.15, 0.15, (12, 2)), np.ones(12)])
    in_cam *= rng.uniform(80, 900, (12, 1))
    points = in_cam @ truth.R_cam_from_world + truth.center_in_world
    keypoints = Keypoints(points, truth.project(points))
    registration = register_pnp(FRAME, truth.intrinsics, keypoints)
    assert center_error_m(registration, truth) < 1e-3
    assert registration.inliers.all()


def test_refinement_agrees_with_opencv() -> None:
    """Our Levenberg-Marquardt ends where cv2.solvePnPRefineLM does."""
    truth = harbour_camera(lens(k1=-0.1))
    keypoints = seen(truth, 12, 5)
    ours = refine(truth, keypoints, Priors())
    rvec, tvec = cv2.solvePnPRefineLM(
        keypoints.points_in_world,
        keypoints.pixels_px,
        truth.intrinsics.K.copy(),
        truth.intrinsics.distortion.copy(),
        rotvec_from_matrix(truth.R_cam_from_world).reshape(3, 1),
        truth.t_cam_from_world.reshape(3, 1),
    )
    theirs = -matrix_from_rotvec(np.ravel(rvec)).T @ np.ravel(tvec)
    np.testing.assert_allclose(ours.center_in_world, theirs, atol=1e-4)


def test_the_refinement_ends_at_one_point_from_wherever_it_begins() -> None:
    """Starts degrees and metres apart end within a billionth of a pixel, the lens refined too."""
    truth = harbour_camera(lens(k1=-0.2))
    keypoints = seen(truth, 40, 6)
    ends = []
    for turn, shift in ((0.0, 0.0), (0.02, 5.0), (-0.015, -3.0)):
        R = matrix_from_rotvec([turn, turn, -turn]) @ truth.R_cam_from_world
        start = Camera(lens(6600), R, truth.center_in_world + shift)
        ends.append(refine(start, keypoints, Priors(), lens()).project(keypoints.points_in_world))
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(ends[2], ends[0], rtol=0, atol=1e-9)


@given(seed=st.integers(0, 10_000))
def test_the_jacobian_is_that_of_the_projection(seed: int) -> None:
    """Derivatives by rotation and centre agree with differences, with distortion."""
    rng = np.random.default_rng(seed)
    camera = Camera(
        Intrinsics(2560, 1920, lens().K, np.array([-0.2, 0.1, 1e-3, -1e-3, 0.02])),
        matrix_from_rotvec(rng.normal(size=3)),
        rng.normal(scale=100, size=3),
    )
    in_cam = np.array([[rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), 1]]) * 300
    point = in_cam @ camera.R_cam_from_world + camera.center_in_world
    J = projection_jacobian(camera, point)[0]
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        turned = Camera(
            camera.intrinsics,
            matrix_from_rotvec(step) @ camera.R_cam_from_world,
            camera.center_in_world,
        )
        by_turn = (turned.project(point) - camera.project(point))[0] / 1e-6
        np.testing.assert_allclose(J[:, axis], by_turn, rtol=1e-3, atol=0.1)
        moved = Camera(
            camera.intrinsics, camera.R_cam_from_world, camera.center_in_world + 1e3 * step
        )
        by_move = (moved.project(point) - camera.project(point))[0] / 1e-3
        np.testing.assert_allclose(J[:, 3 + axis], by_move, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((5, 3)) + np.arange(5)[:, None] * [3.0, 100, 1], "too few"),
        (np.tile([[3.0, 200, 1], [9, 300, 4]], (4, 1)), "2 different landmarks"),
        (np.outer(np.arange(1, 9), [3.0, 100, 1]), "straight line"),
    ],
)
def test_keypoints_that_cannot_carry_a_camera_are_refused(points: np.ndarray, message: str) -> None:
    """Too few, repeated and collinear landmarks are refused with the reason and the fix."""
    truth = harbour_camera(lens())
    with pytest.raises(RegistrationError, match=message):
        register_pnp(FRAME, truth.intrinsics, Keypoints(points, truth.project(points)))


def test_landmarks_almost_on_a_line_are_refused_or_said_to_be_unsure() -> None:
    """A quay's edge, surveyed to decimetres, never gives a silent wrong camera."""
    truth = harbour_camera(lens())
    line = np.column_stack([np.linspace(-30, 60, 14), np.linspace(250, 500, 14), np.full(14, 3.0)])
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        points = line + rng.normal(0, 0.3, (14, 3))
        pixels = truth.project(points) + rng.normal(0, 2, (14, 2))
        try:
            registration = register_pnp(FRAME, lens(), Keypoints(points, pixels), POSE_ONLY)
        except RegistrationError:
            continue
        text = " ".join(registration.warnings)
        assert "nearly on one line" in text
        assert "uncertain by" in text or center_error_m(registration, truth) < 15


def test_keypoints_that_agree_on_nothing_are_refused() -> None:
    """Random pixels give no camera."""
    truth = harbour_camera(lens())
    points = seen(truth, 12, 2).points_in_world
    rng = np.random.default_rng(4)
    pixels = rng.uniform(0, 1900, (12, 2))
    with pytest.raises(RegistrationError, match="agree on any camera"):
        register_pnp(FRAME, lens(), Keypoints(points, pixels))


def test_poor_spread_is_said_before_solving() -> None:
    """Few and one-sided keypoints are warned of from the keypoints alone."""
    pixels = np.array([[100.0, 100], [300, 1800], [500, 900], [200, 700], [600, 300], [150, 1300]])
    points = np.random.default_rng(0).uniform(0, 100, (6, 3))
    said = spread_warnings(Keypoints(points, pixels), lens())
    assert any("Only 6" in w for w in said)
    assert any("width" in w and "right" in w for w in said)
    assert not any("height" in w for w in said)


def test_far_landmarks_are_said_to_be_far() -> None:
    """Landmarks that are all about equally far earn a warning."""
    truth = harbour_camera(lens())
    rng = np.random.default_rng(1)
    points = np.column_stack(
        [rng.uniform(-250, 250, 14), rng.uniform(1500, 2000, 14), rng.uniform(0, 60, 14)]
    )
    registration = register_pnp(FRAME, lens(), Keypoints(points, truth.project(points)))
    assert any("are far" in w for w in registration.warnings)


@pytest.mark.parametrize(
    "method", [RegistrationMethod.HOMOGRAPHY_WATER, RegistrationMethod.HOMOGRAPHY_PCA]
)
def test_homographies_are_worse_than_the_camera(method: RegistrationMethod) -> None:
    """With landmarks at different heights both homographies err several times more than PnP."""
    truth = harbour_camera(lens())
    keypoints = seen(truth, 14, 7)
    plane = register_homography(FRAME, lens(), keypoints, method)
    pnp = register_pnp(FRAME, lens(), keypoints)
    assert plane.mae_px is not None
    assert pnp.mae_px is not None
    assert plane.mae_px > 3 * pnp.mae_px
    assert plane.leave_one_out_px is not None
    assert plane.leave_one_out_px > plane.mae_px
    assert plane.camera is None
    assert plane.covariance is None


@pytest.mark.parametrize(
    "method", [RegistrationMethod.HOMOGRAPHY_WATER, RegistrationMethod.HOMOGRAPHY_PCA]
)
def test_homographies_are_exact_on_the_water(method: RegistrationMethod) -> None:
    """Landmarks in one horizontal plane are what a homography can map without error."""
    truth = harbour_camera(lens())
    points = seen(truth, 12, 3).points_in_world * [1, 1, 0] + [0, 150, 0]
    registration = register_homography(
        FRAME, lens(), Keypoints(points, truth.project(points)), method
    )
    assert registration.mae_px is not None
    assert registration.mae_px < 1e-3


def test_given_extrinsics_are_taken_and_compared() -> None:
    """A Rodrigues vector and a WGS84 centre give the camera back; keypoints are only compared."""
    truth = harbour_camera(lens())
    center = FRAME.geodetic(truth.center_in_world)
    rotvec = rotvec_from_matrix(truth.R_cam_from_world)
    keypoints = seen(truth, 4, 1, noise_px=0)
    registration = register_given(FRAME, lens(), rotvec, center, keypoints)
    assert center_error_m(registration, truth) < 1e-6
    assert registration.mae_px == pytest.approx(0, abs=1e-4)
    assert registration.rotvec_cam_from_enu == pytest.approx(rotvec)
    assert registration.center is not None
    assert registration.center.lat_deg == pytest.approx(center.lat_deg, abs=1e-10)
    alone = register_given(FRAME, lens(), rotvec, center)
    assert (alone.mae_px, alone.leave_one_out_px, alone.warnings) == (None, None, [])


def test_a_given_camera_that_looks_away_says_so() -> None:
    """Keypoints behind a given camera have no error, but a warning."""
    truth = harbour_camera(lens())
    center = FRAME.geodetic(truth.center_in_world)
    around = truth.R_cam_from_world @ np.diag([-1.0, -1, 1])
    registration = register_given(
        FRAME, lens(), rotvec_from_matrix(around), center, seen(truth, 6, 1)
    )
    assert registration.mae_px is None
    assert registration.warnings[0].startswith("6 keypoints")


@pytest.mark.parametrize("rotvec", [[0.0, 1.0], [0.0, np.nan, 1.0]])
def test_a_rotation_that_is_none_is_refused(rotvec: list[float]) -> None:
    """Two numbers, or no numbers, are no rotation."""
    with pytest.raises(ValueError, match="rotation"):
        register_given(FRAME, lens(), rotvec, FRAME.origin)


def test_keypoints_are_placed_from_degrees() -> None:
    """Landmarks in degrees come out in the frame asked for; broken ones are refused by number."""
    place = Geodetic(53.545, 9.985, 12.0)
    keypoints = keypoints_in(EcefFrame(), [(place, (10.0, 20.0))])
    np.testing.assert_allclose(
        keypoints.points_in_world, [EcefFrame().position(53.545, 9.985, 12.0)]
    )
    with pytest.raises(RegistrationError, match="keypoint number 2"):
        Keypoints(np.zeros((2, 3)), np.array([[0.0, 0], [np.nan, 0]]))
    with pytest.raises(RegistrationError, match="2 landmarks but 1 pixels"):
        Keypoints(np.zeros((2, 3)), np.zeros((1, 2)))
