"""A worker's life: take jobs, say that it lives, take over from those that do not.

The job engine resumes a job only when told to. So every worker writes a heartbeat and looks for
jobs under way whose worker fell silent; it counts the attempt in the database, which makes one
worker of many do it, and puts the job back into its queue. A job that killed its worker too often
is given up with a reason instead of killing the next.
"""

import os
import signal
import socket
import subprocess
import sys
import threading
import uuid
from types import FrameType

import structlog

from app import schema
from app.config import Settings
from app.db import Database
from app.jobs import JobRunner
from worker.presence import Presence
from worker.tasks import register_tasks

log = structlog.get_logger()
STOP_GRACE_S = 10.0


def work(settings: Settings, parent_pid: int) -> int:
    """Work until SIGTERM or SIGINT, or until the parent process is gone. Returns an exit code."""
    executor_id = f"{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex[:8]}"
    stop = threading.Event()
    _stop_on_signals(stop)
    database = Database(settings.database_url)
    current, head = schema.current_revision(database), schema.head_revision()
    if current != head:
        log.error("run `quaymark db upgrade` first", database=current, needed=head)
        return 1
    runner = JobRunner(settings.database_url, executor_id, concurrency=1)
    give_up = register_tasks(runner, database, settings)
    presence = Presence(database, runner, settings, executor_id, give_up)
    presence.announce()
    runner.launch()
    log.info("worker ready", executor_id=executor_id)
    presence.keep(stop, parent_pid)
    presence.withdraw()
    log.info("worker stops", executor_id=executor_id)
    _leave_in(STOP_GRACE_S)
    runner.destroy()
    # A step still computing in a thread must not keep the process: its job is resumed elsewhere.
    os._exit(0)


def supervise(count: int, parent_pid: int) -> int:
    """Keep `count` worker processes, replacing one that dies, until told to stop."""
    stop = threading.Event()
    _stop_on_signals(stop)
    command = [sys.executable, "-m", "worker", "--concurrency=1", f"--parent-pid={os.getpid()}"]
    children = [subprocess.Popen(command) for _ in range(count)]  # noqa: S603  our own module
    while not stop.wait(1.0) and not (parent_pid and os.getppid() != parent_pid):
        for index, child in enumerate(children):
            if child.poll() is not None:
                log.warning("worker died", pid=child.pid, code=child.returncode)
                children[index] = subprocess.Popen(command)  # noqa: S603  as above
    for child in children:
        child.terminate()
    for child in children:
        child.wait(STOP_GRACE_S + 5)
    return 0


def _stop_on_signals(stop: threading.Event) -> None:
    def _stop(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    signal.signal(signal.SIGTERM, _stop)
    signal.signal(signal.SIGINT, _stop)


def _leave_in(seconds: float) -> None:
    timer = threading.Timer(seconds, os._exit, (0,))
    timer.daemon = True
    timer.start()
