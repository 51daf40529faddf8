"""What is said of a viewport's state, and of a registration's quality."""

import pytest

from app.registration.readiness import quality_of, readiness_of
from app.tables.registration import Registration, RegistrationMethod
from app.tables.sites import Viewport


@pytest.mark.parametrize(
    ("keypoints", "method", "images", "word", "href"),
    [
        (5, None, 0, "Needs keypoints", "/viewports/7"),
        (6, None, 9, "Not solved", "/viewports/7"),
        (6, "pnp", 0, "Needs images", "/cameras/3"),
        (0, "given", 1, "Ready", "/runs/new?viewport_id=7"),
    ],
)
def test_every_state_leads_to_its_next_step(
    keypoints: int, method: str | None, images: int, word: str, href: str
) -> None:
    """A viewport is never left without a word and a place to go on."""
    registration = Registration(method=RegistrationMethod(method)) if method else None
    said = readiness_of(Viewport(id=7, camera_id=3), keypoints, registration, images)
    assert (said.word, said.href) == (word, href)


@pytest.mark.parametrize(
    ("method", "leave_one_out_px", "mae_px", "word"),
    [
        ("pnp", 2.9, 0.1, "Good"),
        ("pnp", 3.1, 0.1, "Fair"),
        ("pnp", 10.1, 0.1, "Poor"),
        ("pnp", None, 0.1, "Unknown"),
        ("given", None, None, "Given, unchecked"),
        ("given", None, 11.0, "Poor"),
    ],
)
def test_quality_follows_the_error_to_trust(
    method: str, leave_one_out_px: float | None, mae_px: float | None, word: str
) -> None:
    """The verdict rests on the leave-one-out error, for given poses on the keypoints' error."""
    registration = Registration(
        method=RegistrationMethod(method), leave_one_out_px=leave_one_out_px, mae_px=mae_px
    )
    assert quality_of(registration).word == word
