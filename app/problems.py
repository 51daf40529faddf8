"""Every error becomes an answer somebody can act on: a problem (RFC 9457) or a readable page.

Below /api and for scripts it is `application/problem+json`; a browser gets a page, or is sent to
sign in. Whatever nobody foresaw is logged with its trace and answered without it. "There is no such
thing" and "you may not know of it" are one answer, word for word, so that ids cannot be probed.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, RedirectResponse, Response
from pydantic import ValidationError
from sqlalchemy.exc import DataError, IntegrityError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnection
from sqlalchemy.orm.exc import StaleDataError
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.auth.destination import sign_in_address
from app.errors import (
    AppError,
    Conflict,
    FieldError,
    Invalid,
    NotFound,
    PreconditionFailed,
    StorageFull,
    Unauthenticated,
    Unavailable,
)
from app.openapi import describe_problems
from app.templating import page

NOTHING_HERE = "There is nothing at this address, or nothing that you may see."
_log = structlog.get_logger("quaymark.problems")
_TITLES = {
    400: "Bad request",
    405: "Method not allowed",
    413: "Too large",
    415: "Unsupported media type",
    416: "No such part of the file",
    431: "Headers too large",
}


def wants_problem_json(request: Request) -> bool:
    """Whether the caller is a script: below /api, or not asking for HTML."""
    return request.url.path.startswith("/api/") or "text/html" not in request.headers.get(
        "accept", ""
    )


def answer(request: Request, error: AppError) -> Response:
    """Return the answer to a request that failed with an error meant for users."""
    problem: dict[str, object] = {
        "type": "about:blank",
        "title": error.title,
        "status": error.status,
        "detail": NOTHING_HERE if isinstance(error, NotFound) else error.detail,
        "errors": [{"field": part.field, "message": part.message} for part in error.fields],
        **error.more,
    }
    if wants_problem_json(request):
        response: Response = JSONResponse(
            problem, status_code=error.status, media_type="application/problem+json"
        )
    elif isinstance(error, Unauthenticated):
        return RedirectResponse(sign_in_address(request), status_code=303)
    else:
        response = page(request, "error.html", status_code=error.status, problem=problem)
    response.headers.update(error.headers)
    return response


class FrameworkError(AppError):
    """An error of the framework, which knows a status and a phrase."""

    def __init__(self, error: HTTPException) -> None:
        super().__init__(str(error.detail), headers=error.headers)
        self.status = error.status_code
        self.title = _TITLES.get(error.status_code, str(error.detail))


def as_app_error(error: Exception) -> AppError:  # noqa: C901, PLR0911  a table, one a line
    """Return what an error means to the caller; what nobody foresaw becomes a bare 500."""
    match error:
        case AppError():
            return error
        case HTTPException(status_code=404):
            return NotFound("no such route")
        case HTTPException():
            return FrameworkError(error)
        case RequestValidationError():
            return _invalid(error.errors(), prefix=1)
        case ValidationError():
            return _invalid(error.errors(), prefix=0)
        case StaleDataError():
            return PreconditionFailed("somebody else changed it meanwhile; read it again")
        case IntegrityError():
            return Conflict("it contradicts what is stored, such as a name that is in use")
        case DataError() | OverflowError():
            return Invalid("a number is out of range, or a text holds a NUL character")
        case OperationalError() if "full" in str(error.orig).lower():
            return StorageFull("there is no room left; free some space and try again")
        case NoConnection():
            return Unavailable("too much is asked at once", headers={"Retry-After": "5"})
        case OperationalError():
            return Unavailable("the database does not answer", headers={"Retry-After": "5"})
    return AppError("Nobody foresaw this. The server's log has the details.")


def _invalid(parts: Iterable[Mapping[str, Any]], prefix: int) -> Invalid:
    """Name each field as the caller wrote it: `keypoints.3.u_px`, without "body" before it."""
    fields = tuple(
        FieldError(
            ".".join(str(step) for step in part["loc"][prefix:]) or "body",
            str(part["msg"]).removeprefix("Value error, "),
        )
        for part in parts
    )
    return Invalid("; ".join(f"{part.field}: {part.message}" for part in fields), fields=fields)


def _handle(request: Request, error: Exception) -> Response:
    known = as_app_error(error)
    if known is not error and known.status >= 500:
        _log.error("error", status=known.status, path=request.url.path, exc_info=error)
    elif isinstance(known, NotFound):
        _log.info("not_found", path=request.url.path, method=request.method, detail=known.detail)
    return answer(request, known)


def install(app: FastAPI) -> None:
    """Make the application answer every error in one of these ways, and document it."""
    describe_problems(app)
    for kind in (
        AppError,
        HTTPException,
        RequestValidationError,
        ValidationError,
        StaleDataError,
        IntegrityError,
        DataError,
        OverflowError,
        NoConnection,
        OperationalError,
    ):
        app.add_exception_handler(kind, _handle)


class AnswerErrors:
    """ASGI middleware for errors of other middleware, and for those that nobody foresaw."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer an error, unless the answer had begun already."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        begun = False

        async def send_on(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            await send(message)

        try:
            await self._app(scope, receive, send_on)
        except Exception as error:
            if begun:
                raise
            response = await run_in_threadpool(_handle, Request(scope), error)
            await response(scope, receive, send)
