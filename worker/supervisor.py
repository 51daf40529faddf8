"""Several worker processes side by side, each replaced when it dies.

One process a core, because a detector and Python's lock leave little to threads. A child that dies
again and again is given more and more time between its starts, so that a broken installation does
not spend its cores on starting workers.
"""

import os
import subprocess
import sys
import threading
import time

import structlog

from app.config import Settings
from app.db import Database
from worker.main import STOP_GRACE_S, stop_on_signals, why_unusable

log = structlog.get_logger()
LOOK_EVERY_S = 0.5
LONGEST_PAUSE_S = 30.0
LIVED_WELL_S = 60.0


class Child:
    """One worker process and its successors."""

    def __init__(self) -> None:
        self._pause_s = 1.0
        self._start_at = 0.0
        self._process: subprocess.Popen[bytes] | None = None

    def look_after(self) -> None:
        """Start the process when there is none and its time has come."""
        if self._process is not None and self._process.poll() is not None:
            self._mourn(self._process)
            self._process = None
        if self._process is None and time.monotonic() >= self._start_at:
            self._start()

    def _start(self) -> None:
        command = [sys.executable, "-m", "worker", "--concurrency=1", f"--parent-pid={os.getpid()}"]
        self._process = subprocess.Popen(command)  # noqa: S603  our own module
        self._started_at = time.monotonic()

    def _mourn(self, process: subprocess.Popen[bytes]) -> None:
        log.warning("worker died", pid=process.pid, code=process.returncode)
        moment = time.monotonic()
        lived_well = moment - self._started_at >= LIVED_WELL_S
        self._pause_s = 1.0 if lived_well else min(2 * self._pause_s, LONGEST_PAUSE_S)
        self._start_at = moment + self._pause_s / 2

    def terminate(self) -> None:
        """Ask the process to end."""
        if self._process is not None:
            self._process.terminate()

    def wait(self) -> None:
        """Wait for the process to end; end it when it takes too long."""
        if self._process is None:
            return
        try:
            self._process.wait(STOP_GRACE_S + 5)
        except subprocess.TimeoutExpired:
            self._process.kill()


def supervise(settings: Settings, count: int, parent_pid: int) -> int:
    """Keep `count` worker processes until told to stop. Returns an exit code."""
    stop = threading.Event()
    stop_on_signals(stop)
    database = Database(settings.database_url)
    reason = why_unusable(database, settings)
    database.dispose()
    if reason:
        log.error("worker refuses to start", reason=reason)
        return 1
    children = [Child() for _ in range(count)]
    while True:
        for child in children:
            child.look_after()
        if stop.wait(LOOK_EVERY_S) or (parent_pid and os.getppid() != parent_pid):
            break
    for child in children:
        child.terminate()
    for child in children:
        child.wait()
    return 0
