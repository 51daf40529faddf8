"""The `quaymark` command for tests: each call in a process of its own, quickly.

A server process imports the application once and forks for every call, so that a test sees what a
shell would see (standard output, errors, the exit code) without waiting for a fresh interpreter.
"""

import fcntl
import multiprocessing
import os
import pty
import sys
import tempfile
import termios
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.context import ForkServerContext
from pathlib import Path

WITHIN_S = 120
PRELOADED = ["app.cli", "app.installation", "app.main"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a command left behind."""

    code: int | None
    out: str
    error: str


def run_quaymark(
    *arguments: str,
    environment: Mapping[str, str],
    stdin: str = "",
    terminal: bool = False,
) -> Outcome:
    """Run `quaymark` with arguments; with `terminal`, standard input is one, else a file."""
    context: ForkServerContext = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    with tempfile.TemporaryDirectory() as folder:
        out, error, typed = (Path(folder) / name for name in ("out", "error", "typed"))
        typed.write_text(stdin)
        process = context.Process(
            target=_command,
            args=(arguments, dict(environment), typed, out, error),
            kwargs={"terminal": terminal},
        )
        process.start()
        process.join(WITHIN_S)
        if process.is_alive():
            process.kill()
            process.join()
        return Outcome(process.exitcode, out.read_text(), error.read_text())


def _command(
    arguments: tuple[str, ...],
    environment: dict[str, str],
    typed: Path,
    out: Path,
    error: Path,
    *,
    terminal: bool,
) -> None:
    os.setsid()  # whatever asks the controlling terminal for a password finds none
    source = os.open(typed, os.O_RDONLY)
    if terminal:
        source = _typing_terminal(typed.read_bytes().splitlines(keepends=True))
    for number, descriptor in (
        (0, source),
        (1, os.open(out, os.O_WRONLY | os.O_CREAT)),
        (2, os.open(error, os.O_WRONLY | os.O_CREAT)),
    ):
        os.dup2(descriptor, number)
    sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w")
    for name in [name for name in os.environ if name.startswith("QUAYMARK_")]:
        del os.environ[name]
    os.environ |= environment
    sys.argv = ["quaymark", *arguments]

    from app.cli import main  # noqa: PLC0415  loaded by the server process, not by pytest

    main()


def _typing_terminal(lines: list[bytes]) -> int:
    """Make a terminal ours, at which each line is typed once its prompt has come."""
    keyboard, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)

    def type_lines() -> None:
        for line in lines:
            while not os.read(keyboard, 1024).endswith(b" "):
                pass
            os.write(keyboard, line)

    threading.Thread(target=type_lines, daemon=True).start()
    return terminal
