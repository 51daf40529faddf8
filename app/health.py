"""Whether the process lives, whether it can do its work, and figures for a monitor.

`/healthz` asks nothing of anybody; `/readyz` asks the database and looks for a worker that has been
seen lately; `/metrics` is for a monitor on an allow-listed address or with the metrics token.
"""

import hmac
from datetime import timedelta

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, REGISTRY, Gauge, generate_latest
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError

from app.auth.access import public
from app.auth.authentication import bearer_of
from app.config import Settings
from app.db import Database, now
from app.dependencies import DatabaseDep, SettingsDep
from app.errors import NotFound
from app.feeds import metrics as feeds
from app.operation.repository import count_workers_seen

WORKER_SEEN_WITHIN = timedelta(seconds=15)
router = APIRouter(tags=["health"], dependencies=[Depends(public)])
_workers = Gauge("quaymark_workers", "Workers whose heartbeat is fresh")


class Liveness(BaseModel):
    """The process answers."""

    status: str = "ok"


class Readiness(BaseModel):
    """What the application needs for its work, and whether each is there."""

    status: str
    database: bool
    worker: bool


@router.get("/healthz")
def healthz() -> Liveness:
    """Answer as long as the process lives."""
    return Liveness()


@router.get("/readyz", responses={503: {"model": Readiness}})
def readyz(database: DatabaseDep, response: Response) -> Readiness:
    """Answer 200 when the database answers and a worker was seen lately, else 503."""
    workers = _count_fresh_workers(database)
    ready = Readiness(
        status="ok" if workers else "not ready",
        database=workers is not None,
        worker=bool(workers),
    )
    response.status_code = 200 if workers else 503
    response.headers["Cache-Control"] = "no-store"
    return ready


@router.get("/metrics", include_in_schema=False)
def metrics(request: Request, settings: SettingsDep, database: DatabaseDep) -> Response:
    """Give the figures in the Prometheus text format; 404 to strangers."""
    if not _may_see_metrics(request, settings):
        raise NotFound("metrics are for allow-listed addresses and the metrics token")
    workers = _count_fresh_workers(database)
    _workers.set(workers or 0)
    if workers is not None:
        with database.reading() as session:
            feeds.observe(session)
    return Response(generate_latest(REGISTRY), media_type=CONTENT_TYPE_LATEST)


def _count_fresh_workers(database: Database) -> int | None:
    """Return how many workers were seen lately; None when the database does not answer."""
    try:
        with database.reading() as session:
            return count_workers_seen(session, since=now() - WORKER_SEEN_WITHIN)
    except SQLAlchemyError:
        return None


def _may_see_metrics(request: Request, settings: Settings) -> bool:
    token = settings.metrics_token.get_secret_value()
    given = bearer_of(request.headers)
    if token and given and hmac.compare_digest(token.encode(), given.encode()):
        return True
    address = request.client.host if request.client else ""
    return address in settings.metrics_allowed_addresses
