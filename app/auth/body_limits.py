"""How large a request's body may be, counted as it comes in, whatever its headers claim.

Nobody may send more than a sign-in form takes; JSON and forms are small; only uploads of known
callers may be large, each as large as its kind of file.
"""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.config import Settings

ANONYMOUS_BYTES = 64 * 2**10
FORM_BYTES = 16 * 2**20
MULTIPART_OVERHEAD_BYTES = 2**20
CALIBRATION_UPLOADS = 4  # all photographs of a chequerboard come in one request


class BodyLimits:
    """ASGI middleware that refuses a body which is too large for its sender and its route."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._default_bytes = settings.max_upload_bytes
        self._bytes_by_feature = {
            "ais": settings.max_ais_file_bytes,
            "models": settings.max_model_bytes,
            "imports": settings.max_model_bytes,
            "cameras": CALIBRATION_UPLOADS * settings.max_upload_bytes,
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse by the announced length, else go on and count."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        limit_bytes = self._limit_bytes(scope, headers)
        announced = headers.get("content-length", "0")
        if not announced.isascii() or not announced.isdigit():
            raise HTTPException(400, "Content-Length must be a number")
        if int(announced) > limit_bytes:
            raise _too_large(limit_bytes)
        taken_bytes = 0

        async def receive_counted() -> Message:
            nonlocal taken_bytes
            message = await receive()
            if message["type"] == "http.request":
                taken_bytes += len(message.get("body", b""))
                if taken_bytes > limit_bytes:
                    raise _too_large(limit_bytes)
            return message

        await self._app(scope, receive_counted, send)

    def _limit_bytes(self, scope: Scope, headers: Headers) -> int:
        if scope["state"]["access"] is None:
            return ANONYMOUS_BYTES
        if not headers.get("content-type", "").lower().startswith("multipart/"):
            return FORM_BYTES
        feature = scope["path"].removeprefix("/api/v1").strip("/").partition("/")[0]
        return self._bytes_by_feature.get(feature, self._default_bytes) + MULTIPART_OVERHEAD_BYTES


def _too_large(limit_bytes: int) -> HTTPException:
    # The framework's own error: its form parser lets no other through.
    return HTTPException(413, f"at most {limit_bytes} bytes are taken here")
