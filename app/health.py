"""Whether the process lives, whether it can do its work, and figures for a monitor.

`/healthz` asks nothing of anybody. `/readyz` tries what the application needs: it writes to the
database and to the store, compares the migrations and looks for a worker seen lately; what it found
holds for two seconds, so that asking often costs nothing. `/metrics` is for a monitor on an
allow-listed address or with the metrics token.
"""

import hmac
import threading
import time
from datetime import timedelta

import sqlalchemy as sa
import structlog
from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, REGISTRY, Gauge, generate_latest
from pydantic import BaseModel
from sqlalchemy.exc import OperationalError, SQLAlchemyError

from app import schema
from app.auth.access import public
from app.auth.authentication import bearer_of
from app.config import Settings
from app.db import Database, now
from app.dependencies import DatabaseDep, SettingsDep, StorageDep
from app.disk_room import rooms
from app.errors import AppError, NotFound
from app.feeds import metrics as feeds
from app.job_tables import count_unended
from app.keeping.repository import findings
from app.operation import repository
from app.storage import Storage

WORKER_SEEN_WITHIN = timedelta(seconds=15)
HOLDS_FOR_S = 2.0
router = APIRouter(tags=["health"], dependencies=[Depends(public)])
_log = structlog.get_logger("quaymark.health")
_workers = Gauge("quaymark_workers", "Workers whose heartbeat is fresh")
_heartbeat_age = Gauge(
    "quaymark_worker_heartbeat_age_seconds", "Age of each worker's heartbeat", ["worker"]
)
_jobs = Gauge("quaymark_jobs", "Jobs that have not ended", ["queue", "status"])
_files_not_whole = Gauge("quaymark_files_not_whole", "Stored files found missing or damaged")
_database_bytes = Gauge("quaymark_database_bytes", "Size of the database")
_disk_free_bytes = Gauge("quaymark_disk_free_bytes", "Room left for files", ["folder"])


class Liveness(BaseModel):
    """The process answers."""

    status: str = "ok"


class Readiness(BaseModel):
    """What the application needs for its work, and whether each is there."""

    status: str
    database: bool
    storage: bool
    migrations: bool
    worker: bool


class Prober:
    """Tries what is needed, one caller at a time; what it found holds for a moment."""

    def __init__(self, database: Database, storage: Storage) -> None:
        self._database = database
        self._storage = storage
        self._lock = threading.Lock()
        self._found: Readiness | None = None
        self._found_at_s = 0.0

    def readiness(self) -> Readiness:
        """Return what was found just now, or up to `HOLDS_FOR_S` ago."""
        with self._lock:
            if self._found is None or time.monotonic() - self._found_at_s > HOLDS_FOR_S:
                self._found, self._found_at_s = self._probe(), time.monotonic()
            return self._found

    def _probe(self) -> Readiness:
        parts = {
            "database": _is_writable(self._database),
            "storage": _takes_files(self._storage),
            "migrations": _is_at_head(self._database),
            "worker": bool(_count_fresh_workers(self._database)),
        }
        ready = all(parts.values())
        return Readiness(status="ok" if ready else "not ready", **parts)


@router.get("/healthz")
async def healthz() -> Liveness:
    """Answer as long as the process lives; no thread is waited for."""
    return Liveness()


@router.get("/readyz", responses={503: {"model": Readiness}})
async def readyz(request: Request, response: Response) -> Readiness:
    """Answer 200 when database and store take writes and a worker was seen lately, else 503."""
    prober: Prober = request.app.state.prober
    # In a thread of its own: those of ordinary requests may all be busy.
    ready = await to_thread.run_sync(prober.readiness, limiter=CapacityLimiter(1))
    response.status_code = 200 if ready.status == "ok" else 503
    response.headers["Cache-Control"] = "no-store"
    return ready


@router.get("/metrics", include_in_schema=False)
def metrics(
    request: Request, settings: SettingsDep, database: DatabaseDep, storage: StorageDep
) -> Response:
    """Give the figures in the Prometheus text format; 404 to strangers."""
    if not _may_see_metrics(request, settings):
        raise NotFound("metrics are for allow-listed addresses and the metrics token")
    _workers.set(_count_fresh_workers(database) or 0)
    _measure_database(database)
    _measure_disks(settings, storage)
    return Response(generate_latest(REGISTRY), media_type=CONTENT_TYPE_LATEST)


def _measure_database(database: Database) -> None:
    _heartbeat_age.clear()
    _jobs.clear()
    try:
        with database.reading() as session:
            moment = now()
            for worker, seen_at in repository.heartbeats(session):
                _heartbeat_age.labels(worker).set((moment - seen_at).total_seconds())
            for (queue, status), count in count_unended(session.connection()).items():
                _jobs.labels(queue, status.lower()).set(count)
            _files_not_whole.set(len(findings(session)))
            _database_bytes.set(repository.database_bytes(session))
            feeds.observe(session)
    except SQLAlchemyError as error:
        _log.warning("figures of the database not read", error=str(error).splitlines()[0])


def _measure_disks(settings: Settings, storage: Storage) -> None:
    for name, room in rooms(settings, storage).items():
        _disk_free_bytes.labels(name).set(room.free_bytes)


def _is_writable(database: Database) -> bool:
    """Whether a write is committed; on SQLite a writer at work proves it too."""
    try:
        with database.engine.connect() as connection:
            if database.is_sqlite:
                connection.exec_driver_sql("PRAGMA busy_timeout = 1000")
            try:
                return _write(connection, is_sqlite=database.is_sqlite)
            finally:
                connection.invalidate()  # with its short patience
    except SQLAlchemyError as error:
        _log.warning("the database takes no writes", error=str(error).splitlines()[0])
        return False


def _write(connection: sa.Connection, *, is_sqlite: bool) -> bool:
    if not is_sqlite:
        # A transaction with a number of its own is written down; a standby refuses to give one.
        connection.execute(sa.select(sa.func.pg_current_xact_id()))
        connection.commit()
        return True
    try:
        version = connection.exec_driver_sql("PRAGMA user_version").scalar_one()
        connection.exec_driver_sql(f"PRAGMA user_version = {int(version)}")
        connection.commit()
    except OperationalError as error:
        if "locked" not in str(error.orig):
            raise
    return True


def _takes_files(storage: Storage) -> bool:
    try:
        storage.probe()
    except (AppError, OSError) as error:
        _log.warning("the store takes no files", error=str(error))
        return False
    return True


def _is_at_head(database: Database) -> bool:
    try:
        return schema.current_revision(database) == schema.head_revision()
    except SQLAlchemyError:
        return False


def _count_fresh_workers(database: Database) -> int | None:
    """Return how many workers were seen lately; None when the database does not answer."""
    try:
        with database.reading() as session:
            return repository.count_workers_seen(session, since=now() - WORKER_SEEN_WITHIN)
    except SQLAlchemyError:
        return None


def _may_see_metrics(request: Request, settings: Settings) -> bool:
    token = settings.metrics_token.get_secret_value()
    given = bearer_of(request.headers)
    if token and given and hmac.compare_digest(token.encode(), given.encode()):
        return True
    address = request.client.host if request.client else ""
    return address in settings.metrics_allowed_addresses
