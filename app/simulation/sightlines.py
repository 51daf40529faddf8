"""Where every pixel of a viewport looks.

Lens distortion makes the line of sight of a pixel costly to find, and smooth. So it is found on a
coarse grid of pixels and interpolated between: the error stays far below a pixel, and this serves
shading only, never geometry or truth.
"""

import cv2
import numpy as np

from app.domain.camera import Camera
from app.simulation.mesh import Shade
from app.simulation.raster import Window

_STEP = 8


def sight_lines(camera: Camera, window: Window) -> Shade:
    """Return unit directions (height, width, 3) in the world of a window's samples."""
    rows, columns = window.height // _STEP + 2, window.width // _STEP + 2
    u = (np.arange(columns) * _STEP + window.left + 0.5) / window.samples_per_px - 0.5
    v = (np.arange(rows) * _STEP + window.top + 0.5) / window.samples_per_px - 0.5
    grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    coarse = camera.rays(grid).reshape(rows, columns, 3).astype(np.float32)
    x, y = np.meshgrid(
        np.arange(window.width, dtype=np.float32) / _STEP,
        np.arange(window.height, dtype=np.float32) / _STEP,
    )
    fine = cv2.remap(coarse, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    unit: Shade = fine / np.linalg.norm(fine, axis=2, keepdims=True)
    return unit
