"""How far a viewport is, in words: what it has, how good that is, what to do next.

The thresholds speak of the leave-one-out error: 3 px is what clicking landmarks on a sharp
photograph costs; beyond 10 px a vessel's box visibly leaves the vessel.
"""

from dataclasses import dataclass

from app.tables.registration import Registration, RegistrationMethod
from app.tables.sites import Viewport

FEWEST_KEYPOINTS = 6
GOOD_PX = 3.0
POOR_PX = 10.0


@dataclass(frozen=True, slots=True)
class Readiness:
    """A word with a tone (of ui.html's badge), and the next step with where to take it."""

    word: str
    tone: str
    next_step: str
    href: str


@dataclass(frozen=True, slots=True)
class Quality:
    """How good a registration is, in a word with a tone, and the figure behind it."""

    word: str
    tone: str
    figure: str


def readiness_of(
    viewport: Viewport, keypoint_count: int, registration: Registration | None, image_count: int
) -> Readiness:
    """Say how far a viewport is."""
    here = f"/viewports/{viewport.id}"
    if registration is None and keypoint_count < FEWEST_KEYPOINTS:
        return Readiness(
            "Needs keypoints",
            "warning",
            f"Mark at least {FEWEST_KEYPOINTS} landmarks, better 10, or give a known pose",
            here,
        )
    if registration is None:
        return Readiness("Not solved", "warning", "Solve its keypoints", here)
    if image_count == 0:
        camera = f"/cameras/{viewport.camera_id}"
        return Readiness("Needs images", "warning", "Upload photographs of its time", camera)
    return Readiness("Ready", "success", "Start a run", f"/runs/new?viewport_id={viewport.id}")


def quality_of(registration: Registration) -> Quality:
    """Say how good a registration is."""
    error_px = registration.leave_one_out_px
    if registration.method is RegistrationMethod.GIVEN:
        if registration.mae_px is None:
            return Quality("Given, unchecked", "", "no keypoints to check it")
        return _graded(registration.mae_px, "mean error")
    if registration.method is RegistrationMethod.ROTATION:
        support = (registration.provenance or {}).get("inliers", 0)
        return Quality("Turned", "success", f"{support} points of the scenery agree")
    if error_px is None:
        return Quality("Unknown", "", "no leave-one-out error")
    return _graded(error_px, "leave-one-out error")


def _graded(error_px: float, what: str) -> Quality:
    figure = f"{error_px:.1f} px {what}"
    if error_px <= GOOD_PX:
        return Quality("Good", "success", figure)
    if error_px <= POOR_PX:
        return Quality("Fair", "warning", figure)
    return Quality("Poor", "danger", figure)
