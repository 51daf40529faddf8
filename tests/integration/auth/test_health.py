"""The two questions an orchestrator asks, and the figures a monitor reads."""

from pathlib import Path

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app import health
from app.config import Settings
from app.db import Database
from app.main import create_app
from app.tables.operation import WorkerHeartbeat


def test_alive_without_signing_in(anonymous: TestClient) -> None:
    """Liveness is answered to anybody."""
    assert anonymous.get("/healthz").json() == {"status": "ok"}


def test_ready_only_with_a_worker(
    anonymous: TestClient, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Readiness needs the database and a worker that was seen lately."""
    before = anonymous.get("/readyz")
    assert before.status_code == 503
    others = {"database": True, "storage": True, "migrations": True}
    assert before.json() == {"status": "not ready", "worker": False, **others}
    with database.writing() as session:
        session.add(WorkerHeartbeat(executor_id="w1", host="h", pid=1, code_version="1"))
    monkeypatch.setattr(health, "HOLDS_FOR_S", 0.0)
    after = anonymous.get("/readyz")
    assert after.status_code == 200
    assert after.json() == {"status": "ok", "worker": True, **others}


def test_not_ready_where_nothing_can_be_stored(
    anonymous: TestClient,
    settings: Settings,
    monkeypatch: pytest.MonkeyPatch,
    database: Database,
) -> None:
    """A store that takes no file and a database at another revision are each told."""
    monkeypatch.setattr(health, "HOLDS_FOR_S", 0.0)
    files = Path(settings.storage_url)
    files.mkdir(parents=True, exist_ok=True)
    (files / "derived").write_text("in the way of a folder")
    with database.writing() as session:
        session.execute(sa.text("UPDATE alembic_version SET version_num = '0001'"))
    told = anonymous.get("/readyz")
    assert told.status_code == 503
    assert (told.json()["storage"], told.json()["migrations"]) == (False, False)
    assert told.json()["database"] is True


def test_metrics_are_hidden_from_strangers(anonymous: TestClient) -> None:
    """An address that is not on the list gets the answer of an unknown page."""
    assert anonymous.get("/metrics").status_code == 404


@pytest.mark.parametrize("choice", ["address", "token"])
def test_metrics_for_the_monitor(settings: Settings, choice: str) -> None:
    """An allow-listed address or the metrics token gets the figures."""
    chosen = {
        "address": {"metrics_allowed_addresses": ["testclient"]},
        "token": {"metrics_token": "a-token-of-the-monitor"},
    }[choice]
    app = create_app(Settings(**(settings.model_dump() | chosen)))
    with TestClient(app) as monitor:
        answer = monitor.get("/metrics", headers={"Authorization": "Bearer a-token-of-the-monitor"})
    assert answer.status_code == 200
    assert "quaymark_workers 0.0" in answer.text
    for figure in ("database_bytes", "disk_free_bytes", "requests_total"):
        assert f"\nquaymark_{figure}" in answer.text
