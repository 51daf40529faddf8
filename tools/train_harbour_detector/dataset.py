"""Rendered scenes as training samples: strips of an image, flipped, scaled and recoloured.

Vessels stand in a band below the horizon, so a sample is a strip as wide as the image: every ship
stays whole at the scale at which the network will be used, and none of the work goes into empty
sky. The network is fully convolutional, so it may be used on whole images afterwards. A ship that
the strip's edge cuts is ignored, because the box of what remains is not known; one that the
image's own edge cuts has an exact box and counts.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.random import Generator

from app.domain.arrays import Float32Array, UInt8Array
from app.domain.letterbox import PADDING_GREY

WIDTH_PX, HEIGHT_PX = 640, 160
_SCALES = (0.7, 1.3)
_ABOUT_A_VESSEL = 0.85  # share of strips that are laid about a vessel; the rest lie anywhere
_LEAST_KEPT = 0.95  # of a box's area within the strip, or the vessel is ignored
_LEAST_SIDES_PX = (3.0, 8.0)


@dataclass(frozen=True, slots=True)
class Scene:
    """An image (h, w, 3), BGR, and its boxes (n, 5): x1 y1 x2 y2 px, 1 target or 0 to ignore."""

    image: UInt8Array
    boxes: Float32Array


def load_scenes(folder: Path, harbours: int) -> list[Scene]:
    """Load the first `harbours` files of a folder; raises ValueError when there are fewer."""
    paths = sorted(folder.glob("harbour_??????.npz"))[:harbours]
    if len(paths) < harbours:
        raise ValueError(f"{folder} holds {len(paths)} harbours, {harbours} are asked for")
    scenes = []
    for path in paths:
        with np.load(path) as held:
            images, boxes, owners = held["images"], held["boxes"], held["image_of_box"]
        scenes += [Scene(image, boxes[owners == i]) for i, image in enumerate(images)]
    return scenes


def draw_batch(scenes: list[Scene], rng: Generator, size: int) -> tuple[UInt8Array, list[Scene]]:
    """Draw samples: images (size, 3, h, w) for the network, and each as a scene of its own."""
    drawn = [draw_sample(scenes[int(rng.integers(len(scenes)))], rng) for _ in range(size)]
    stacked = np.stack([sample.image.transpose(2, 0, 1) for sample in drawn])
    return stacked, drawn


def draw_sample(scene: Scene, rng: Generator) -> Scene:
    """Cut a strip out of a scene."""
    image, boxes = scene.image, scene.boxes.copy()
    height, width = image.shape[:2]
    if rng.random() < 0.5:
        image = image[:, ::-1]
        boxes[:, [0, 2]] = width - boxes[:, [2, 0]]
    scale = float(np.exp(rng.uniform(*np.log(_SCALES))))
    left = float(rng.uniform(0, max(0.0, scale * width - WIDTH_PX)))
    top = float(rng.uniform(0, max(0.0, scale * height - HEIGHT_PX)))
    targets = boxes[boxes[:, 4] > 0]
    if len(targets) and rng.random() < _ABOUT_A_VESSEL:
        low, high = targets[int(rng.integers(len(targets))), [1, 3]] * scale
        top = (low + high) / 2 - float(rng.uniform(0.15, 0.85)) * HEIGHT_PX
        top = float(np.clip(top, 0, max(0.0, scale * height - HEIGHT_PX)))
    # Pixel centres stand at halves when counted from the edge: hence the half pixels.
    move = np.array([[scale, 0, (scale - 1) / 2 - left], [0, scale, (scale - 1) / 2 - top]])
    strip = cv2.warpAffine(
        np.ascontiguousarray(image), move, (WIDTH_PX, HEIGHT_PX), flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT, borderValue=(PADDING_GREY,) * 3,
    )  # fmt: skip
    boxes[:, :4] = boxes[:, :4] * scale - np.array([left, top, left, top])
    inside = (WIDTH_PX, HEIGHT_PX) if scale * width >= WIDTH_PX else (scale * width, HEIGHT_PX)
    filled = strip[:, : int(inside[0])]
    filled[:] = _recoloured(filled, rng)
    return Scene(strip, _cut(boxes))


def _cut(boxes: Float32Array) -> Float32Array:
    """Clip boxes to the strip; what is cut or has become tiny is ignored from now on."""
    clipped = boxes.copy()
    clipped[:, [0, 2]] = np.clip(boxes[:, [0, 2]], 0, WIDTH_PX)
    clipped[:, [1, 3]] = np.clip(boxes[:, [1, 3]], 0, HEIGHT_PX)
    before, after = boxes[:, 2:4] - boxes[:, :2], clipped[:, 2:4] - clipped[:, :2]
    kept = after.prod(axis=1) / np.maximum(before.prod(axis=1), 1e-6)
    large = (after.min(axis=1) >= _LEAST_SIDES_PX[0]) & (after.max(axis=1) >= _LEAST_SIDES_PX[1])
    clipped[:, 4] *= (kept >= _LEAST_KEPT) & large
    return clipped[(after > 0).all(axis=1)]


def _recoloured(image: UInt8Array, rng: Generator) -> UInt8Array:
    """Another exposure, white balance, saturation and sharpness, and other noise."""
    values = image.astype(np.float32)
    grey = values.mean(axis=2, keepdims=True)
    values = grey + (values - grey) * np.float32(rng.uniform(0.6, 1.4))
    values *= rng.uniform(0.92, 1.08, 3).astype(np.float32) * np.float32(rng.uniform(0.7, 1.3))
    middle = values.mean()
    values = middle + (values - middle) * np.float32(rng.uniform(0.75, 1.3))
    if rng.random() < 0.25:
        values = cv2.GaussianBlur(values, (0, 0), float(rng.uniform(0.4, 1.0)))
    if rng.random() < 0.3:
        values += rng.standard_normal(values.shape, dtype=np.float32) * float(rng.uniform(1, 6))
    return np.clip(values, 0, 255).astype(np.uint8)
