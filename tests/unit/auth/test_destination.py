"""Where a sign-in may lead: never off the site."""

from urllib.parse import urljoin, urlsplit

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from app.auth.destination import safe_destination

HERE = "https://quay.example/sign-in"
nasty = st.text(alphabet="/\\:.@#?%&\t\n\r a\x00evil", max_size=30)


@given(st.text() | nasty | nasty.map("/".__add__))
@example("//evil.example")
@example("/\\evil.example")
@example("/\t/evil.example")
@example("javascript:alert(1)")
@example("/" + "a" * 3000)
def test_the_destination_is_on_this_site(wanted: str) -> None:
    """However it is spelt, the result resolves to our own host over our own scheme."""
    destination = safe_destination(wanted)
    # Browsers take backslashes for slashes and drop tabs and line ends.
    seen = destination.replace("\\", "/").translate({9: None, 10: None, 13: None})
    parts = urlsplit(urljoin(HERE, seen))
    assert (parts.scheme, parts.netloc) == ("https", "quay.example")
    assert destination.startswith("/")


@pytest.mark.parametrize("path", ["/", "/sites/1", "/runs?page=2&x=a%20b", "/a#b", "/a//b"])
def test_a_path_of_this_site_stays(path: str) -> None:
    """Ordinary paths come back as they are."""
    assert safe_destination(path) == path
