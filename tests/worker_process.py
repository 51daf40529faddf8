"""A real worker process for tests: started, waited for, stopped, or killed without mercy."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from app.config import Settings

ROOT = Path(__file__).resolve().parents[1]


class WorkerProcess:
    """`python -m worker` on an installation's database and files; its log goes to a file."""

    def __init__(self, settings: Settings, log: Path, **environment: str) -> None:
        self.log = log
        with log.open("ab") as target:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "worker", f"--parent-pid={os.getpid()}"],
                cwd=ROOT,
                env=os.environ
                | {
                    "QUAYMARK_DATA_DIR": str(settings.data_dir),
                    "QUAYMARK_DATABASE_URL": settings.database_url,
                    "QUAYMARK_STORAGE_URL": settings.storage_url,
                    "QUAYMARK_DETECTOR_THREADS": "1",
                }
                | environment,
                stdout=target,
                stderr=subprocess.STDOUT,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def kill(self) -> None:
        """End the process at once, as a power cut would."""
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()

    def stop(self) -> None:
        """Ask the process to end, and wait."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(20)
            except subprocess.TimeoutExpired:
                self.kill()

    @property
    def code(self) -> int | None:
        """Return the exit code, None while the process lives."""
        return self._process.poll()


def wait_until(
    condition: Callable[[], bool], *, within_s: float = 60, what: str = "the condition"
) -> float:
    """Wait for a condition; returns the seconds it took. Fails the test when it never comes."""
    begun = time.monotonic()
    while not condition():
        if time.monotonic() - begun > within_s:
            raise AssertionError(f"{what} did not come within {within_s} s")
        time.sleep(0.05)
    return time.monotonic() - begun
