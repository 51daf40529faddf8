"""What every route may ask for: a session, the file store, the jobs, a page of a list.

A session's transaction begins at its first statement and is committed after the route returned and
before the answer leaves, so that an answer never promises what was not stored. Reading routes open
it to read; all others to write.
"""

from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Iterator, Sequence
from typing import Annotated, Generic, TypeVar

import sqlalchemy as sa
from fastapi import Depends, Query, Request
from pydantic import BaseModel
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.errors import Invalid
from app.jobs import JobClient
from app.storage import Storage

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
Item = TypeVar("Item")


def _settings(request: Request) -> Settings:
    settings: Settings = request.app.state.settings
    return settings


def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


def _storage(request: Request) -> Storage:
    storage: Storage = request.app.state.storage
    return storage


def _jobs(request: Request) -> JobClient:
    jobs: JobClient = request.app.state.jobs
    return jobs


SettingsDep = Annotated[Settings, Depends(_settings)]
DatabaseDep = Annotated[Database, Depends(_database)]
StorageDep = Annotated[Storage, Depends(_storage)]
JobsDep = Annotated[JobClient, Depends(_jobs)]


def _session(request: Request, database: DatabaseDep) -> Iterator[Session]:
    if request.method in SAFE_METHODS:
        with database.reading() as session:
            yield session
    else:
        with database.writing() as session:
            yield session


SessionDep = Annotated[Session, Depends(_session, scope="function")]


class Paging(BaseModel):
    """Which part of a list is wanted."""

    limit: int
    after: int | None


def _paging(
    limit: Annotated[int, Query(ge=1, le=1000, description="How many items at most")] = 100,
    cursor: Annotated[
        str | None, Query(max_length=64, description="`next_cursor` of the last answer")
    ] = None,
) -> Paging:
    return Paging(limit=limit, after=decode_cursor(cursor) if cursor else None)


PagingDep = Annotated[Paging, Depends(_paging)]


class Page(BaseModel, Generic[Item]):
    """A part of a list and the way to the next."""

    items: list[Item]
    next_cursor: str | None = None


def encode_cursor(last_id: int) -> str:
    """Return the opaque text that stands for "after this id"."""
    return urlsafe_b64encode(str(last_id).encode()).decode().rstrip("=")


def decode_cursor(cursor: str) -> int:
    """Return the id a cursor stands for. Raises Invalid for a text that is no cursor of ours."""
    try:
        return int(urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)))
    except ValueError as error:
        raise Invalid.field("cursor", "is not one of ours; leave it out to begin anew") from error


Row = TypeVar("Row")


def fetch_page(
    session: Session,
    statement: sa.Select[Row],
    identifier: sa.ColumnElement[int] | sa.orm.InstrumentedAttribute[int],
    paging: Paging,
) -> tuple[Sequence[Row], str | None]:
    """Return a statement's rows in order of an id after the cursor, and the next cursor."""
    if paging.after is not None:
        statement = statement.where(identifier > paging.after)
    rows = session.scalars(statement.order_by(identifier).limit(paging.limit + 1)).all()
    if len(rows) <= paging.limit:
        return rows, None
    rows = rows[: paging.limit]
    return rows, encode_cursor(getattr(rows[-1], identifier.key or "id"))
