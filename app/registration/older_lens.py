"""Whether a camera's intrinsics were changed after a registration was solved with them.

A registration keeps those it was solved with, refined or not, and so do its poses. Refining moves
the focal length and k1 alone, held by a prior: whatever else differs, or moved far beyond what the
prior lets it, was changed by a person or by a calibration.
"""

import math

from app.domain.pnp import Priors
from app.registration.conversion import intrinsics_of, intrinsics_to_json
from app.tables.registration import Registration
from app.tables.sites import Camera

_SAME = 1e-6  # pixels and terms, after a way through JSON
_REFINED_SIGMAS = 5.0


def is_of_older_lens(registration: Registration, camera: Camera) -> bool:
    """Whether a registration surely rests on other intrinsics than its camera has now."""
    then, now = registration.intrinsics, intrinsics_to_json(intrinsics_of(camera))
    by_focal = [math.log(then[name] / now[name]) for name in ("fx_px", "fy_px")]
    fixed = [then[name] - now[name] for name in ("width_px", "height_px", "cx_px", "cy_px")]
    fixed += [a - b for a, b in zip(then["distortion"][1:], now["distortion"][1:], strict=True)]
    fixed.append(by_focal[0] - by_focal[1])
    is_far = abs(by_focal[0]) > _REFINED_SIGMAS * Priors().focal
    return is_far or any(abs(change) > _SAME for change in fixed)
