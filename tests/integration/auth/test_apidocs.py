"""The reference page shows every operation without running a script of anybody's."""

import re

from fastapi import FastAPI
from starlette.testclient import TestClient


def test_the_reference_has_every_operation(app: FastAPI, anonymous_browser: TestClient) -> None:
    """Each operation of the OpenAPI document is on the page, under a short name of its own."""
    answer = anonymous_browser.get("/api/v1/docs")
    assert answer.status_code == 200
    document = anonymous_browser.get("/api/v1/openapi.json").json()
    operations = [item for path in document["paths"].values() for item in path.values()]
    assert len(operations) > 20
    names = [operation["operationId"] for operation in operations]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z_]{4,40}", name) for name in names)
    for operation in operations:
        assert f'id="{operation["operationId"]}"' in answer.text
    assert "scope admin" in answer.text
    assert "correct horse" not in answer.text
    assert app.openapi_url == "/api/v1/openapi.json"


def test_the_reference_keeps_to_the_policy(anonymous_browser: TestClient) -> None:
    """No inline script or style, and nothing from another origin."""
    page = anonymous_browser.get("/api/v1/docs").text
    assert "style=" not in page
    assert re.findall(r"<script(?![^>]*\bsrc=)", page) == []
    assert re.findall(r'(?:src|href)="https?://', page) == []


def test_the_document_says_who_may(anonymous: TestClient) -> None:
    """Operations carry the scope they demand; public ones carry none."""
    paths = anonymous.get("/api/v1/openapi.json").json()["paths"]
    assert paths["/api/v1/users"]["get"]["security"] == [{"token": ["admin"]}]
    assert "security" not in paths["/healthz"]["get"]


def test_the_document_tells_errors_as_they_are(anonymous: TestClient) -> None:
    """Every operation documents the problem that a failing request really gets."""
    document = anonymous.get("/api/v1/openapi.json").json()
    assert "HTTPValidationError" not in document["components"]["schemas"]
    problem = document["components"]["schemas"]["Problem"]
    given = anonymous.get("/api/v1/me")
    assert (
        given.headers["content-type"]
        in document["paths"]["/api/v1/me"]["get"]["responses"]["default"]["content"]
    )
    assert set(given.json()) == set(problem["properties"])
