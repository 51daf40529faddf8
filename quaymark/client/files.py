"""Files out and in: opened to be sent, and downloaded so that a broken connection costs little."""

import hashlib
import time
from pathlib import Path

import httpx

from quaymark.client.connection import ApiError, Quaymark
from quaymark.client.rest.models import ExportOut
from quaymark.client.rest.types import File

CHUNK_BYTES = 1 << 20
PAUSE_S = 1.0
RANGE_NOT_SATISFIABLE = 416


class DamagedError(Exception):
    """What was downloaded is not what the server has: its SHA-256 differs."""


def file(path: str | Path) -> File:
    """Open a file to be sent under its own name; it is closed when it was sent."""
    path = Path(path)
    return File(payload=path.open("rb"), file_name=path.name)


def download(client: Quaymark, export: ExportOut, path: str | Path, *, tries: int = 10) -> Path:
    """Download an export that has succeeded, and compare its SHA-256; returns the path.

    What has come lies in `PATH.part` until it is whole; a lost connection, or a later call, goes on
    there. Raises DamagedError, ApiError, and httpx.TransportError when no try gets further.
    """
    path = Path(path)
    part = path.with_name(f"{path.name}.part")
    while True:
        had = part.stat().st_size if part.exists() else 0
        try:
            _fetch(client, export, part)
            break
        except httpx.TransportError:
            tries = tries - 1 if part.exists() and part.stat().st_size == had else tries
            if tries <= 0:
                raise
            time.sleep(PAUSE_S)
    with part.open("rb") as source:
        if hashlib.file_digest(source, "sha256").hexdigest() != export.sha256:
            part.unlink()
            raise DamagedError(f"{path.name}: not the bytes the server has; download it again")
    part.replace(path)
    return path


def _fetch(client: Quaymark, export: ExportOut, part: Path) -> None:
    """Append to a file what is missing of an export, or begin anew where it is another's."""
    with part.open("ab") as target:
        had = target.tell()
        if had == export.size_bytes:
            return
        headers = {"Range": f"bytes={had}-", "If-Range": f'"{export.sha256}"'} if had else {}
        place = f"/api/v1/exports/{export.id}/download"
        with client.http.stream("GET", place, headers=headers) as response:
            if response.is_error and response.status_code != RANGE_NOT_SATISFIABLE:
                response.read()
                raise ApiError(response)
            if response.status_code != httpx.codes.PARTIAL_CONTENT:
                target.truncate(0)
            for chunk in response.iter_raw(CHUNK_BYTES):
                target.write(chunk)
