"""The web process dies between the key press and the answer; what was pressed is there once."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2
import pytest
import sqlalchemy as sa

from app.auth.access import Scope
from app.config import Settings
from app.db import Database
from app.tables.identity import User
from app.tables.reviews import Review
from app.tables.runs import Pose
from tests.factories import identity
from tests.factories.runs import Harbour, make_run

ROOT = Path(__file__).resolve().parents[3]


@contextmanager
def serving(settings: Settings, port: int) -> Iterator[subprocess.Popen[bytes]]:
    """Serve the installation until it answers, and on; killed without mercy at the end."""
    process = subprocess.Popen(
        [str(Path(sys.executable).with_name("quaymark")), "serve", "--port", str(port)],
        cwd=ROOT,
        env=os.environ
        | {
            "QUAYMARK_DATA_DIR": str(settings.data_dir),
            "QUAYMARK_DATABASE_URL": settings.database_url,
            "QUAYMARK_STORAGE_URL": settings.storage_url,
        },
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        for _ in range(600):
            try:
                if httpx2.get(f"http://127.0.0.1:{port}/healthz").status_code == 200:
                    break
            except httpx2.TransportError:
                time.sleep(0.1)
        else:
            raise TimeoutError("the web process did not come up")
        yield process
    finally:
        process.kill()
        process.wait()


def send(port: int, token: str, pose_id: int, key: str) -> socket.socket:
    """Send a grade and wait for no answer."""
    body = b'{"grade":"ok"}'
    line = socket.create_connection(("127.0.0.1", port))
    line.sendall(
        f"POST /api/v1/poses/{pose_id}/reviews HTTP/1.1\r\nHost: 127.0.0.1\r\n"
        f"Authorization: Bearer {token}\r\nIdempotency-Key: {key}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode()
        + body
    )
    return line


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # a server takes its time
@pytest.mark.slow
def test_a_grade_whose_answer_was_lost_is_there_once(
    database: Database, settings: Settings, harbour: Harbour, admin: User
) -> None:
    """After a kill at any moment the same request with the same key leaves one verdict each."""
    with database.writing() as session:
        make_run(session, harbour, [2])
        ids = list(session.scalars(sa.select(Pose.id).order_by(Pose.id)))
        token = identity.make_token(session, admin, tuple(Scope))
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port = listener.getsockname()[1]
    with serving(settings, port) as process:
        with send(port, token, ids[0], "stored"):
            while not _reviews(database):
                time.sleep(0.005)
        with send(port, token, ids[1], "perhaps"):
            process.kill()
            process.wait()
    headers = {"Authorization": f"Bearer {token}"}
    with serving(settings, port), httpx2.Client(headers=headers) as client:
        for pose_id, key in zip(ids, ("stored", "perhaps"), strict=True):
            answer = client.post(
                f"http://127.0.0.1:{port}/api/v1/poses/{pose_id}/reviews",
                content=b'{"grade":"ok"}',
                headers={"Idempotency-Key": key, "Content-Type": "application/json"},
            )
            assert answer.status_code == 201, answer.text
            if key == "stored":
                assert answer.headers["idempotency-replayed"] == "true"
    assert sorted(_reviews(database)) == ids


def _reviews(database: Database) -> list[int]:
    """Return the poses of all reviews that are stored, standing or not."""
    with database.reading() as session:
        return list(session.scalars(sa.select(Review.pose_id)))
