"""Texts go packed to those who can read it; the rest goes as it is."""

import re
from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.tables.identity import User

PLAIN = {"Accept-Encoding": "identity"}


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # no SQL is asked here
def test_texts_are_packed_and_mean_the_same(
    browser_of: Callable[[User], TestClient], admin: User
) -> None:
    """Pages, JSON and static files come smaller and unpack to the same; caches keep them apart."""
    browser = browser_of(admin)
    script = re.findall(r'src="([^"]*/main[^"]*)"', browser.get("/sites").text)[0]
    for path, packing in (("/sites", "gzip"), ("/api/v1/openapi.json", "gzip"), (script, "br")):
        plain = browser.get(path, headers=PLAIN)
        packed = browser.get(path, headers={"Accept-Encoding": "gzip, br;q=1.0"})
        assert "content-encoding" not in plain.headers
        assert packed.headers["content-encoding"] == packing
        assert packed.headers["content-type"] == plain.headers["content-type"]
        assert int(packed.headers["content-length"]) < len(plain.content) / 2
        assert {packed.headers["vary"], plain.headers["vary"]} == {"Accept-Encoding"}
        if packing == "gzip":  # the test's client knows no brotli
            assert packed.content == plain.content
    gzipped = browser.get(script, headers={"Accept-Encoding": "gzip"})
    assert gzipped.content == browser.get(script, headers=PLAIN).content
    part = browser.get(script, headers={"Range": "bytes=0-9", "Accept-Encoding": "gzip"})
    assert (part.status_code, len(part.content)) == (206, 10)
    assert "content-encoding" not in part.headers
    short = browser.get("/healthz", headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in short.headers
