"""A real server asked for too much, and told to stop amid requests and open streams."""

import signal
import socket
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import sqlalchemy as sa
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.config import Settings
from app.db import POOL, Database
from app.tables.identity import Role
from app.tables.runs import Run, RunStatus
from app.tables.sites import Site
from tests.factories import identity
from tests.factories.world import make_world
from tests.server_process import ServerProcess
from tests.worker_process import wait_until

MOST = 60  # more than there are threads, and more threads than connections


class Caller:
    """An administrator's script, a connection a request."""

    def __init__(self, url: str, token: str) -> None:
        self._host = urlsplit(url).netloc
        self._token = token

    def open(self, method: str, path: str, *, announced_bytes: int = 0) -> HTTPConnection:
        """Begin a request whose body is still to come."""
        connection = HTTPConnection(self._host, timeout=60)
        connection.putrequest(method, path)
        connection.putheader("Authorization", f"Bearer {self._token}")
        connection.putheader("Content-Type", "application/json")
        connection.putheader("Content-Length", str(announced_bytes))
        connection.endheaders()
        return connection

    def get(self, path: str) -> HTTPResponse:
        """Ask and read the answer."""
        answer = self.open("GET", path).getresponse()
        answer.read()
        return answer


@pytest.fixture
def server(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[ServerProcess]:
    """Serve an installation that answers `MOST` requests at a time."""
    monkeypatch.setenv("QUAYMARK_MAX_REQUESTS", str(MOST))
    serving = ServerProcess(settings, tmp_path / "server.log")
    yield serving
    serving.stop()


@pytest.fixture
def run_id(database: Database) -> int:
    """Store a run that is under way, so that watching it does not end."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        session.get_one(Run, ids["run_id"]).status = RunStatus.RUNNING
    return ids["run_id"]


@pytest.fixture
def caller(server: ServerProcess, database: Database) -> Caller:
    """Give an administrator's script."""
    with database.writing() as session:
        token = identity.make_token(session, identity.make_user(session, Role.ADMIN))
    return Caller(server.url, token)


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # whose connections are few
def test_a_crowd_is_answered_refused_at_once_and_outlived(
    server: ServerProcess, caller: Caller, database: Database, run_id: int
) -> None:
    """As many as may are all answered; one more is 503 with Retry-After while health answers.

    Told to stop, the server ends its streams, finishes the request whose body is still coming, and
    leaves within its time; a request that was never finished has stored nothing.
    """
    answers: Counter[int] = Counter()

    def ask() -> None:
        answers[caller.get("/api/v1/audit-log?limit=1000").status] += 1

    crowd = [threading.Thread(target=ask) for _ in range(MOST)]
    for thread in crowd:
        thread.start()
    for thread in crowd:
        thread.join()
    assert answers == {200: MOST}

    held = [caller.open("POST", "/api/v1/sites", announced_bytes=500) for _ in range(MOST)]
    wait_until(lambda: caller.get("/api/v1/me").status == 503, what="the refusal")
    refused = caller.get("/api/v1/me")
    assert (refused.status, refused.getheader("Retry-After")) == (503, "2")
    assert refused.getheader("Content-Type") == "application/problem+json"
    assert [caller.get(path).status for path in ("/healthz", "/readyz")] == [200, 503]
    for connection in held[2:]:
        connection.close()
    wait_until(lambda: caller.get("/api/v1/me").status == 200, what="room again")

    stream = caller.open("GET", f"/api/v1/runs/{run_id}/events").getresponse()
    assert stream.readline().startswith(b"event: progress")
    server.ask_to_stop()
    assert b"event: end" not in stream.read()  # it ends, and not because the run has
    body = b'{"name": "Kiel", "origin": {"lat_deg": 54.3, "lon_deg": 10.1, "height_m": 40}}'
    held[0].send(body.ljust(500))
    assert held[0].getresponse().status == 201
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", urlsplit(server.url).port or 0), timeout=5)
    held[1].close()
    wait_until(lambda: server.code is not None, within_s=30, what="the end")
    assert server.code in {0, -signal.SIGTERM}
    with database.reading() as session:
        assert sorted(session.scalars(sa.select(Site.name))) == ["Elbe harbour", "Kiel"]


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_who_calls_is_known_while_every_connection_is_taken(
    client: TestClient, app: FastAPI
) -> None:
    """The event loop never waits for a connection that only it could set free."""
    database: Database = app.state.database
    assert client.get("/api/v1/me").status_code == 200  # the token's use is noted now
    with ExitStack() as taken:
        for _ in range(POOL["pool_size"] + POOL["max_overflow"]):
            taken.enter_context(database.engine.connect())
        assert client.get("/api/v1/no-such-thing").status_code == 404
