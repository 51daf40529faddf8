"""One-time codes: the published values, the window around now, and no code twice."""

import base64
from datetime import UTC, datetime, timedelta

import pytest

from app.auth.totp import code_of_step, matching_step, new_secret, step_of

# RFC 6238, appendix B, for SHA-1: the last six of the eight digits given there.
RFC_SECRET = base64.b32encode(b"12345678901234567890").decode()


@pytest.mark.parametrize(
    ("at_s", "code"), [(59, "287082"), (1111111109, "081804"), (20000000000, "353130")]
)
def test_codes_are_those_of_the_standard(at_s: int, code: str) -> None:
    """The published test values come out."""
    assert code_of_step(RFC_SECRET, step_of(datetime.fromtimestamp(at_s, UTC))) == code


def test_a_code_is_taken_around_its_time_and_only_once() -> None:
    """A clock half a minute off passes; one two minutes off, or a replay, does not."""
    secret, moment = new_secret(), datetime(2026, 11, 22, 10, tzinfo=UTC)
    code = code_of_step(secret, step_of(moment))
    assert matching_step(secret, f"{code[:3]} {code[3:]}", moment, None) == step_of(moment)
    for off_s in (-30, 30):
        assert matching_step(secret, code, moment + timedelta(seconds=off_s), None) is not None
    assert matching_step(secret, code, moment + timedelta(minutes=2), None) is None
    assert matching_step(secret, code, moment, step_of(moment)) is None
    assert matching_step(secret, "ÄÖÜ", moment, None) is None
