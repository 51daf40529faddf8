"""Where a photograph lies within a network's input, and boxes back out of it.

Each family was trained on images scaled in its own way: put into a corner, into the middle,
stretched, or scaled until the short side has a size. All of them are one thing: the scaled size,
and the place of its corner in the input. With that a tensor is painted and a box returns.

Sources: mmdetection `Resize`, `Normalize` and `Pad`; Hugging Face `DetrImageProcessor`; the
letterbox of darknet. Pixels are counted from the image's edge, as boxes are.
"""

from dataclasses import dataclass
from math import ceil

import cv2
import numpy as np

from app.domain.arrays import Float32Array, FloatArray, UInt8Array


@dataclass(frozen=True, slots=True)
class Colours:
    """How pixel values become a tensor: `(value - mean) / std` of values 0 to 255, by channel.

    `padding` is the value of the tensor where there is no image.
    """

    is_rgb: bool
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    std: tuple[float, float, float] = (1.0, 1.0, 1.0)
    padding: float = 0.0


BGR_BYTES = Colours(is_rgb=False, padding=114.0)
RGB_SHARES = Colours(is_rgb=True, std=(255.0, 255.0, 255.0))
RGB_SHARES_ON_GREY = Colours(is_rgb=True, std=(255.0, 255.0, 255.0), padding=114 / 255)
# The mean and deviation of ImageNet's photographs, which the backbones were trained on.
RGB_IMAGENET = Colours(is_rgb=True, mean=(123.675, 116.28, 103.53), std=(58.395, 57.12, 57.375))


@dataclass(frozen=True, slots=True)
class Placement:
    """An image scaled to a size and put at a place of an input; all in pixels."""

    image_width_px: int
    image_height_px: int
    scaled_width_px: int
    scaled_height_px: int
    input_width_px: int
    input_height_px: int
    left_px: int = 0
    top_px: int = 0

    def tensor(self, image_bgr: UInt8Array, colours: Colours) -> Float32Array:
        """Return the network's input (1, 3, height, width) from an image (height, width, 3).

        The image may be a reduced one of the same picture.
        """
        size = (self.scaled_width_px, self.scaled_height_px)
        scaled = image_bgr
        if size != image_bgr.shape[1::-1]:
            scaled = np.asarray(cv2.resize(image_bgr, size, interpolation=cv2.INTER_LINEAR))
        if colours.is_rgb:
            scaled = scaled[:, :, ::-1]
        shape = (1, 3, self.input_height_px, self.input_width_px)
        tensor = np.full(shape, colours.padding, dtype=np.float32)
        rows = slice(self.top_px, self.top_px + self.scaled_height_px)
        columns = slice(self.left_px, self.left_px + self.scaled_width_px)
        for channel in range(3):
            values = scaled[:, :, channel].astype(np.float32)
            values -= np.float32(colours.mean[channel])
            values /= np.float32(colours.std[channel])
            tensor[0, channel, rows, columns] = values
        return tensor

    def to_image_px(self, boxes_in_input_px: FloatArray) -> FloatArray:
        """Return boxes (n, 4) x1 y1 x2 y2 in full-image pixels; they may reach beyond it."""
        corner = (self.left_px, self.top_px) * 2
        scale = (
            self.scaled_width_px / self.image_width_px,
            self.scaled_height_px / self.image_height_px,
        ) * 2
        return (boxes_in_input_px - corner) / scale


def stretched(image_px: tuple[int, int], input_px: tuple[int, int]) -> Placement:
    """Fill the input (width, height) with the image, whatever that does to its proportions."""
    return Placement(*image_px, *input_px, *input_px)


def in_corner(image_px: tuple[int, int], input_px: tuple[int, int]) -> Placement:
    """Scale until it fits and put into the top-left corner, as mmdetection does."""
    return Placement(*image_px, *_fitting(image_px, input_px), *input_px)


def in_middle(image_px: tuple[int, int], input_px: tuple[int, int]) -> Placement:
    """Scale until it fits and put into the middle, as darknet does."""
    width_px, height_px = _fitting(image_px, input_px)
    left_px, top_px = (input_px[0] - width_px) // 2, (input_px[1] - height_px) // 2
    return Placement(*image_px, width_px, height_px, *input_px, left_px, top_px)


def with_short_side(
    image_px: tuple[int, int], short_px: int, longest_px: int, multiple_px: int = 1
) -> Placement:
    """Scale to a short side, the long one at most so long; pad sides to a multiple below right."""
    ratio = min(short_px / min(image_px), longest_px / max(image_px))
    width_px, height_px = (max(1, int(side * ratio + 0.5)) for side in image_px)
    padded = [ceil(side / multiple_px) * multiple_px for side in (width_px, height_px)]
    return Placement(*image_px, width_px, height_px, *padded)


def _fitting(image_px: tuple[int, int], input_px: tuple[int, int]) -> tuple[int, int]:
    ratio = min(input_px[0] / image_px[0], input_px[1] / image_px[1])
    width_px, height_px = (max(1, int(side * ratio + 0.5)) for side in image_px)
    return min(width_px, input_px[0]), min(height_px, input_px[1])
