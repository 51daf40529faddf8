"""Intrinsics from the one figure a data sheet of a surveillance camera gives: its angle of view.

A pinhole with square pixels and its principal point at the middle: good enough to begin with, as
keypoints and a calibration find better ones.
"""

import math
from collections.abc import Mapping

from app.errors import FieldError, Invalid

PINHOLE = ("fx_px", "fy_px", "cx_px", "cy_px")
LARGEST_DEG = 150.0  # wider lenses are no pinholes


def with_guess(entered: Mapping[str, str]) -> dict[str, str]:
    """Return a camera's form with the intrinsics its angle of view tells, where all are empty.

    Raises Invalid (`angle_deg`) where neither is given or the angle cannot be one.
    """
    rest = {name: value for name, value in entered.items() if name != "angle_deg"}
    if any(entered.get(name, "").strip() for name in PINHOLE):
        return rest
    told = entered.get("angle_deg", "").strip().replace(",", ".")
    try:
        angle_deg = float(told)
        width_px, height_px = int(entered.get("width_px", "")), int(entered.get("height_px", ""))
    except ValueError:
        if told or not entered.get("width_px", "").strip():
            return rest  # what is wrong with the image's size is told by the other checks
        raise _wrong("give the focal lengths and the principal point, or this angle") from None
    if not 1.0 <= angle_deg <= LARGEST_DEG:
        raise _wrong(f"must lie between 1 and {LARGEST_DEG:.0f} degrees")
    f_px = width_px / 2 / math.tan(math.radians(angle_deg) / 2)
    guess = (f_px, f_px, (width_px - 1) / 2, (height_px - 1) / 2)
    return rest | {name: f"{value:.2f}" for name, value in zip(PINHOLE, guess, strict=True)}


def _wrong(message: str) -> Invalid:
    return Invalid(f"angle_deg: {message}", fields=(FieldError("angle_deg", message),))
