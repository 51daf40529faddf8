"""What every detector family offers, whatever network it runs."""

from typing import Protocol

from app.domain.arrays import UInt8Array
from app.domain.detection import Detection


class Detector(Protocol):
    """Finds vessels in photographs."""

    @property
    def settings_sha256(self) -> str:
        """Return the key of what, beside image and model, the boxes depend on."""
        ...

    @property
    def signature(self) -> dict[str, object]:
        """Return what the model takes and gives, as JSON for people to read."""
        ...

    def decoding_divisor(self, image_px: tuple[int, int]) -> int:
        """Return how much smaller an image (width, height) may be decoded: 1, 2, 4 or 8."""
        ...

    def detect(
        self, image_bgr: UInt8Array, image_px: tuple[int, int] | None = None
    ) -> list[Detection]:
        """Return the vessels in an image (height, width, 3), BGR, by falling score.

        Of a reduced image `image_px` is width and height of the whole one: boxes are in its pixels.
        """
        ...
