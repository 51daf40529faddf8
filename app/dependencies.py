"""What every route may ask for: a session, the file store, the jobs, a page of a list.

A session's transaction begins at its first statement and is committed after the route returned and
before the answer leaves, so that an answer never promises what was not stored. Reading routes open
it to read; all others to write.
"""

from collections.abc import AsyncIterator
from typing import Annotated

from anyio import CancelScope
from fastapi import Depends, Query, Request
from fastapi.concurrency import run_in_threadpool
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, access_of
from app.config import Settings
from app.db import Database
from app.identities.service import NOTHING, Reader, read_by
from app.jobs import JobClient
from app.paging import Page, Paging, decode_cursor, fetch_page
from app.session_slots import SessionSlots
from app.storage import Storage

__all__ = [
    "DatabaseDep",
    "JobsDep",
    "Page",
    "Paging",
    "PagingDep",
    "SessionDep",
    "SettingsDep",
    "StorageDep",
    "fetch_page",
    "public_address",
    "reader_of",
]

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


# These only look something up: as coroutines they cost no change of threads.
async def _settings(request: Request) -> Settings:
    settings: Settings = request.app.state.settings
    return settings


async def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


async def _storage(request: Request) -> Storage:
    storage: Storage = request.app.state.storage
    return storage


async def _jobs(request: Request) -> JobClient:
    jobs: JobClient = request.app.state.jobs
    return jobs


def public_address(request: Request) -> str:
    """Return the address that links for other people begin with, without a slash at its end."""
    settings: Settings = request.app.state.settings
    return (settings.public_url or str(request.base_url)).rstrip("/")


SettingsDep = Annotated[Settings, Depends(_settings)]
DatabaseDep = Annotated[Database, Depends(_database)]
StorageDep = Annotated[Storage, Depends(_storage)]
JobsDep = Annotated[JobClient, Depends(_jobs)]


def reader_of(access: Access | None) -> Reader:
    """Return who reads for a caller: identities of vessels are for those who may ingest."""
    if access is None:
        return NOTHING
    return Reader(access.site_ids(Scope.READ), access.site_ids(Scope.INGEST))


async def _session(request: Request, database: DatabaseDep) -> AsyncIterator[Session]:
    slots: SessionSlots = request.app.state.session_slots
    async with slots.here():
        # Nothing touches the database before the route's first statement, in the route's thread.
        writes = request.method not in SAFE_METHODS
        session = database.session(writes=writes)
        read_by(session, reader_of(access_of(request)))
        if writes:
            request.state.session = session  # for what is stored with the answer (idempotency)
        try:
            yield session
            if writes:
                await run_in_threadpool(session.commit)
        finally:
            if database.is_sqlite:
                session.close()
            else:  # gives the server a ROLLBACK, also to a caller who has left
                with CancelScope(shield=True):
                    await run_in_threadpool(session.close)


SessionDep = Annotated[Session, Depends(_session, scope="function")]


async def _paging(
    limit: Annotated[int, Query(ge=1, le=1000, description="How many items at most")] = 100,
    cursor: Annotated[
        str | None, Query(max_length=64, description="`next_cursor` of the last answer")
    ] = None,
) -> Paging:
    return Paging(limit=limit, after=decode_cursor(cursor) if cursor else None)


PagingDep = Annotated[Paging, Depends(_paging)]
