"""The built front end: files whose names carry their hash, so browsers may keep them for ever.

A checkout whose front end is not built yet starts all the same (the REST interface needs none) and
answers 404 here.
"""

from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from app.auth.declared import declare_public
from app.errors import NotFound
from app.locator import locate

FOREVER = "public, max-age=31536000, immutable"


class _HashedFiles(StaticFiles):
    """Files below a folder, never listed, kept by browsers for ever."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        if any(part.startswith(".") for part in Path(path).parts):
            raise NotFound("hidden files are not served")
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = FOREVER
        return response


async def _not_built(_scope: Scope, _receive: Receive, _send: Send) -> None:
    raise NotFound("the front end is not built; run `make build`")


def mount_statics(app: FastAPI) -> None:
    """Serve the built front end below /static."""
    try:
        files: ASGIApp = declare_public(_HashedFiles(directory=locate("static/dist")))
    except FileNotFoundError:
        files = declare_public(_not_built)
    app.mount("/static", files, name="static")
