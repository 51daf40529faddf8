"""What was deleted stays for a while, hidden from every query, and can be brought back.

Sites, cameras, viewports, images, runs and recordings are never removed at once: `deleted_at`
hides them, and everything that belongs to one of them (poses, keypoints, queues, reports) is hidden
with it. No query has to remember this: importing the tables teaches every session to leave such
rows out of whatever it selects. Asking with the execution option `with_deleted` shows them.

Smaller things (`DeletableAlone`: landmarks, models, queues and the like) can be deleted one by one
too; where a site or run is deleted, they are hidden as all else that belongs to it.

Only selects are told. The inner select of an insert, update or delete must leave them out itself.
"""

from datetime import datetime
from functools import cache
from typing import Any
from weakref import WeakKeyDictionary

import sqlalchemy as sa
from sqlalchemy.orm import (
    Mapped,
    Mapper,
    ORMExecuteState,
    Session,
    mapped_column,
    with_loader_criteria,
)

from app.db import Base, now

WITH_DELETED = {"with_deleted": True}
# Who may do what must be known of a deleted site too: somebody has to bring it back.
ALWAYS_SHOWN = frozenset({"memberships"})


class Deletable:
    """A row that can be deleted and brought back, together with others of the same deletion."""

    deleted_at: Mapped[datetime | None]
    deletion_id: Mapped[int | None] = mapped_column(index=True)


class DeletableAlone(Deletable):
    """A row that can be deleted by itself, and is hidden too with what it belongs to.

    A site, camera, viewport, image or run marks all such below it when it is deleted; of these
    nothing is marked then, so that each comes back as it was.
    """


PRESENT = sa.text("deleted_at IS NULL")  # what was deleted leaves its name to others


def unique_among_present(table: str, *columns: str) -> sa.Index:
    """Return an index that lets no two rows that are not deleted have the same values."""
    return sa.Index(
        f"uq_{table}_{'_'.join(columns)}",
        *columns,
        unique=True,
        sqlite_where=PRESENT,
        postgresql_where=PRESENT,
    )


def index_of_deleted(table: str) -> sa.Index:
    """Return an index of the deleted rows alone: they are few, and every query asks for them."""
    deleted = sa.text("deleted_at IS NOT NULL")
    return sa.Index(f"ix_{table}_deleted", "id", sqlite_where=deleted, postgresql_where=deleted)


def index_of_changed(table: str) -> sa.Index:
    """Return an index of the rows that changed since they were stored: exports ask since when."""
    changed = sa.text("changed_at IS NOT NULL")
    return sa.Index(
        f"ix_{table}_changed", "changed_at", sqlite_where=changed, postgresql_where=changed
    )


class Deletion(Base):
    """One act of deleting: what was named, what went with it, and who did it.

    It refers to no table, because the rows it speaks of refer to it. A recording of all sites has
    no site.
    """

    __tablename__ = "deletions"

    id: Mapped[int] = mapped_column(primary_key=True)
    entity: Mapped[str] = mapped_column(sa.String(32))
    entity_id: Mapped[int | None]
    site_id: Mapped[int | None] = mapped_column(index=True)
    label: Mapped[str] = mapped_column(sa.String(300))
    counts: Mapped[dict[str, Any]]
    deleted_at: Mapped[datetime] = mapped_column(default=now, index=True)
    deleted_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )


@cache
def parents_of(mapper: Mapper[Any]) -> tuple[tuple[str, sa.Table], ...]:
    """Return the columns that name a deletable row this one belongs to, and that row's table."""
    if mapper.class_.__tablename__ in ALWAYS_SHOWN:
        return ()
    deletable = {
        other.local_table for other in Base.registry.mappers if issubclass(other.class_, Deletable)
    }
    references = [
        (key.parent.key, key.column.table)
        for key in mapper.local_table.foreign_keys
        if key.ondelete == "CASCADE" and key.column.table in deletable
    ]
    return tuple(sorted(references, key=lambda reference: reference[0]))


def _is_visible(row: type[Any]) -> sa.ColumnElement[bool]:
    mapper: Mapper[Any] | None = sa.inspect(row, raiseerr=False)
    if mapper is None:
        return sa.true()
    own: list[sa.ColumnElement[bool]] = []
    if issubclass(mapper.class_, Deletable):
        own.append(row.deleted_at.is_(None))
        if not issubclass(mapper.class_, DeletableAlone):
            return own[0]
    return sa.and_(
        sa.true(),
        *own,
        *(_belongs_to_visible(getattr(row, name), table) for name, table in parents_of(mapper)),
    )


def _belongs_to_visible(column: Any, table: sa.Table) -> sa.ColumnElement[bool]:  # noqa: ANN401  of an alias too
    # The deleted are few, and an index holds them alone.
    hidden = sa.select(table.c.id).where(table.c.deleted_at.is_not(None))
    return sa.or_(column.is_(None), column.not_in(hidden))


# A class method, because only such are asked of an alias too.
Base.is_visible = classmethod(_is_visible)
_HIDE = with_loader_criteria(
    Base, lambda row: row.is_visible(), include_aliases=True, propagate_to_loaders=False
)


# A statement that is put together once is told once: the next time, how it is compiled is known.
_told: WeakKeyDictionary[sa.Executable, sa.Executable] = WeakKeyDictionary()


def _without_deleted(statement: sa.Executable) -> sa.Executable:
    known = _told.get(statement)
    if known is None:
        known = _told[statement] = statement.options(_HIDE)
    return known


@sa.event.listens_for(Session, "do_orm_execute")
def _leave_deleted_out(state: ORMExecuteState) -> None:
    if (
        state.is_select
        and not state.is_column_load
        and not state.is_relationship_load
        and not state.execution_options.get("with_deleted")
    ):
        state.statement = _without_deleted(state.statement)
