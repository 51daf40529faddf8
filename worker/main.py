"""A worker's life: take jobs, say that it lives, take over from those that do not.

The job engine resumes a job only when told to. So every worker writes a heartbeat and looks for
jobs under way whose worker fell silent; it counts the attempt in the database, which makes one
worker of many do it, and puts the job back into its queue. A job that killed its worker too often
is given up with a reason instead of killing the next.
"""

import os
import signal
import socket
import threading
import uuid
from types import FrameType

import structlog
from sqlalchemy.exc import OperationalError

from app import schema
from app.ais.service import tidy_up
from app.config import Settings
from app.db import Database
from app.errors import Conflict
from app.garbage import set_startup_aside
from app.jobs import JobRunner, reason_of
from worker.alarms import AlarmLoop
from worker.feeds import FeedLoops
from worker.inference.session import missing_providers
from worker.live.folders import FolderLoops
from worker.live.housekeeping import Housekeeping
from worker.live.standing import StandingLoops
from worker.loops import LoopKind, LoopSupervisor
from worker.presence import Presence
from worker.rehash import RehashLoop
from worker.tasks import register_tasks
from worker.webhooks import WebhookLoops

log = structlog.get_logger()
STOP_GRACE_S = 10.0
LOOP_GRACE_S = 5.0
# People wait for pages, nobody for the hundredth part of a run.
NICENESS = 10
EXECUTOR_ID_LENGTH = 64


def work(settings: Settings, parent_pid: int) -> int:
    """Work until SIGTERM or SIGINT, or until the parent process is gone. Returns an exit code."""
    stop = threading.Event()
    stop_on_signals(stop)
    database = Database(settings.database_url, idle_limit_s=settings.idle_limit_s)
    if reason := why_unusable(database, settings):
        log.error("worker refuses to start", reason=reason)
        return 1
    try:
        _take_jobs(settings, database, stop, parent_pid)
    except Exception:
        log.exception("worker broke")
        code = 1
    else:
        code = 0
    # A step still computing in a thread must not keep the process: its job is resumed elsewhere.
    os._exit(code)


def why_unusable(database: Database, settings: Settings) -> str | None:
    """Return why no worker can work with these, in one line; None when one can."""
    try:
        schema.refuse_other_version(database)
    except Conflict as error:
        return error.detail
    except OperationalError as error:
        return reason_of(error)
    return missing_providers(settings.detector_providers)


def stop_on_signals(stop: threading.Event) -> None:
    """Set an event at SIGTERM and SIGINT."""

    def _stop(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    signal.signal(signal.SIGTERM, _stop)
    signal.signal(signal.SIGINT, _stop)


def _take_jobs(
    settings: Settings, database: Database, stop: threading.Event, parent_pid: int
) -> None:
    os.nice(NICENESS)
    executor_id = f"{uuid.uuid4().hex[:8]}-{os.getpid()}-{socket.gethostname()}"
    executor_id = executor_id[:EXECUTOR_ID_LENGTH]
    runner = JobRunner(
        settings.database_url, executor_id, concurrency=1, idle_limit_s=settings.idle_limit_s
    )
    give_up = register_tasks(runner, database, settings)
    presence = Presence(database, runner, settings, executor_id, give_up)
    presence.announce()
    runner.launch()
    threading.Thread(target=tidy_up, args=(database,), daemon=True).start()
    loops = LoopSupervisor(database, settings, executor_id, loop_kinds(database, settings))
    loops.start()
    set_startup_aside()
    log.info("worker ready", executor_id=executor_id)
    presence.keep(stop, parent_pid)
    runner.leave()
    _leave_in(STOP_GRACE_S)
    log.info("worker stops", executor_id=executor_id)
    loops.stop(LOOP_GRACE_S)
    presence.withdraw()
    runner.destroy()


def loop_kinds(database: Database, settings: Settings) -> list[LoopKind]:
    """Return what workers do without an end, each thing in one of them at a time."""
    return [
        FeedLoops(database, settings),
        FolderLoops(database, settings),
        StandingLoops(database, settings),
        Housekeeping(database, settings),
        RehashLoop(database, settings),
        WebhookLoops(database, settings),
        AlarmLoop(database, settings),
    ]


def _leave_in(seconds: float) -> None:
    timer = threading.Timer(seconds, os._exit, (0,))
    timer.daemon = True
    timer.start()
