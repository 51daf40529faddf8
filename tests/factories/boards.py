"""Photographs of a chequerboard by a lens that is known, rendered pixel by pixel."""

from functools import cache

import cv2
import numpy as np

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.calibration import Board
from app.domain.camera import Intrinsics
from app.domain.rotations import matrix_from_rotvec

BOARD = Board(columns=9, rows=6, square_m=0.03)
LENS = Intrinsics(
    800,
    600,
    np.array([[922.0, 0.0, 406.0], [0.0, 919.0, 295.0], [0.0, 0.0, 1.0]]),
    np.array([-0.21, 0.06, 0.0, 0.0, 0.0]),
)
Turn = tuple[float, float, float]
# Turns (Rodrigues) and places of the board's middle before the camera (m): tilted to all sides.
TILTED: list[tuple[Turn, Turn]] = [
    ((0.0, 0.0, 0.05), (0.0, 0.0, 0.42)),
    ((0.5, 0.0, 0.0), (-0.08, -0.05, 0.5)),
    ((-0.5, 0.1, 0.1), (0.08, 0.05, 0.5)),
    ((0.1, 0.6, 0.0), (0.07, -0.05, 0.5)),
    ((0.0, -0.6, 0.1), (-0.08, 0.05, 0.52)),
    ((0.4, 0.4, 0.2), (0.0, 0.0, 0.45)),
    ((-0.4, 0.4, -0.2), (0.1, 0.08, 0.6)),
    ((0.4, -0.4, 0.0), (-0.12, 0.08, 0.6)),
    ((-0.3, -0.4, 0.2), (-0.08, -0.06, 0.6)),
    ((0.2, 0.3, 0.4), (0.07, -0.06, 0.6)),
    ((0.6, 0.2, -0.1), (0.0, 0.04, 0.48)),
    ((-0.2, 0.5, 0.0), (0.02, -0.03, 0.44)),
]


@cache
def _rays() -> FloatArray:
    """Return the lens's rays through a grid of two by two places in each pixel."""
    u, v = np.meshgrid(
        np.arange(2 * LENS.width_px) / 2 - 0.25, np.arange(2 * LENS.height_px) / 2 - 0.25
    )
    shown = np.column_stack([u.ravel(), v.ravel()]).reshape(-1, 1, 2)
    ideal = cv2.undistortPoints(shown, LENS.K.copy(), LENS.distortion.copy()).reshape(-1, 2)
    return np.column_stack([ideal, np.ones(len(ideal))])


def render_board(
    turn: Turn, place: Turn, *, blur_px: float = 0.8, noise: float = 4.0
) -> UInt8Array:
    """Return a photograph (height, width, 3), BGR: each pixel's ray is met with the board.

    Four rays a pixel, so that edges are smooth where they must be.
    """
    R = matrix_from_rotvec(turn)
    middle = BOARD.corners_m().mean(axis=0)
    center = middle - R.T @ np.array(place)
    rays = _rays() @ R
    on_board = center[:2] - center[2] / rays[:, 2:] * rays[:, :2]
    light = _paint(on_board / BOARD.square_m).reshape(2 * LENS.height_px, 2 * LENS.width_px)
    light = light.reshape(LENS.height_px, 2, LENS.width_px, 2).mean(axis=(1, 3))
    picture = cv2.GaussianBlur(light, (0, 0), blur_px)
    grain = np.random.default_rng(7).normal(0, noise, picture.shape)
    grey = np.clip(picture + grain, 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def _paint(squares: FloatArray) -> FloatArray:
    """Return the light of places in units of squares; inner corners have whole coordinates."""
    across, down = np.floor(squares[:, 0]), np.floor(squares[:, 1])
    inside = (across >= -1) & (across < BOARD.columns) & (down >= -1) & (down < BOARD.rows)
    rim = (np.abs(squares[:, 0] - (BOARD.columns - 1) / 2) < BOARD.columns / 2 + 1.2) & (
        np.abs(squares[:, 1] - (BOARD.rows - 1) / 2) < BOARD.rows / 2 + 1.2
    )
    dark = inside & ((across + down) % 2 == 0)
    return np.where(dark, 35.0, np.where(rim, 225.0, 110.0))


def as_jpeg(picture: UInt8Array) -> bytes:
    """Return a picture as a JPEG file."""
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
