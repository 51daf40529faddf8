"""The connection to a server: the token, patience while it is busy, and failures as exceptions."""

import time
from types import TracebackType
from typing import Any, Self

import httpx

BUSY = 503
TRIES_WHILE_BUSY = 5
LONGEST_PAUSE_S = 60.0


class ApiError(Exception):
    """A request that failed, in the server's words (RFC 9457)."""

    def __init__(self, response: httpx.Response) -> None:
        self.status = response.status_code
        self.detail: str = response.reason_phrase
        self.errors: list[dict[str, str]] = []
        """Each names a field and says how to mend it."""
        if "json" in response.headers.get("content-type", ""):
            problem = response.json()
            self.detail = problem.get("detail", self.detail)
            self.errors = problem.get("errors", [])
        super().__init__(f"{self.status}: {self.detail}")


class Quaymark:
    """A server and the token it is asked with; the first argument of every function of `api`.

    The token's scopes say what may be asked. Use it as a context manager, or `close` it.
    """

    def __init__(
        self,
        address: str,
        token: str,
        *,
        timeout_s: float = 60.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self.http = httpx.Client(
            base_url=address,
            headers={"Authorization": f"Bearer {token}"},
            timeout=timeout_s,
            transport=transport,
        )

    def request(self, method: str, path: str, **arguments: Any) -> httpx.Response:  # noqa: ANN401  httpx's own
        """Ask, and again after a pause while the server is too busy. Raises ApiError.

        Files that were sent are closed.
        """
        sent = _files_of(arguments)
        try:
            for tries_left in reversed(range(1 if sent else TRIES_WHILE_BUSY)):
                response = self.http.request(method, path, **arguments)
                if response.status_code != BUSY or not tries_left:
                    break
                time.sleep(pause_s(response))
        finally:
            for one in sent:
                one.close()
        if response.is_error:
            raise ApiError(response)
        return response

    def close(self) -> None:
        """Close the connections."""
        self.http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def pause_s(response: httpx.Response) -> float:
    """Return how long the server wants to be left alone, seconds."""
    told = response.headers.get("Retry-After", "1")
    return min(float(told) if told.isdigit() else 1.0, LONGEST_PAUSE_S)


def _files_of(arguments: dict[str, Any]) -> list[Any]:
    parts = [part[1] for _, part in arguments.get("files", [])] + [arguments.get("content")]
    return [part for part in parts if hasattr(part, "close")]
