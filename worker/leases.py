"""Leases: what only one worker may do at a time, and how the others know that it is taken.

A lease is a row with a holder, renewed while that worker lives. When it falls silent another worker
takes the lease and its epoch grows. The old holder may wake up and know nothing of that, so every
transaction that writes under a lease begins with `confirm`, which renews the lease or raises: what
a worker that lost its lease wanted to store is never stored.
"""

from collections.abc import Collection
from dataclasses import dataclass
from datetime import timedelta

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.tables.operation import Lease
from worker.moments import common_moment


@dataclass(frozen=True, slots=True)
class Held:
    """A lease in a worker's hands: what it is of, and under which epoch."""

    name: str
    epoch: int


class LeaseLostError(Exception):
    """Another worker holds the lease now: stop, and store nothing more."""


def confirm(session: Session, lease: Held) -> None:
    """Renew a lease in the transaction that writes under it. Raises LeaseLostError."""
    moment = common_moment(session)
    renewed = session.scalar(
        sa.update(Lease)
        .where(Lease.name == lease.name, Lease.epoch == lease.epoch, Lease.holder.is_not(None))
        .values(renewed_at=moment)
        .returning(Lease.epoch)
    )
    if renewed is None:
        raise LeaseLostError(lease.name)


class Leases:
    """One worker's leases."""

    def __init__(self, database: Database, settings: Settings, executor_id: str) -> None:
        self._database = database
        self._expire_after = timedelta(seconds=settings.takeover_after_s)
        self._executor_id = executor_id
        self._insert = (sqlite if settings.is_sqlite else postgresql).insert

    def take(self, name: str) -> Held | None:
        """Take a lease that nobody holds or whose holder fell silent; None while it is held."""
        with self._database.writing() as session:
            moment = common_moment(session)
            epoch = session.scalar(
                self._insert(Lease)
                .values(
                    name=name,
                    holder=self._executor_id,
                    epoch=1,
                    taken_at=moment,
                    renewed_at=moment,
                )
                .on_conflict_do_update(
                    index_elements=[Lease.name],
                    set_={
                        "holder": self._executor_id,
                        "epoch": Lease.epoch + 1,
                        "taken_at": moment,
                        "renewed_at": moment,
                    },
                    where=sa.or_(
                        Lease.holder.is_(None), Lease.renewed_at < moment - self._expire_after
                    ),
                )
                .returning(Lease.epoch)
            )
        return None if epoch is None else Held(name, epoch)

    def free(self, names: Collection[str]) -> list[str]:
        """Return which of these names nobody holds at the moment."""
        if not names:
            return []
        with self._database.reading() as session:
            oldest = common_moment(session) - self._expire_after
            taken = set(
                session.scalars(
                    sa.select(Lease.name).where(
                        Lease.holder.is_not(None), Lease.renewed_at >= oldest
                    )
                )
            )
        return [name for name in names if name not in taken]

    def renew(self, held: Collection[Held]) -> frozenset[Held]:
        """Say that this worker still does what it holds. Returns the leases that were lost."""
        if not held:
            return frozenset()
        keys = [(lease.name, lease.epoch) for lease in held]
        with self._database.writing() as session:
            renewed = session.execute(
                sa.update(Lease)
                .where(
                    sa.tuple_(Lease.name, Lease.epoch).in_(keys),
                    Lease.holder == self._executor_id,
                )
                .values(renewed_at=common_moment(session))
                .returning(Lease.name, Lease.epoch)
            )
            kept = {Held(name, epoch) for name, epoch in renewed}
        return frozenset(set(held) - kept)

    def release(self, lease: Held) -> None:
        """Give a lease back, so that another worker takes it at once. One that was lost stays."""
        with self._database.writing() as session:
            session.execute(
                sa.update(Lease)
                .where(Lease.name == lease.name, Lease.epoch == lease.epoch)
                .values(holder=None)
            )
