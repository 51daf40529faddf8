"""Watching a run over server-sent events."""

import json
import threading
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database, now
from app.runs import router
from app.tables.identity import ApiToken, LoginSession
from app.tables.runs import Run, RunImage, RunStatus
from tests.factories.runs import make_harbour, make_run
from tests.worker_process import wait_until


@pytest.fixture(autouse=True)
def _short_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look at the run more often than people need."""
    monkeypatch.setattr(router, "EVENT_INTERVAL_S", 0.02)


def events_in(text: str) -> list[tuple[str, dict[str, Any]]]:
    """Return (event, data) of a finished stream, comments left out."""
    blocks = [block.splitlines() for block in text.split("\n\n") if block.startswith("event: ")]
    return [
        (name.removeprefix("event: "), json.loads(data.removeprefix("data: ")))
        for name, data in blocks
    ]


def looks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that grows with each look at the run."""
    reads: list[int] = []
    progress = router._progress  # noqa: SLF001  counted, to know that the watcher has looked

    def counted(*arguments: Any) -> Any:
        found = progress(*arguments)
        reads.append(1)
        return found

    monkeypatch.setattr(router, "_progress", counted)
    return reads


def test_an_ended_run_is_told_at_once(client: TestClient, database: Database) -> None:
    """The stream of an ended run is its last progress and the end, in a form nobody stores."""
    with database.writing() as session:
        run = make_run(session, make_harbour(session, 2), [1, 0], status=RunStatus.FAILED)
    answer = client.get(f"/api/v1/runs/{run.id}/events")
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert answer.headers["cache-control"] == "no-store"
    events = events_in(answer.text)
    assert [name for name, _ in events] == ["progress", "end"]
    assert events[1][1]["status"] == "failed"
    assert (events[1][1]["images_done"], events[1][1]["poses"]) == (2, 1)


def test_a_stream_follows_the_run_to_its_end(
    client: TestClient, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each change is told once, silence is filled with comments, and the end closes the stream."""
    monkeypatch.setattr(router, "KEEP_ALIVE_S", 0.05)
    with database.writing() as session:
        harbour = make_harbour(session, 2)
        run = make_run(session, harbour, status=RunStatus.QUEUED)
    told: list[str] = []

    def watch() -> None:
        told.append(client.get(f"/api/v1/runs/{run.id}/events").text)

    reads = looks(monkeypatch)
    watcher = threading.Thread(target=watch)
    watcher.start()
    for change in (
        {"status": RunStatus.RUNNING, "started_at": now()},
        {"name": "a change nobody is told of"},
        {"status": RunStatus.SUCCEEDED, "finished_at": now()},
    ):
        seen = len(reads)
        wait_until(lambda seen=seen: len(reads) > seen + 5, what="the watcher's look")
        with database.writing() as session:
            session.execute(sa.update(Run).where(Run.id == run.id).values(**change))
            if change.get("status") is RunStatus.RUNNING:
                session.execute(sa.update(RunImage).values(done_at=now()))
    watcher.join(30)
    events = events_in(told[0])
    assert [(name, data["status"], data["images_done"]) for name, data in events] == [
        ("progress", "queued", 0),
        ("progress", "running", 2),
        ("progress", "succeeded", 2),
        ("end", "succeeded", 2),
    ]
    assert ": still here\n\n" in told[0]


def test_a_stream_ends_with_the_rights_of_who_watches(
    client: TestClient, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who was removed or signed out while watching is told no more."""
    with database.writing() as session:
        run = make_run(session, make_harbour(session), status=RunStatus.QUEUED)
    told: list[str] = []
    reads = looks(monkeypatch)
    watcher = threading.Thread(
        target=lambda: told.append(client.get(f"/api/v1/runs/{run.id}/events").text)
    )
    watcher.start()
    wait_until(lambda: bool(reads), what="the watcher's look")
    with database.writing() as session:
        session.execute(sa.delete(ApiToken))
        session.execute(sa.delete(LoginSession))
    watcher.join(30)
    assert [name for name, _ in events_in(told[0])] == ["progress"]
