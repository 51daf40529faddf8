"""The licence check itself."""

import pytest

from tests.check_licences import is_accepted


@pytest.mark.parametrize(
    ("licence", "accepted"),
    [
        ("MIT", True),
        ("Apache-2.0 OR GPL-3.0-only", True),
        ("(MIT OR CC0-1.0)", True),
        ("MIT AND PSF-2.0", True),
        ("LGPL-3.0-only", True),
        ("Mozilla Public License 2.0 (MPL 2.0)", True),
        ("GPL-3.0-only", False),
        ("AGPL-3.0-or-later", False),
        ("MIT AND GPL-2.0-only", False),
        ("MIT License; GNU General Public License (GPL)", False),
        ("GNU Affero General Public License v3", False),
        ("UNKNOWN", False),
        ("", False),
    ],
)
def test_what_may_be_handed_on_is_told_from_what_may_not(licence: str, *, accepted: bool) -> None:
    """Alternatives need one accepted licence, sums need all, and the unknown is never accepted."""
    assert is_accepted(licence) is accepted
