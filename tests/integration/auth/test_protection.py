"""What stands before every route: Host, sizes, headers on every answer, the log without secrets."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import structlog
from fastapi import Depends, FastAPI
from starlette.testclient import TestClient

from app.auth.access import public
from app.auth.authentication import SESSION_COOKIE
from app.config import Settings
from app.main import create_app
from app.tables.identity import User

MALFORMED = ("a/?x=", "a b", "", "a@b", "a:b", "evil.example#", "a\\b", "[::1", "a:123456", "<b>")
ORDINARY = ("quay.example", "quay.example:8000", "127.0.0.1:1", "[::1]:80")


def test_a_malformed_host_is_refused(anonymous: TestClient) -> None:
    """A Host that could move the path elsewhere is 400 before any route sees it."""
    for host in MALFORMED:
        answer = anonymous.get("/healthz", headers={"Host": host})
        assert answer.status_code == 400, host
        assert answer.headers["content-type"] == "application/problem+json"


def test_an_ordinary_host_is_taken(anonymous: TestClient) -> None:
    """Names and addresses with and without a port are fine."""
    for host in ORDINARY:
        assert anonymous.get("/healthz", headers={"Host": host}).status_code == 200


def test_only_allowed_hosts_where_they_are_named(settings: Settings) -> None:
    """An installation that knows its names answers to no other."""
    app = create_app(Settings(**settings.model_dump() | {"allowed_hosts": ["Quay.example"]}))
    with TestClient(app) as anybody:
        assert anybody.get("/healthz", headers={"Host": "quay.example:80"}).status_code == 200
        assert anybody.get("/healthz", headers={"Host": "evil.example"}).status_code == 400


def test_too_many_or_too_large_headers_are_refused(anonymous: TestClient) -> None:
    """Headers are bounded in number and in size."""
    many = {f"X-{number}": "1" for number in range(101)}
    assert anonymous.get("/healthz", headers=many).status_code == 431
    assert anonymous.get("/healthz", headers={"X-Large": "x" * 170_000}).status_code == 431


def test_a_stranger_cannot_send_much(anonymous: TestClient) -> None:
    """Whoever is nobody is cut off at the size of a sign-in form, announced or not."""
    body = b"x" * 65_537
    assert anonymous.post("/api/v1/images", content=body).status_code == 413
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    assert anonymous.post("/sign-in", content=iter([body]), headers=form).status_code == 413


def test_uploads_are_cut_off_at_their_limit(settings: Settings, client: TestClient) -> None:
    """A known caller's upload is counted while it comes in, without a Content-Length too."""
    app = create_app(Settings(**settings.model_dump() | {"max_upload_bytes": 1000}))
    form = b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.jpg"\r\n\r\n'
    parts = [form, *[b"x" * 100_000] * 11, b"\r\n--b--\r\n"]
    headers = {**client.headers, "Content-Type": "multipart/form-data; boundary=b"}
    with TestClient(app, headers=headers) as small:
        assert small.post("/api/v1/images", content=b"".join(parts)).status_code == 413
        assert small.post("/api/v1/images", content=iter(parts)).status_code == 413


def test_json_is_small(client: TestClient) -> None:
    """JSON larger than any honest request is refused before it is parsed."""
    body = b'{"name": "' + b"x" * (16 * 2**20) + b'"}'
    answer = client.post(
        "/api/v1/tokens", content=body, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code == 413
    assert answer.json()["status"] == 413


def test_a_nonsense_length_is_refused(anonymous: TestClient) -> None:
    """A Content-Length that is no number is 400."""
    for length in ("-1", "1e3", "²", "x"):
        headers = {"Content-Length": length.encode("latin-1")}
        assert anonymous.post("/sign-in", content=b"x", headers=headers).status_code == 400


def test_every_answer_is_armoured(anonymous_browser: TestClient) -> None:
    """The strict policy is on pages, on JSON and on errors alike."""
    for path in ("/healthz", "/sign-in", "/nowhere", "/api/v1/me", "/api/v1/docs", "/static/no.js"):
        headers = anonymous_browser.get(path).headers
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert len(headers["x-request-id"]) == 16


@pytest.fixture
def failing_app(settings: Settings) -> Iterator[FastAPI]:
    """Give an application with a route nobody foresaw to fail."""
    app = create_app(settings)

    def fail() -> None:
        """Fail with a secret in the message."""
        raise RuntimeError("the password is swordfish")

    app.add_api_route("/api/v1/fail", fail, dependencies=[Depends(public)])
    app.add_api_route("/fail", fail, dependencies=[Depends(public)])
    with TestClient(app):
        yield app


def test_what_nobody_foresaw_shows_no_trace(failing_app: FastAPI) -> None:
    """An unforeseen error is a bare problem or page, with all headers, and nothing of its cause."""
    script, browser = (
        TestClient(failing_app, headers={"Accept": accept}) for accept in ("*/*", "text/html")
    )
    problem = script.get("/api/v1/fail")
    assert problem.status_code == 500
    assert problem.headers["content-type"] == "application/problem+json"
    shown = browser.get("/fail")
    assert shown.status_code == 500
    assert "<h1>" in shown.text
    for answer in (problem, shown):
        assert "swordfish" not in answer.text
        assert "Traceback" not in answer.text
        assert "default-src 'none'" in answer.headers["content-security-policy"]


def test_the_log_has_a_line_for_each_request_and_no_secrets(
    client: TestClient, browser_of: Callable[[User], TestClient], admin: User
) -> None:
    """Who, what and how it ended; no token, no cookie, no query."""
    browser = browser_of(admin)
    with structlog.testing.capture_logs() as lines:
        answer = client.get("/api/v1/me?secret=swordfish")
        browser.get("/account")
    requests = [line for line in lines if line["event"] == "request"]
    assert [(line["path"], line["status"]) for line in requests] == [
        ("/api/v1/me", 200),
        ("/account", 200),
    ]
    assert requests[0]["user_id"] == admin.id
    assert answer.status_code == 200
    text = json.dumps(lines)
    for secret in ("swordfish", client.headers["authorization"][7:]):
        assert secret not in text
    assert browser.cookies[SESSION_COOKIE] not in text


def test_static_files_stay_in_their_folder(anonymous: TestClient) -> None:
    """Neither `..` in any spelling nor hidden files nor folders are served."""
    for path in (
        "/static/../pyproject.toml",
        "/static/..%2fpyproject.toml",
        "/static/%2e%2e/%2e%2e/pyproject.toml",
        "/static/..%5cpyproject.toml",
        "/static//etc/passwd",
        "/static/.vite/manifest.json",
        "/static/",
        "/static/assets",
    ):
        assert anonymous.get(path).status_code == 404, path


def test_a_built_file_is_kept_for_ever(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files with hashed names are public and immutable; before the build they are 404."""
    folder = tmp_path / "dist"
    (folder / "assets").mkdir(parents=True)
    (folder / "assets" / "main-1a2b.js").write_text("export {}")
    monkeypatch.setattr("app.statics.locate", lambda _name: folder)
    with TestClient(create_app(settings)) as anybody:
        answer = anybody.get("/static/assets/main-1a2b.js")
    assert answer.status_code == 200
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert answer.headers["x-content-type-options"] == "nosniff"

    def _missing(_name: str) -> Path:
        raise FileNotFoundError

    monkeypatch.setattr("app.statics.locate", _missing)
    with TestClient(create_app(settings)) as anybody:
        assert anybody.get("/static/assets/main-1a2b.js").status_code == 404
        assert anybody.get("/healthz").status_code == 200
