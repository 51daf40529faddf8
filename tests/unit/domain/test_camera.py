"""Projection agrees with OpenCV, and lines of sight undo it."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.camera import Camera, Intrinsics
from app.domain.distortion import one_to_one_radius

K = np.array([[6570.7, 0, 1187.0], [0, 6592.3, 935.2], [0, 0, 1]])
WIDE_K = np.array([[1300.0, 0, 1279.5], [0, 1310.0, 959.5], [0, 0, 1]])
LENSES = {
    "ideal": np.zeros(5),
    "barrel": np.array([-0.21, 0.05, 1e-3, -5e-4, 0.01]),
    "pincushion": np.array([0.3, 0.1, -1e-3, 2e-3, 0.0]),
    "folding": np.array([-0.35, 0.0, 0.0, 0.0, 0.0]),
    "moustache": np.array([-0.3, 0.25, 0.0, 0.0, -0.06]),
}


def placed(K: np.ndarray, distortion: np.ndarray, seed: int = 0) -> Camera:
    """Give a camera at a random place and attitude."""
    rng = np.random.default_rng(seed)
    R, _ = cv2.Rodrigues(rng.normal(size=3))
    return Camera(Intrinsics(2560, 1920, K, distortion), R, rng.normal(scale=1e4, size=3))


def world_from_cam(camera: Camera, in_cam: np.ndarray) -> np.ndarray:
    """Place points of the camera frame in the world."""
    return in_cam @ camera.R_cam_from_world + camera.center_in_world


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("seed", range(5))
def test_projection_equals_opencv(lens: str, seed: int) -> None:
    """Inside the field of view our pixels are those of cv2.projectPoints."""
    camera = placed(K, LENSES[lens], seed)
    rng = np.random.default_rng(100 + seed)
    in_cam = np.column_stack([rng.uniform(-0.2, 0.2, (200, 2)), np.ones(200)])
    in_cam *= rng.uniform(50, 3000, (200, 1))
    world = world_from_cam(camera, in_cam)
    rvec, _ = cv2.Rodrigues(camera.R_cam_from_world)
    expected, _ = cv2.projectPoints(world, rvec, camera.t_cam_from_world, K, LENSES[lens])
    np.testing.assert_allclose(camera.project(world), expected[:, 0], atol=1e-6)


@given(
    lens=st.sampled_from(sorted(LENSES)),
    u=st.floats(-0.5, 2559.5),
    v=st.floats(-0.5, 1919.5),
    wide=st.booleans(),
    seed=st.integers(0, 20),
)
def test_rays_undo_projection(lens: str, u: float, v: float, wide: bool, seed: int) -> None:  # noqa: FBT001 - drawn by Hypothesis
    """A point on the line of sight of a pixel is shown at that pixel, to 1e-9 px."""
    camera = placed(WIDE_K if wide else K, LENSES[lens], seed)
    at_origin = Camera(camera.intrinsics, camera.R_cam_from_world, np.zeros(3))
    ray = at_origin.rays([[u, v]])
    if np.isnan(ray).any():  # only beyond the rim of a folding wide-angle lens
        assert wide
        assert lens == "folding"
        return
    assert np.linalg.norm(ray) == pytest.approx(1)
    np.testing.assert_allclose(at_origin.project(ray), [[u, v]], atol=1e-9)


def test_points_behind_the_camera_have_no_pixel() -> None:
    """Mirrored projections of what lies behind the camera never reach the image."""
    camera = placed(K, np.zeros(5))
    world = world_from_cam(camera, np.array([[0, 0, -10.0], [1, 1, -1e-3], [0, 0, 10.0]]))
    np.testing.assert_array_equal(
        np.isnan(camera.project(world)), [[True, True], [True, True], [False, False]]
    )


def test_distortion_does_not_fold_outsiders_into_the_image() -> None:
    """Where a barrel polynomial turns back, a far outsider gets no pixel instead of a wrong one."""
    camera = placed(WIDE_K, LENSES["folding"])
    rim = one_to_one_radius(LENSES["folding"])
    assert rim == pytest.approx(1 / np.sqrt(3 * 0.35))
    world = world_from_cam(
        camera, np.array([[0.99 * rim, 0, 1.0], [1.01 * rim, 0, 1.0], [1.6, 0, 1.0]]) * 100
    )
    shown = camera.project(world)
    assert np.isfinite(shown[0]).all()
    assert np.isnan(shown[1:]).all()
    # OpenCV, which does not look, shows the last one well inside the image.
    folded, _ = cv2.projectPoints(
        np.array([[1.6, 0, 1.0]]), np.zeros(3), np.zeros(3), WIDE_K, LENSES["folding"]
    )
    assert 0 < folded[0, 0, 0] < 2560


def test_a_pixel_beyond_the_rim_has_no_line_of_sight() -> None:
    """A pixel that no point in front of the camera can reach has no direction."""
    camera = placed(WIDE_K, LENSES["folding"])
    assert np.isnan(camera.rays([[5000.0, 960.0]])).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width_px": 0}, "width_px"),
        ({"K": np.diag([0.0, 1, 1])}, "focal"),
        ({"K": np.array([[1.0, 0.1, 0], [0, 1, 0], [0, 0, 1]])}, "skew"),
        ({"distortion": np.zeros(4)}, "distortion"),
        ({"K": np.full((3, 3), np.nan)}, "K must hold finite"),
    ],
)
def test_impossible_intrinsics_are_refused(change: dict[str, object], message: str) -> None:
    """Broken intrinsics are refused with the field's name."""
    fields: dict[str, object] = {"width_px": 10, "height_px": 10, "K": K, **change}
    with pytest.raises(ValueError, match=message):
        Intrinsics(**fields)  # type: ignore[arg-type]  # the point of the test


@pytest.mark.parametrize("R", [2 * np.eye(3), np.diag([1.0, 1, -1])])
def test_a_matrix_that_is_no_rotation_is_refused(R: np.ndarray) -> None:
    """Scaled and mirrored matrices are refused."""
    with pytest.raises(ValueError, match="rotation"):
        Camera(Intrinsics(10, 10, K), R, np.zeros(3))
