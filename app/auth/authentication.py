"""Who is calling, answered once for each request and before its body is read.

A large upload by nobody is refused while it is still on its way, and every part of the application
(the route, the page's header, the error page, the log) sees the same `request.state.access`. The
look-up uses a short session of its own: the route's session has not begun, so on SQLite a writing
route takes the writer's lock no sooner than its own first statement.
"""

from datetime import datetime
from http.cookies import CookieError, SimpleCookie

import structlog
from sqlalchemy.exc import OperationalError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from app.auth import service
from app.auth.access import Access
from app.db import Database, now

_log = structlog.get_logger("quaymark.access")
SESSION_COOKIE = "quaymark_session"
# Answers that depend on nobody: no look-up for them.
_ANONYMOUS_PREFIXES = ("/static/", "/healthz", "/readyz")


class Authentication:
    """ASGI middleware that puts the caller's access into the request's state."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._is_noting = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Identify the caller, then go on; an unknown caller goes on as nobody."""
        if scope["type"] == "http":
            state = scope.setdefault("state", {})
            state["access"] = None
            if not scope["path"].startswith(_ANONYMOUS_PREFIXES):
                headers = Headers(scope=scope)
                bearer, cookie = bearer_of(headers), session_cookie_of(headers)
                if bearer is not None or cookie is not None:
                    database: Database = scope["app"].state.database
                    state["access"] = await self._access(database, bearer, cookie)
        await self._app(scope, receive, send)

    async def _access(
        self, database: Database, bearer: str | None, cookie: str | None
    ) -> Access | None:
        moment = now()
        if database.is_sqlite:
            # One look-up by an index in a file that lets readers pass: quicker than a thread.
            caller = _identify(database, bearer, cookie, moment)
        else:
            caller = await run_in_threadpool(_identify, database, bearer, cookie, moment)
        if caller is None:
            return None
        # One writes at a time; of hundreds that come at once the others would only wait for it.
        if caller.token_to_note is not None and not self._is_noting:
            self._is_noting = True
            try:
                await run_in_threadpool(_note_token_use, database, caller.token_to_note, moment)
            finally:
                self._is_noting = False
        return caller.access


def _identify(
    database: Database, bearer: str | None, cookie: str | None, moment: datetime
) -> service.Caller | None:
    with database.glancing() as session:
        return service.authenticate(session, bearer=bearer, cookie=cookie, moment=moment)


def access_now(database: Database, headers: Headers) -> Access | None:
    """Return what the caller of a request that goes on for long may still do; None: nothing."""
    caller = _identify(database, bearer_of(headers), session_cookie_of(headers), now())
    return caller.access if caller else None


def _note_token_use(database: Database, token_id: int, moment: datetime) -> None:
    try:
        with database.writing() as session:
            service.note_token_use(session, token_id, moment)
    except OperationalError as error:
        # On a full disk one can still read; when a token was used last matters less.
        _log.warning("token use not noted", error=str(error.orig))


def bearer_of(headers: Headers) -> str | None:
    """Return the bearer token of a request; empty for another sort of Authorization header."""
    authorization = headers.get("authorization")
    if authorization is None:
        return None
    kind, _, token = authorization.partition(" ")
    return token.strip() if kind.lower() == "bearer" else ""


def session_cookie_of(headers: Headers) -> str | None:
    """Return the session cookie of a request, or None."""
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(SESSION_COOKIE)
    except CookieError:
        return None
    return morsel.value if morsel else None
