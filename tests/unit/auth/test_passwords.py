"""Passwords are hashed with a slow, salted function, and nobody fits nobody's."""

import pytest

from app.auth.passwords import check_password_strength, hash_password, password_fits
from app.errors import Invalid


def test_a_hash_is_argon2id_salted_and_costly() -> None:
    """The parameters are at least those OWASP asks for (19 MiB, two passes)."""
    first, second = hash_password("correct horse"), hash_password("correct horse")
    assert first != second
    _, kind, _, cost, *_ = first.split("$")
    assert kind == "argon2id"
    costs = dict(part.split("=") for part in cost.split(","))
    assert int(costs["m"]) >= 19 * 1024
    assert int(costs["t"]) >= 2


def test_only_the_right_password_fits() -> None:
    """A wrong one, an endless one and an unknown account do not fit."""
    stored = hash_password("correct horse")
    assert password_fits("correct horse", stored)
    assert not password_fits("correct hors", stored)
    assert not password_fits("x" * 2_000_000, stored)
    assert not password_fits("correct horse", None)


@pytest.mark.parametrize("password", ["", "short", "x" * 1001])
def test_weak_passwords_are_refused(password: str) -> None:
    """Too short and absurdly long are refused with a hint."""
    with pytest.raises(Invalid, match="characters"):
        check_password_strength(password)
