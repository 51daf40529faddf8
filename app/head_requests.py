"""HEAD is answered as GET is, without the body: scripts ask so how large a download is.

Every route that answers GET does, with the same permission, status and headers. What would send the
body is told that its reader has left, so that no large file is read for nobody.
"""

from starlette.types import ASGIApp, Message, Receive, Scope, Send


class AnswerHead:
    """ASGI middleware that asks for GET where a caller asks for HEAD, and keeps the body back."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Go on as GET, and end the answer where its body begins."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        has_ended = False

        async def send_head(message: Message) -> None:
            nonlocal has_ended
            if message["type"] == "http.response.start":
                await send(message)
            elif not has_ended:
                has_ended = True
                await send({"type": "http.response.body", "body": b"", "more_body": False})

        async def receive_until_ended() -> Message:
            return {"type": "http.disconnect"} if has_ended else await receive()

        await self._app({**scope, "method": "GET"}, receive_until_ended, send_head)
