"""Mistakes people make with keypoints: refused or survived, and named."""

import numpy as np
import pytest

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.keypoints import Keypoints, RegistrationError, Suspicion, SuspicionKind
from app.domain.registration import Registration, register_pnp
from app.domain.rotations import matrix_from_rotvec

FRAME = EnuFrame(Geodetic(53.54, 9.98, 0.0))


def lens(focal_px: float = 6570.0, k1: float = 0.0) -> Intrinsics:
    """Give a lens like the published camera's."""
    K = np.array([[focal_px, 0, 1187], [0, 1.003 * focal_px, 935], [0, 0, 1]])
    return Intrinsics(2560, 1920, K, np.array([k1, 0, 0, 0, 0]))


TRUTH = Camera(
    lens(k1=-0.2),
    matrix_from_rotvec([np.radians(2.0), 0, 0]) @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    np.array([0.0, 0, 30]),
)


def seen(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Give landmarks 100 to 1500 m away and their pixels with 2 px of noise."""
    rng = np.random.default_rng(seed)
    points = np.empty((0, 3))
    while len(points) < count:
        north = np.exp(rng.uniform(np.log(100), np.log(1500), 400))
        east = north * rng.uniform(-0.19, 0.19, 400)
        some = np.column_stack([east, north, rng.uniform(0, 60, 400)])
        pixels = TRUTH.project(some)
        points = np.vstack([points, some[((pixels > 0) & (pixels < [2560, 1920])).all(axis=1)]])
    points = points[:count]
    return points, TRUTH.project(points) + rng.normal(0, 2, (count, 2))


def solved(
    points: np.ndarray, pixels: np.ndarray, focal_px: float = 6570.0
) -> tuple[Registration | None, tuple[Suspicion, ...]]:
    """Register as the product does; give the answer, or None, with what is suspected."""
    names = tuple(f"Landmark {number}" for number in range(1, len(points) + 1))
    try:
        found = register_pnp(
            FRAME, lens(focal_px), Keypoints(points, pixels, names), water_level_m=0.0
        )
    except RegistrationError as error:
        return None, error.suspicions
    return found, tuple(found.suspicions)


def water_error_px(found: Registration) -> float:
    """Median error of water points 300 m away across the image."""
    assert found.camera is not None
    east = np.linspace(-50, 50, 9)
    points = np.column_stack([east, np.full(9, 300.0), np.zeros(9)])
    apart = found.camera.project(points) - TRUTH.project(points)
    return float(np.median(np.linalg.norm(apart, axis=1)))


@pytest.mark.parametrize("count", [7, 10, 14])
def test_two_exchanged_landmarks_are_named(count: int) -> None:
    """A swapped pair is named both where the rest suffices to solve and where it does not."""
    for seed in range(4):
        points, pixels = seen(count, seed)
        pixels[[1, 3]] = pixels[[3, 1]]
        found, suspicions = solved(points, pixels)
        assert (SuspicionKind.SWAPPED, (1, 3)) in [(s.kind, s.indices) for s in suspicions]
        assert "'Landmark 2' and 'Landmark 4' seem to be exchanged" in suspicions[0].message
        if count == 14:
            assert found is not None
            assert water_error_px(found) < 8


@pytest.mark.parametrize("count", [8, 14])
def test_heights_turned_over_are_refused_and_told_from_rows_counted_from_below(count: int) -> None:
    """Both mirror the scene; each is refused with its own name, never solved under water."""
    points, pixels = seen(count, 1)
    found, suspicions = solved(points * [1, 1, -1], pixels)
    assert found is None
    assert [s.kind for s in suspicions] == [SuspicionKind.MIRRORED_HEIGHTS]
    found, suspicions = solved(points, pixels * [1, -1] + [0, 1919])
    assert found is None
    assert [s.kind for s in suspicions] == [SuspicionKind.MIRRORED_ROWS]


@pytest.mark.parametrize("share", [0.8, 0.9, 0.95, 1.05, 1.1, 1.2])
def test_a_wrong_focal_length_is_survived_with_ten_points_and_named_with_fewer(
    share: float,
) -> None:
    """From ten points on it is refined; with eight it is named, and what was solved is doubted."""
    found, _ = solved(*seen(14, 2), share * 6570)
    assert found is not None
    assert water_error_px(found) < 4
    found, suspicions = solved(*seen(8, 2), share * 6570)
    assert SuspicionKind.FOCAL_LENGTH in [s.kind for s in suspicions]
    assert found is None or any("agree only within" in warning for warning in found.warnings)


def test_a_wrong_height_is_named_with_the_height_that_fits() -> None:
    """One landmark 25 m too high is left out, and its own height is told."""
    points, pixels = seen(14, 3)
    height_m = FRAME.geodetic(points[0]).height_m
    points[0, 2] += 25
    found, suspicions = solved(points, pixels)
    assert found is not None
    assert [(s.kind, s.indices) for s in suspicions] == [(SuspicionKind.HEIGHT, (0,))]
    told = float(suspicions[0].message.split("height of ")[1].split(" m")[0])
    assert told == pytest.approx(height_m, abs=1.5)


def test_a_camera_under_water_is_refused() -> None:
    """A scene given wholly below the water level leads to no camera but to a reason."""
    points, pixels = seen(14, 4)
    names = tuple("abcdefghijklmn")
    with pytest.raises(RegistrationError, match="under the water"):
        register_pnp(FRAME, lens(), Keypoints(points, pixels, names), water_level_m=50.0)


def test_repeated_keypoints_and_landmarks_on_the_water_are_survived() -> None:
    """Copies of a keypoint add nothing and break nothing; landmarks in one plane are enough."""
    points, pixels = seen(14, 5)
    points[5:9], pixels[5:9] = points[5], pixels[5]
    found, _ = solved(points, pixels)
    assert found is not None
    assert water_error_px(found) < 8
    points, _ = seen(60, 6)
    points[:, 2] = 0
    pixels = TRUTH.project(points)
    inside = np.flatnonzero(((pixels > 0) & (pixels < [2560, 1920])).all(axis=1))[:14]
    found, _ = solved(points[inside], pixels[inside])
    assert found is not None
    assert water_error_px(found) < 2
