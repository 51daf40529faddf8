"""Jobs as administrators see them: listed, cancelled, tried again, each with a trace."""

from collections.abc import Callable, Iterator

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.jobs import JobClient, JobQueue
from app.tables.identity import AuditEntry, Role
from app.tables.runs import Run, RunStatus
from app.tables.webhooks import WebhookDelivery, WebhookEvent
from tests.factories.world import make_world
from tests.integration.conftest import MakeUser


@pytest.fixture
def run_id(database: Database) -> Iterator[int]:
    """Give a run whose job is queued as `job-1`."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        run = session.get_one(Run, ids["run_id"])
        run.workflow_id, run.status = "job-1", RunStatus.QUEUED
    jobs = JobClient(database.url)
    with database.writing() as session:
        jobs.enqueue(session, "run", ids["run_id"], queue=JobQueue.RUNS, job_id="job-1")
    yield ids["run_id"]
    jobs.destroy()


def status_of(database: Database, run_id: int) -> RunStatus:
    """Return where a run stands."""
    with database.reading() as session:
        return session.get_one(Run, run_id).status


def test_a_job_is_cancelled_and_tried_again(
    client: TestClient, database: Database, run_id: int
) -> None:
    """The run follows its job both ways, is told to webhooks, and both acts are audited."""
    (job,) = client.get("/api/v1/jobs").json()["items"]
    assert (job["id"], job["status"], job["arguments"]) == ("job-1", "queued", [run_id])
    too_soon = client.post("/api/v1/jobs/job-1/retry")
    assert too_soon.status_code == 409
    assert client.post("/api/v1/jobs/job-1/cancel").json()["status"] == "cancelled"
    assert status_of(database, run_id) is RunStatus.CANCELLED
    assert client.post("/api/v1/jobs/job-1/retry").json()["status"] == "queued"
    assert status_of(database, run_id) is RunStatus.QUEUED
    assert client.get("/api/v1/jobs/job-2").status_code == 404
    with database.reading() as session:
        acts = session.scalars(
            sa.select(AuditEntry.action).where(AuditEntry.entity == "job").order_by(AuditEntry.id)
        ).all()
        told = session.scalars(
            sa.select(WebhookDelivery).where(WebhookDelivery.event == WebhookEvent.RUN_FINISHED)
        ).all()
    assert acts == ["cancel", "retry"]
    assert [delivery.content["data"]["status"] for delivery in told] == ["cancelled"]


def test_the_page_of_jobs_is_for_administrators_of_all_sites(
    browser_of: Callable[..., TestClient], make_user: MakeUser, admin: object, run_id: int
) -> None:
    """The page shows the job with its button; an administrator of one site is refused."""
    shown = browser_of(admin).get("/admin/jobs").text
    assert "job-1" in shown
    assert "/admin/jobs/job-1/cancel" in shown
    other = browser_of(make_user(Role.ADMIN, 1))
    assert other.get("/admin/jobs").status_code == 403
    assert run_id
