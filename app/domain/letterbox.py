"""A photograph into a detector's fixed input, and boxes back again, as YOLOX does it.

The image is scaled by one ratio until it fits, put into the top-left corner, and the rest is
filled with grey 114. So a box returns by one division, and nothing is stretched. Doing it in any
other way (centred, stretched, another interpolation) costs a trained network part of its boxes.

Source: YOLOX, `preproc` of its data augmentation (linear interpolation, BGR, 0 to 255).
"""

from dataclasses import dataclass

import cv2
import numpy as np

from app.domain.arrays import Float32Array, FloatArray, UInt8Array

PADDING_GREY = 114


@dataclass(frozen=True, slots=True)
class Letterbox:
    """The fit of one image size into one input size, both in pixels."""

    image_width_px: int
    image_height_px: int
    input_width_px: int
    input_height_px: int

    @property
    def ratio(self) -> float:
        """Input pixels per image pixel, the same in both directions."""
        return min(
            self.input_width_px / self.image_width_px, self.input_height_px / self.image_height_px
        )

    @property
    def scaled_px(self) -> tuple[int, int]:
        """Width and height of the image within the input."""
        return (
            max(1, int(self.image_width_px * self.ratio)),
            max(1, int(self.image_height_px * self.ratio)),
        )

    def tensor(self, image_bgr: UInt8Array) -> Float32Array:
        """Return the network's input (1, 3, height, width), BGR, 0 to 255, from an image.

        Args:
            image_bgr: (height, width, 3), BGR as OpenCV decodes it: the image, or itself reduced.

        """
        width_px, height_px = self.scaled_px
        padded = np.full(
            (self.input_height_px, self.input_width_px, 3), PADDING_GREY, dtype=np.uint8
        )
        padded[:height_px, :width_px] = cv2.resize(
            image_bgr, (width_px, height_px), interpolation=cv2.INTER_LINEAR
        )
        return np.ascontiguousarray(padded.transpose(2, 0, 1)[np.newaxis], dtype=np.float32)

    def to_image_px(self, boxes_in_input_px: FloatArray) -> FloatArray:
        """Return boxes (n, 4) x1 y1 x2 y2 in full-image pixels, clipped to the image."""
        limits = (self.image_width_px, self.image_height_px) * 2
        return np.clip(boxes_in_input_px / self.ratio, 0.0, limits)
