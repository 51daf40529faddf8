"""Supervised loops: work without an end, such as listening to a feed, each in one worker at a time.

A durable job would grow with every message that came; so this is no job but a loop under a lease.
Each worker looks every second what should be looped over, takes what nobody holds, renews what it
holds, and stops what is no longer wanted or was changed. A loop that breaks is begun again after a
pause. When its worker ends, the lease is given back; when it dies, the lease runs out; either way
another worker goes on.
"""

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import structlog
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from worker.leases import Held, LeaseLostError, Leases

log = structlog.get_logger()
LONGEST_PAUSE_S = 15.0


class LoopKind(Protocol):
    """A sort of loop: what should run, and how."""

    name: str

    def wanted(self, session: Session) -> Mapping[int, int]:
        """Return the ids of the things to loop over, each with its version.

        A loop whose version changed is stopped and begun again, with the new settings.
        """

    def run(self, item_id: int, lease: Held, stop: threading.Event) -> None:
        """Loop until `stop` is set; finish within a few seconds then, and store what is left.

        Every writing transaction begins with `confirm(session, lease)`. May raise: the loop is
        begun again after a pause. LeaseLostError is a quiet end.
        """


@dataclass(slots=True)
class Running:
    """A loop of this worker, in a thread of its own."""

    key: tuple[str, int]
    version: int
    lease: Held
    stop: threading.Event
    thread: threading.Thread


class LoopSupervisor:
    """Runs a worker's share of all loops; `start` it, and `stop` it before the process ends."""

    def __init__(
        self, database: Database, settings: Settings, executor_id: str, kinds: Sequence[LoopKind]
    ) -> None:
        self._database = database
        self._leases = Leases(database, settings, executor_id)
        self._kinds = {kind.name: kind for kind in kinds}
        self._look_every_s = settings.heartbeat_s
        self._running: dict[tuple[str, int], Running] = {}
        self._failures: dict[tuple[str, int], int] = {}
        self._not_before: dict[tuple[str, int], float] = {}
        self._leaving = threading.Event()
        self._thread = threading.Thread(target=self._supervise, name="loops", daemon=True)

    def start(self) -> None:
        """Begin to look after the loops."""
        self._thread.start()

    def stop(self, within_s: float) -> None:
        """Stop all loops, each at its own pace but within a time, and give their leases back."""
        deadline = time.monotonic() + within_s
        self._leaving.set()
        self._thread.join(within_s)
        for loop in self._running.values():
            loop.stop.set()
        for loop in self._running.values():
            loop.thread.join(max(0.0, deadline - time.monotonic()))
        try:
            self._bury()
        except DBAPIError as error:
            log.warning("leases were not given back", error=str(error.orig))

    def _supervise(self) -> None:
        while not self._leaving.wait(self._look_every_s):
            try:
                self._look()
            except DBAPIError as error:
                # The loops go on by themselves while the database is away.
                log.warning("loops were not looked after", error=str(error.orig))
            except Exception:
                log.exception("loops were not looked after")

    def _look(self) -> None:
        for lease in self._leases.renew([loop.lease for loop in self._running.values()]):
            log.warning("lease lost", lease=lease.name)
            for loop in self._running.values():
                if loop.lease == lease:
                    loop.stop.set()
        self._bury()
        wanted = self._wanted()
        for key, loop in self._running.items():
            if wanted.get(key) != loop.version:
                loop.stop.set()
        moment = time.monotonic()
        idle = {
            _lease_name(key): key
            for key in wanted
            if key not in self._running and self._not_before.get(key, 0.0) <= moment
        }
        for name in self._leases.free(idle.keys()):
            if taken := self._leases.take(name):
                self._begin(idle[name], wanted[idle[name]], taken)

    def _wanted(self) -> dict[tuple[str, int], int]:
        with self._database.reading() as session:
            return {
                (kind.name, item_id): version
                for kind in self._kinds.values()
                for item_id, version in kind.wanted(session).items()
            }

    def _begin(self, key: tuple[str, int], version: int, lease: Held) -> None:
        stop = threading.Event()
        thread = threading.Thread(
            target=self._loop, args=(key, lease, stop), name=lease.name, daemon=True
        )
        self._running[key] = Running(key, version, lease, stop, thread)
        log.info("loop begins", lease=lease.name, epoch=lease.epoch)
        thread.start()

    def _loop(self, key: tuple[str, int], lease: Held, stop: threading.Event) -> None:
        kind, item_id = key
        began = time.monotonic()
        try:
            self._kinds[kind].run(item_id, lease, stop)
        except LeaseLostError:
            log.warning("lease lost", lease=lease.name)
        except Exception:
            log.exception("loop broke", lease=lease.name)
            self._pause(key, lived_s=time.monotonic() - began)

    def _pause(self, key: tuple[str, int], lived_s: float) -> None:
        failures = 1 if lived_s > LONGEST_PAUSE_S else self._failures.get(key, 0) + 1
        self._failures[key] = failures
        self._not_before[key] = time.monotonic() + min(LONGEST_PAUSE_S, 2.0**failures / 2)

    def _bury(self) -> None:
        """Give back the leases of loops that ended."""
        for key, loop in list(self._running.items()):
            if not loop.thread.is_alive():
                self._leases.release(loop.lease)
                del self._running[key]


def _lease_name(key: tuple[str, int]) -> str:
    kind, item_id = key
    return f"{kind}:{item_id}"
