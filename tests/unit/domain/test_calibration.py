"""Lenses from rendered chequerboards, whose true focal length and distortion are known."""

import cv2
import numpy as np
import pytest

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.calibration import Board, find_corners, solve_lens
from app.domain.camera import Camera, Intrinsics
from app.domain.rotations import matrix_from_rotvec
from tests.factories.boards import BOARD, LENS, TILTED, render_board

STRAIGHT = [(0.0, 0.0, angle) for angle in (0.0, 0.1, -0.1, 0.2, -0.2, 0.3)]


def corners_of(turn: tuple[float, float, float], noise_px: float = 0.0) -> FloatArray:
    """Return a board's exact corners at a turn, with noise."""
    R = matrix_from_rotvec(turn)
    middle = BOARD.corners_m().mean(axis=0)
    center = middle - R.T @ np.array([0.0, 0.0, 0.9])
    exact = Camera(LENS, R, center).project(BOARD.corners_m())
    seed = abs(hash(turn)) % 2**32
    return exact + np.random.default_rng(seed).normal(0, noise_px, exact.shape)


@pytest.fixture(scope="module")
def photographs() -> list[UInt8Array]:
    """Give rendered photographs of the board from many sides, blurred a little and noisy."""
    return [render_board(turn, place) for turn, place in TILTED]


def test_focal_length_and_distortion_come_back(photographs: list[UInt8Array]) -> None:
    """From twelve rendered photographs: focal length to 0.3 %, centre to 4 px, k1 to 0.02."""
    found = [find_corners(picture, BOARD) for picture in photographs]
    assert [search.problem for search in found] == [None] * len(photographs)
    views = [search.corners_px for search in found if search.corners_px is not None]
    solution = solve_lens(BOARD, views, LENS.width_px, LENS.height_px)
    K = solution.intrinsics.K
    assert K[0, 0] == pytest.approx(LENS.K[0, 0], rel=0.003)
    assert K[1, 1] == pytest.approx(LENS.K[1, 1], rel=0.003)
    assert K[:2, 2] == pytest.approx(LENS.K[:2, 2], abs=4)
    assert solution.intrinsics.distortion[0] == pytest.approx(LENS.distortion[0], abs=0.02)
    assert solution.rms_px < 0.2
    assert solution.view_rms_px.max() < 0.3
    assert solution.outliers == ()
    assert solution.coverage > 0.5


def test_corners_lie_where_they_were_drawn(photographs: list[UInt8Array]) -> None:
    """Corners found in a blurred, noisy picture are right to a sixth of a pixel in the mean."""
    turn, place = TILTED[3]
    search = find_corners(photographs[3], BOARD)
    assert search.corners_px is not None
    R = matrix_from_rotvec(turn)
    middle = BOARD.corners_m().mean(axis=0)
    exact = Camera(LENS, R, middle - R.T @ np.array(place)).project(BOARD.corners_m())
    misses = np.linalg.norm(search.corners_px[:, None] - exact, axis=2).min(axis=1)
    assert misses.mean() < 0.16


def test_boards_straight_on_are_warned_of() -> None:
    """Boards that are all seen straight on leave the focal length open: refused, or said so."""
    views = [corners_of(turn, 0.05) for turn in STRAIGHT]
    try:
        solution = solve_lens(BOARD, views, LENS.width_px, LENS.height_px)
    except ValueError as error:
        assert "tilted" in str(error)  # noqa: PT017  either answer is right
    else:
        assert any("straight on" in warning for warning in solution.warnings)


def test_a_bad_photograph_is_told_by_its_error() -> None:
    """A photograph with a bent board stands out by its own error, and only that one."""
    views = [corners_of(turn, 0.05) for turn, _ in TILTED]
    bent = views[4].copy()
    bent[::7] += (9.0, -6.0)
    views[4] = bent
    solution = solve_lens(BOARD, views, LENS.width_px, LENS.height_px)
    assert solution.outliers == (4,)
    assert solution.view_rms_px[4] > 5 * np.median(solution.view_rms_px)
    assert any("leave them out" in warning for warning in solution.warnings)


def test_too_few_photographs_are_refused() -> None:
    """Two views do not make a lens; the answer says how many do."""
    views = [corners_of(turn) for turn, _ in TILTED[:2]]
    with pytest.raises(ValueError, match="at least 3"):
        solve_lens(BOARD, views, LENS.width_px, LENS.height_px)


def test_pictures_without_the_board_say_so(photographs: list[UInt8Array]) -> None:
    """Another board, a blank picture and a single pixel are named, not crashed upon."""
    other = Board(BOARD.columns + 2, BOARD.rows + 1, 0.03)
    blank = np.full((480, 640, 3), 200, np.uint8)
    pixel = np.zeros((1, 1, 3), np.uint8)
    for picture, board in ((photographs[0], other), (blank, BOARD), (pixel, BOARD)):
        search = find_corners(picture, board)
        assert search.corners_px is None
        assert search.problem is not None
        assert "inner corners" in search.problem


def test_a_blurred_photograph_is_named(photographs: list[UInt8Array]) -> None:
    """A picture out of focus is of no use, and its reason says blurred or not found."""
    blurred = np.asarray(cv2.GaussianBlur(photographs[0], (0, 0), 7), np.uint8)
    search = find_corners(blurred, BOARD)
    assert search.problem is not None


def test_intrinsics_keep_their_size() -> None:
    """The solution is of the photographs' size."""
    views = [corners_of(turn, 0.05) for turn, _ in TILTED]
    found = solve_lens(BOARD, views, LENS.width_px, LENS.height_px).intrinsics
    assert isinstance(found, Intrinsics)
    assert (found.width_px, found.height_px) == (LENS.width_px, LENS.height_px)
