"""How far the keypoints are, in words: what is missing, where the next one helps, what is poor."""

from typing import Literal

import numpy as np

from app.domain.camera import Intrinsics
from app.domain.guidance import NextPoint, emptiest_part, next_point
from app.domain.keypoints import (
    RECOMMENDED_POINTS,
    Keypoints,
    RegistrationError,
    spread_warnings,
)
from app.domain.registration import Registration
from app.domain.water_view import WaterView
from app.registration.preview_schemas import NextPointOut, ReadinessOut
from app.registration.readiness import FEWEST_KEYPOINTS, GOOD_PX, POOR_PX

Level = Literal["too_few", "refused", "poor", "fair", "good"]


def readiness_out(
    control: Keypoints,
    intrinsics: Intrinsics,
    found: Registration | None,
    error: RegistrationError | None,
    water: WaterView | None,
) -> ReadinessOut:
    """Judge the control keypoints and what PnP made of them."""
    count = len(control)
    different = len(np.unique(control.points_in_world.round(3), axis=0)) if count else 0
    missing = max(FEWEST_KEYPOINTS - different, 0)
    to_good = max(RECOMMENDED_POINTS - different, 0)
    place = _next(control, intrinsics, found, water)
    sentences = [*_missing(count, missing, to_good), *_judged(found, error, missing)]
    if place is not None:
        sentences.append(place.sentence)
    warnings = list(found.warnings) if found else []
    if found is None and count >= FEWEST_KEYPOINTS // 2:
        warnings = spread_warnings(control, intrinsics)
    return ReadinessOut(
        level=_level(found, error, missing, to_good),
        control_points=count,
        missing_for_solution=missing,
        missing_for_good=to_good,
        sentences=sentences,
        warnings=warnings,
        next_point=None if place is None else _shown(place),
    )


def _next(
    control: Keypoints,
    intrinsics: Intrinsics,
    found: Registration | None,
    water: WaterView | None,
) -> NextPoint | None:
    if found is not None and water is not None:
        return next_point(found, control, water)
    return emptiest_part(control, intrinsics) if len(control) < RECOMMENDED_POINTS else None


def _missing(count: int, missing: int, to_good: int) -> list[str]:
    if missing:
        needed = f"{missing} more control {_keypoints(missing)} needed before it can be solved"
        return [f"{needed}; {RECOMMENDED_POINTS} or more are asked for."]
    if to_good:
        asked = f"{to_good} more {_keypoints(to_good)} asked for"
        return [f"{asked}: from {RECOMMENDED_POINTS} on, the lens is refined too."]
    return [f"{count} control keypoints are enough."]


def _keypoints(count: int) -> str:
    return "keypoint is" if count == 1 else "keypoints are"


def _judged(found: Registration | None, error: RegistrationError | None, missing: int) -> list[str]:
    if error is not None and not missing:
        reason = str(error)
        return [f"It cannot be solved: {reason}{'' if reason.endswith('.') else '.'}"]
    if found is None or found.leave_one_out_px is None:
        return []
    error_px = found.leave_one_out_px
    if error_px <= GOOD_PX:
        judged = "good"
    elif error_px <= POOR_PX:
        judged = "fair: look at the worst keypoints"
    else:
        judged = "poor: check the worst keypoints and the focal length"
    return [
        f"A keypoint that was left out is met to {error_px:.1f} px on average, which is {judged}."
    ]


def _level(
    found: Registration | None, error: RegistrationError | None, missing: int, to_good: int
) -> Level:
    if missing:
        return "too_few"
    if found is None:
        return "refused" if error is not None else "too_few"
    error_px = found.leave_one_out_px
    if found.is_widened or error_px is None or error_px > POOR_PX:
        return "poor"
    return "good" if error_px <= GOOD_PX and not to_good else "fair"


def _shown(place: NextPoint) -> NextPointOut:
    return NextPointOut(
        box_px=list(place.box_px),
        range_m=list(place.range_m) if place.range_m else None,
        sigma_before_px=place.sigma_before_px,
        sigma_after_px=place.sigma_after_px,
        sentence=place.sentence,
    )
