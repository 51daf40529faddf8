"""A write that is repeated with the same `Idempotency-Key` happens once and is answered alike.

A client that lost the answer cannot know whether its request was carried out; so it sends the same
again, with the same key, and gets the first answer. Declared for all routes of a router:

    router = APIRouter(route_class=IdempotentRoute)

The answer is stored in the very transaction that made the change, so there is no moment in which
one is there and the other is not. The same key with another request is a mistake (422). Answers to
failed requests are not stored: nothing happened, and the next try may go well. Uploads (multipart)
need no key: the same bytes are the same object, whoever sends them how often. Keys are a caller's
own and are kept for a day. Answers that hold a secret must not be stored: such routes stay with the
plain route class.
"""

import hashlib
import hmac
import json
from collections.abc import Callable, Coroutine
from datetime import timedelta
from typing import Any

from fastapi import Request, Response
from fastapi.responses import StreamingResponse
from fastapi.routing import APIRoute
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool

from app.auth import repository
from app.auth.access import Access, access_of
from app.config import Settings
from app.db import Database, now
from app.dependencies import SAFE_METHODS
from app.errors import Conflict, Invalid
from app.tables.identity import IdempotencyKey

HEADER = "Idempotency-Key"
LONGEST_KEY = 200
KEPT_FOR = timedelta(days=1)
_KEPT_HEADERS = ("location", "etag")
Handler = Callable[[Request], Coroutine[Any, Any, Response]]


class IdempotentRoute(APIRoute):
    """A route whose writes may be repeated safely with an `Idempotency-Key`."""

    def get_route_handler(self) -> Handler:
        """Return the route's handler, with the look-up before and the storing after it."""
        handle = super().get_route_handler()
        if SAFE_METHODS.issuperset(self.methods or ()):
            return handle

        async def handle_once(request: Request) -> Response:
            key, access = request.headers.get(HEADER), access_of(request)
            if key is None or access is None or _is_upload(request):
                return await handle(request)
            if not 1 <= len(key) <= LONGEST_KEY:
                raise Invalid.field(HEADER, f"use 1 to {LONGEST_KEY} characters")
            asked = _fingerprint(request, access, await request.body())
            database: Database = request.app.state.database
            earlier = await run_in_threadpool(_earlier_answer, database, access, key, asked)
            if earlier is not None:
                return earlier
            response = await handle(request)
            if not isinstance(response, StreamingResponse):
                entry = _entry(access, key, asked, response)
                await run_in_threadpool(_store, request, database, entry)
            return response

        return handle_once


def _is_upload(request: Request) -> bool:
    return request.headers.get("content-type", "").lower().startswith("multipart/")


def _fingerprint(request: Request, access: Access, body: bytes) -> str:
    """Return a digest of what is asked; a token of other scopes asks for something else.

    Keyed with the installation's secret: a body may hold a password, which a plain hash of it
    would offer for guessing.
    """
    settings: Settings = request.app.state.settings
    digest = hmac.new(settings.secret(), digestmod=hashlib.sha256)
    for part in (request.method, request.url.path, request.url.query, *sorted(access.scopes())):
        digest.update(part.encode() + b"\0")
    digest.update(body)
    return digest.hexdigest()


def _earlier_answer(
    database: Database, access: Access, key: str, request_sha256: str
) -> Response | None:
    with database.reading() as session:
        entry = repository.idempotency_key(session, access.user_id, key)
    if entry is None or entry.created_at < now() - KEPT_FOR:
        return None
    if entry.request_sha256 != request_sha256:
        raise Invalid.field(HEADER, "was used for another request; make a new key for this one")
    content = json.dumps(entry.body["json"]).encode() if entry.body else b""
    headers = {**entry.headers, "Idempotency-Replayed": "true"}
    if content:
        headers["Content-Type"] = "application/json"
    return Response(content, status_code=entry.status, headers=headers)


def _entry(access: Access, key: str, request_sha256: str, response: Response) -> IdempotencyKey:
    content = bytes(response.body)
    return IdempotencyKey(
        user_id=access.user_id,
        key=key,
        request_sha256=request_sha256,
        status=response.status_code,
        body={"json": json.loads(content)} if content else {},
        headers={
            name: response.headers[name] for name in _KEPT_HEADERS if name in response.headers
        },
    )


def _store(request: Request, database: Database, entry: IdempotencyKey) -> None:
    session: Session | None = getattr(request.state, "session", None)
    try:
        if session is not None:
            _keep(session, entry)
        else:
            with database.writing() as own:
                _keep(own, entry)
    except IntegrityError as error:
        raise Conflict(
            "the same request was under way already; repeat it to get its answer"
        ) from error


def _keep(session: Session, entry: IdempotencyKey) -> None:
    repository.drop_idempotency_keys(session, before=now() - KEPT_FOR)
    session.add(entry)
    session.flush()
