"""A real web process for tests: started, waited for, frozen, or killed without mercy."""

import os
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

from app.config import Settings
from tests.worker_process import ROOT, wait_until


class ServerProcess:
    """`quaymark serve` on an installation's database and files; restarted, it keeps its port."""

    def __init__(self, settings: Settings, log: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = int(probe.getsockname()[1])
        self._settings = settings
        self._log = log
        self.url = f"http://127.0.0.1:{self._port}"
        self.start()

    def start(self) -> None:
        """Start, and wait until it answers."""
        with self._log.open("ab") as target:
            self._process = subprocess.Popen(
                [Path(sys.executable).with_name("quaymark"), "serve", f"--port={self._port}"],
                cwd=ROOT,
                env=os.environ
                | {
                    "QUAYMARK_DATA_DIR": str(self._settings.data_dir),
                    "QUAYMARK_DATABASE_URL": self._settings.database_url,
                    "QUAYMARK_STORAGE_URL": self._settings.storage_url,
                },
                stdout=target,
                stderr=subprocess.STDOUT,
            )
        wait_until(self._answers, what="the server")

    def freeze(self) -> None:
        """Let it hear nothing more: what is sent from now on waits for an answer."""
        self._process.send_signal(signal.SIGSTOP)

    def kill(self) -> None:
        """End the process at once, as a power cut would."""
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()

    def ask_to_stop(self) -> None:
        """Ask the process to end, and go on."""
        self._process.terminate()

    @property
    def code(self) -> int | None:
        """Return the exit code, None while the process lives."""
        return self._process.poll()

    def stop(self) -> None:
        """Ask the process to end, and wait."""
        if self._process.poll() is None:
            self._process.terminate()
            self._process.wait(30)

    def _answers(self) -> bool:
        try:
            with urllib.request.urlopen(f"{self.url}/healthz", timeout=2) as answer:  # noqa: S310  our own address
                return answer.status == 200
        except OSError:
            return False
