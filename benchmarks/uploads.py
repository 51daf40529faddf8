"""A client that uploads photographs at the cost of reading and sending them.

The standard library's connections, one a thread and kept alive; each file goes from the disk to the
network without being joined to others or cut up. A measure of an import is otherwise one of its
client, which has to share the processor with the server.
"""

import json
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from urllib.parse import urlsplit

JSON = {"Content-Type": "application/json"}


@dataclass(frozen=True, slots=True)
class Announced:
    """A file of a batch as the server knows it."""

    id: int
    path: Path
    size_bytes: int


class Uploads:
    """Requests of a bulk import."""

    def __init__(self, url: str, token: str) -> None:
        self._netloc = urlsplit(url).netloc
        self._headers = {"Authorization": f"Bearer {token}"}
        self._own = threading.local()

    def begin(self, camera_id: int) -> str:
        """Begin a batch; returns its address."""
        body = json.dumps({"camera_id": camera_id}).encode()
        response, _ = self._ask("POST", "/api/v1/imports", [body], JSON)
        return response.headers["location"]

    def announce(self, address: str, files: list[Path]) -> list[Announced]:
        """Announce files; returns those that are waited for."""
        sizes = [file.stat().st_size for file in files]
        manifest = [
            {"path": file.name, "size_bytes": size} for file, size in zip(files, sizes, strict=True)
        ]
        body = json.dumps({"files": manifest}).encode()
        _, answer = self._ask("POST", f"{address}/files", [body], JSON)
        return [
            Announced(row["id"], file, size)
            for row, file, size in zip(answer["files"], files, sizes, strict=True)
            if row["state"] == "waiting"
        ]

    def send(self, address: str, pack: list[Announced]) -> None:
        """Send whole files in one request."""
        ids = ",".join(str(file.id) for file in pack)
        headers = {
            "Content-Type": "application/octet-stream",
            "Content-Length": str(sum(file.size_bytes for file in pack)),
        }
        self._ask(
            "POST",
            f"{address}/pack?files={ids}",
            (file.path.read_bytes() for file in pack),
            headers,
        )

    def commit(self, address: str) -> int:
        """Make images of a batch; returns how many."""
        _, answer = self._ask("POST", f"{address}/commit", [], {})
        return int(answer["image_count"])

    def _ask(
        self, method: str, target: str, body: Iterable[bytes], headers: dict[str, str]
    ) -> tuple[HTTPResponse, dict]:
        connection = self._connection()
        if "Content-Length" not in headers:
            body = list(body)
            headers = headers | {"Content-Length": str(sum(map(len, body)))}
        connection.request(method, target, body, self._headers | headers)
        response = connection.getresponse()
        text = response.read()
        assert response.status < 300, text.decode()
        return response, json.loads(text)

    def _connection(self) -> HTTPConnection:
        if not hasattr(self._own, "connection"):
            self._own.connection = HTTPConnection(self._netloc, timeout=60)
        return self._own.connection
