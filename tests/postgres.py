"""A real Postgres for the tests: a throw-away cluster, started here and gone afterwards.

Postgres refuses to run as root, so root starts it as `nobody`. Nothing in it is worth keeping,
hence no fsync. Should the test process be killed, the kernel ends the server with it.
"""

import os
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Self

import psycopg

SERVER_BINARIES = Path("/usr/lib/postgresql")
OWNER = "quaymark"
START_WITHIN_S = 60.0
SETTINGS = {
    "fsync": "off",
    "synchronous_commit": "off",
    "full_page_writes": "off",
    "max_connections": "200",
    "shared_buffers": "64MB",
    "listen_addresses": "127.0.0.1",
}


class PostgresCluster:
    """A running server with a data folder of its own; a context manager."""

    def __init__(self) -> None:
        self._binaries = find_server_binaries()
        self._folder = Path(tempfile.mkdtemp(prefix="quaymark-postgres-"))
        self._port = _free_port()
        self._server: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        """Make the cluster and wait until it answers."""
        if os.geteuid() == 0:
            shutil.chown(self._folder, "nobody", "nogroup")
        data = self._folder / "data"
        self._run("initdb", "-D", str(data), "-U", OWNER, "-A", "trust", "-E", "UTF8", "--no-sync")
        options = [f"-c{name}={value}" for name, value in SETTINGS.items()]
        with (self._folder / "log").open("wb") as log:
            self._server = subprocess.Popen(
                [
                    *_as_nobody(),
                    str(self._binaries / "postgres"),
                    *("-D", str(data), "-p", str(self._port), "-k", str(self._folder)),
                    *options,
                ],
                stdout=log,
                stderr=log,
                cwd=self._folder,
            )
        self._wait()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the server and remove its folder."""
        if self._server is not None:
            self._server.terminate()
            try:
                self._server.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self._server.kill()
                self._server.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def url(self, name: str) -> str:
        """Return the address of a database, as settings take it."""
        return f"postgresql+psycopg://{OWNER}@127.0.0.1:{self._port}/{name}"

    def create(self, name: str, template: str = "template1") -> str:
        """Make a database, as a copy of a template nobody is connected to; return its address."""
        self._administer(f'CREATE DATABASE "{name}" TEMPLATE "{template}" STRATEGY FILE_COPY')
        return self.url(name)

    def drop(self, name: str) -> None:
        """Remove a database, whoever is connected."""
        self._administer(f'DROP DATABASE IF EXISTS "{name}" WITH (FORCE)')

    def _administer(self, statement: str) -> None:
        with psycopg.connect(self._address(), autocommit=True) as connection:
            connection.execute(statement.encode())

    def _address(self) -> str:
        return f"host=127.0.0.1 port={self._port} user={OWNER} dbname=postgres"

    def _run(self, program: str, *arguments: str) -> None:
        subprocess.run(
            [*_as_nobody(), str(self._binaries / program), *arguments],
            check=True,
            stdout=subprocess.DEVNULL,
            cwd=self._folder,
        )

    def _wait(self) -> None:
        give_up_at_s = time.monotonic() + START_WITHIN_S
        while time.monotonic() < give_up_at_s:
            try:
                psycopg.connect(self._address()).close()
            except psycopg.OperationalError:
                if self._server is not None and self._server.poll() is not None:
                    break
                time.sleep(0.05)
            else:
                return
        raise RuntimeError((self._folder / "log").read_text())


def find_server_binaries() -> Path:
    """Return the folder of the newest Postgres server here; where there is none, apt installs it.

    Raises FileNotFoundError where apt may not.
    """
    if not _installed_versions():
        prefix = [] if os.geteuid() == 0 else ["sudo", "-n"]
        for arguments in (["update", "-q"], ["install", "-qy", "postgresql"]):
            subprocess.run([*prefix, "apt-get", *arguments], check=False)
    versions = _installed_versions()
    if not versions:
        raise FileNotFoundError(
            "the tests need a Postgres server; install it with: sudo apt-get install postgresql"
        )
    return versions[-1] / "bin"


def _installed_versions() -> list[Path]:
    found = [folder.parents[1] for folder in SERVER_BINARIES.glob("*/bin/initdb")]
    return sorted(found, key=lambda folder: float(folder.name))


def _as_nobody() -> list[str]:
    # The kernel forgets the signal of a parent's death when the user changes: two steps.
    dies_with_us = ["setpriv", "--pdeathsig", "QUIT"]
    if os.geteuid() != 0:
        return dies_with_us
    nobody = ["setpriv", "--reuid", "nobody", "--regid", "nogroup", "--clear-groups"]
    return [*nobody, *dies_with_us]


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
