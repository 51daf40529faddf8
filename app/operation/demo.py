"""The demo: from an empty folder to a graded pose, with nothing to prepare.

Web and worker are two processes, as in any installation; the worker belongs to this one and ends
with it, however it ends.
"""

import logging
import os
import secrets
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import typer

from app import schema
from app.auth.users import MembershipSpec, create_user
from app.config import Settings, get_settings
from app.db import Database
from app.errors import AppError
from app.evaluation.service import against_truth
from app.guideline import practice
from app.jobs import JobClient
from app.logs import configure_logs
from app.operation import harbour_repository, harbour_site
from app.operation.harbour_site import HarbourChoice
from app.operation.serving import listening_socket, make_server
from app.runs import service as runs
from app.storage import Storage
from app.tables.detection import ModelStatus
from app.tables.identity import Role
from app.tables.runs import RunStatus

PEOPLE = (("admin@quaymark.example", Role.ADMIN), ("reviewer@quaymark.example", Role.REVIEWER))
READY_WITHIN_S = 60


def run_demo(host: str, port: int, choice: HarbourChoice, *, leave: bool) -> None:
    """Set up, run the pipeline on the demo harbour, and serve it; or end after the summary."""
    signal.signal(signal.SIGTERM, _end)
    configure_logs(logging.WARNING)
    settings = get_settings()
    listener = None if leave else listening_socket(host, port)
    database, jobs = Database(settings.database_url), JobClient(settings.database_url)
    schema.upgrade(database)
    passwords = _make_people(database)
    with _worker(settings):
        storage = Storage(settings.storage_url)
        detector = harbour_site.add_detector(database, storage, jobs)  # tried while we render
        place = harbour_site.find_complete(database, choice) or harbour_site.install(
            database, storage, settings, choice, _tell
        )
        _wait_for_detector(database, detector)
        run_ids = harbour_site.start_missing_runs(database, jobs, place, detector)
        summary = _finish_runs(database, run_ids) + _against_truth(database, run_ids)
        summary += _what_to_do(database, run_ids)
        _tell("", fleeting=True)
        typer.echo("\n".join(summary + _how_to_sign_in(passwords)))
        jobs.destroy()
        database.dispose()
        if listener is None:
            return
        address = f"http://{host if ':' not in host else f'[{host}]'}:{listener.getsockname()[1]}"
        threading.Thread(target=_announce, args=(address,), daemon=True).start()
        make_server(settings, quiet=True).run(sockets=[listener])


def _end(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _tell(text: str, *, fleeting: bool = False) -> None:
    """Show what is going on: one changing line on a terminal, plain lines elsewhere."""
    if sys.stdout.isatty():
        sys.stdout.write(f"\r\x1b[K{text}")
        sys.stdout.flush()
    elif text and not fleeting:
        typer.echo(text)


def _make_people(database: Database) -> dict[str, str]:
    """Add an administrator and a reviewer where nobody is; returns their passwords."""
    with database.reading() as session:
        if harbour_repository.anybody(session):
            return {}
    passwords = {email: secrets.token_urlsafe(12) for email, _ in PEOPLE}
    with database.writing() as session:
        for email, role in PEOPLE:
            create_user(
                session,
                email,
                passwords[email],
                [MembershipSpec(role=role, site_id=None)],
                name=f"Demo {role.value}",
            )
    return passwords


@contextmanager
def _worker(settings: Settings) -> Iterator[None]:
    """Run a worker beside this process; it ends with the block, or by itself if we are killed."""
    log = settings.data_dir / "worker.log"
    with log.open("ab") as target:
        process = subprocess.Popen(  # noqa: S603  our own module
            [sys.executable, "-m", "worker", f"--parent-pid={os.getpid()}"],
            stdout=target,
            stderr=subprocess.STDOUT,
        )
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def _wait_for_detector(database: Database, name: str) -> None:
    """Wait until the worker has tried the detector. Raises AppError when it was refused."""
    deadline = time.monotonic() + READY_WITHIN_S
    while time.monotonic() < deadline:
        with database.reading() as session:
            status, reason = harbour_repository.detector_status(session, name)
        if status is ModelStatus.READY:
            return
        if status is ModelStatus.REFUSED:
            raise AppError(f"the detector {name!r} was refused: {reason}")
        _tell("Trying the detector ...", fleeting=True)
        time.sleep(0.1)
    raise AppError("the worker does not try the detector; see worker.log in the data folder")


def _finish_runs(database: Database, run_ids: list[int]) -> list[str]:
    """Wait for the runs; returns a line about each. Raises AppError when one failed."""
    lines = []
    for run_id in run_ids:
        while True:
            with database.reading() as session:
                run = runs.get_run(session, run_id)
                progress = runs.progress(session, run)
            if run.status in runs.ENDED:
                break
            done = f"{progress.images_done} of {progress.images_total} images"
            _tell(f"{runs.label(run)}: {done} ...", fleeting=True)
            time.sleep(0.2)
        if run.status is RunStatus.FAILED:
            raise AppError(f"the run failed: {run.error}")
        lines.append(
            f"{runs.label(run)}: {progress.images_done} images, {progress.detections} detections, "
            f"{progress.poses} poses"
        )
    return lines


def _against_truth(database: Database, run_ids: list[int]) -> list[str]:
    """Return lines on how the poses stand to the simulated truth."""
    with database.reading() as session:
        figures = against_truth(session, run_ids)
    if figures is None:
        return []
    matched = (
        f"Against the truth: {figures.matched} of {figures.matchable} vessels with AIS that are at "
        f"least half visible have a pose; {figures.wrong} wrong matches."
    )
    lines = [matched]
    spreads = (
        ("horizontal", figures.horizontal_m, "m"),
        ("vertical", figures.vertical_m, "m"),
        ("heading", figures.heading_deg, "deg"),
        ("height", figures.height_m, "m"),
        ("ADD-S", figures.add_s_m, "m"),
    )
    for label, spread, unit in spreads:
        if spread is not None:
            lines.append(
                f"  {label + ' error':<17} median {spread.median:5.2f} {unit:<3}  "
                f"95 % within {spread.p95:5.2f} {unit}"
            )
    return lines


def _what_to_do(database: Database, run_ids: list[int]) -> list[str]:
    """Offer a calibration set by the truth; returns lines on where to grade and to practise."""
    with database.writing() as session:
        practice.offer_from_truth(session, run_ids, "Clear cases of the harbour")
    lines = ["Where to begin, once signed in:"]
    for run_id in run_ids:
        lines += [
            f"  /runs/{run_id}/review  grade the poses",
            f"  /evaluation/progress?run_id={run_id}  see the review's progress filling",
        ]
    return [*lines, "  /calibration-sets  practise on poses judged by the truth"]


def _how_to_sign_in(passwords: dict[str, str]) -> list[str]:
    if not passwords:
        return ["Sign in as before; `quaymark user reset-password` makes a new password."]
    width = max(len(email) for email in passwords)
    lines = [f"  {email:<{width}}  {password}" for email, password in passwords.items()]
    return ["Sign in with one of these; the passwords are shown this once:", *lines]


def _announce(address: str) -> None:
    """Say that all is ready once pages and worker answer."""
    deadline = time.monotonic() + READY_WITHIN_S
    while time.monotonic() < deadline:
        try:
            with urllib.request.urlopen(f"{address}/readyz", timeout=2) as answer:  # noqa: S310  our own address
                if answer.status == 200:
                    typer.echo(f"Quaymark is ready: {address}")
                    return
        except OSError:
            time.sleep(0.1)
    typer.echo("The worker does not answer; see worker.log in the data folder.", err=True)
