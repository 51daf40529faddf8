"""The built front end: files whose names carry their hash, so browsers may keep them for ever.

Beside each text the build lays the same text packed, and a browser gets the smallest it can read.

A checkout whose front end is not built yet starts all the same (the REST interface needs none) and
answers 404 here.
"""

from mimetypes import guess_type
from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from app.auth.declared import declare_public
from app.errors import NotFound
from app.locator import locate

PACKINGS = (("br", ".br"), ("gzip", ".gz"))
FOREVER = "public, max-age=31536000, immutable"


class _HashedFiles(StaticFiles):
    """Files below a folder, never listed, kept by browsers for ever."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        if any(part.startswith(".") for part in Path(path).parts):
            raise NotFound("hidden files are not served")
        response = await self._packed(path, scope) or await super().get_response(path, scope)
        response.headers["Cache-Control"] = FOREVER
        response.headers.append("Vary", "Accept-Encoding")
        return response

    async def _packed(self, path: str, scope: Scope) -> Response | None:
        """Return a file in the smallest packing that the caller takes and the build made."""
        headers = Headers(scope=scope)
        media_type, _ = guess_type(path)
        if media_type is None or "range" in headers:
            return None
        asked = headers.get("accept-encoding", "")
        taken = {part.partition(";")[0].strip() for part in asked.split(",")}
        for packing, ending in PACKINGS:
            if packing in taken and self.lookup_path(path + ending)[1] is not None:
                response = await super().get_response(path + ending, scope)
                response.headers["Content-Encoding"] = packing
                is_text = media_type.startswith("text/")
                charset = "; charset=utf-8" if is_text else ""
                response.headers["Content-Type"] = media_type + charset
                return response
        return None


async def _not_built(_scope: Scope, _receive: Receive, _send: Send) -> None:
    raise NotFound("the front end is not built; run `make build`")


def mount_statics(app: FastAPI) -> None:
    """Serve the built front end below /static."""
    try:
        files: ASGIApp = declare_public(_HashedFiles(directory=locate("static/dist")))
    except FileNotFoundError:
        files = declare_public(_not_built)
    app.mount("/static", files, name="static")
