"""The official YOLOX models (COCO weights, Apache-2.0), fetched and checked.

Nano's SHA-256 is known beforehand. The others' are recorded in the audit log when they are pulled
first, and a file that differs later is refused: a release that changes is no release.
"""

import hashlib
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from http.client import HTTPMessage
from typing import IO
from urllib.parse import urlsplit

from app.auth.audit import record
from app.db import Database
from app.detectors import repository, service
from app.errors import Conflict, Invalid, TooLarge, Unavailable
from app.jobs import JobClient
from app.storage import Storage

RELEASE_URL = "https://github.com/Megvii-BaseDetection/YOLOX/releases/download/0.1.1rc0"
OFFICIAL: Mapping[str, str] = {
    f"yolox-{size}": f"yolox_{size}.onnx" for size in ("nano", "tiny", "s", "m", "l", "x")
}
PINNED_SHA256: Mapping[str, str] = {
    "yolox-nano": "c789161ed43c8269fcd4e67c67eeeb4e80c622da2eb296a20bc6007bd18a0b7d",
}
LARGEST_BYTES = 512 << 20  # X, the largest, has 379 MB
_CHUNK_BYTES = 1 << 20
_SILENCE_S = 30.0
_PATIENCE_S = 3600.0


class Source:
    """Where official files come from: a base address and the schemes that may be followed."""

    def __init__(
        self, base_url: str = RELEASE_URL, schemes: frozenset[str] = frozenset({"https"})
    ) -> None:
        self.base_url = base_url
        self._schemes = schemes
        self._opener = urllib.request.build_opener(_Redirects(schemes))

    def fetch(self, file_name: str, target: IO[bytes], *, max_bytes: int) -> None:
        """Write a file's bytes to `target`. Raises Invalid, TooLarge or Unavailable."""
        url = f"{self.base_url}/{file_name}"
        _refuse_scheme(url, self._schemes)
        deadline_s = time.monotonic() + _PATIENCE_S
        size_bytes = 0
        try:
            with self._opener.open(url, timeout=_SILENCE_S) as answer:
                while chunk := answer.read(_CHUNK_BYTES):
                    size_bytes += len(chunk)
                    if size_bytes > max_bytes:
                        raise TooLarge(f"{url} has more than {max_bytes} bytes")
                    if time.monotonic() > deadline_s:
                        raise Unavailable(f"{url} takes more than an hour; try again later")
                    target.write(chunk)
                announced = answer.headers.get("Content-Length")
        except (OSError, urllib.error.URLError) as error:
            raise Unavailable(f"{url} cannot be fetched: {error}") from error
        if announced is not None and announced.isdigit() and int(announced) != size_bytes:
            raise Unavailable(f"{url} broke off after {size_bytes} of {announced} bytes")


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Follows a redirect only to a scheme that may be followed."""

    def __init__(self, schemes: frozenset[str]) -> None:
        self._schemes = schemes

    def redirect_request(
        self,
        req: urllib.request.Request,
        fp: IO[bytes],
        code: int,
        msg: str,
        headers: HTTPMessage,
        newurl: str,
    ) -> urllib.request.Request | None:
        """Refuse other schemes."""
        _refuse_scheme(newurl, self._schemes)
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _refuse_scheme(url: str, schemes: frozenset[str]) -> None:
    scheme = urlsplit(url).scheme
    if scheme not in schemes:
        raise Invalid.field("url", f"{scheme or 'no scheme'} is not followed, only {min(schemes)}")


def pull_model(
    database: Database,
    storage: Storage,
    jobs: JobClient,
    name: str,
    *,
    source: Source | None = None,
    max_bytes: int = LARGEST_BYTES,
) -> service.AddedModel:
    """Fetch an official model, check it against its recorded SHA-256, and have it probed.

    Raises Invalid for a name that is not official or a file that differs, Unavailable when it
    cannot be fetched, TooLarge beyond the limit.
    """
    if name not in OFFICIAL:
        raise Invalid.field("name", f"there is no {name!r}; official are {', '.join(OFFICIAL)}")
    with tempfile.TemporaryFile() as copy:
        (source or Source()).fetch(OFFICIAL[name], copy, max_bytes=max_bytes)
        _refuse_other_bytes(database, name, copy)
        file = service.store_file(storage, copy, max_bytes=max_bytes)
    with database.writing() as session:
        added = service.add_model(session, jobs, file, name=name, family="yolox")
        if added.created:
            record(session, None, "pull", "model", added.model.id, name=name, sha256=file.sha256)
    return added


def _refuse_other_bytes(database: Database, name: str, copy: IO[bytes]) -> None:
    """Raise Conflict when a file is not what was recorded; leaves the stream at its beginning."""
    digest = hashlib.sha256()
    copy.seek(0)
    while chunk := copy.read(_CHUNK_BYTES):
        digest.update(chunk)
    copy.seek(0)
    with database.reading() as session:
        known_sha256 = PINNED_SHA256.get(name) or repository.first_pulled_sha256(session, name)
    if known_sha256 not in {None, digest.hexdigest()}:
        raise Conflict(
            f"{name} has SHA-256 {digest.hexdigest()}, but {known_sha256} was recorded; "
            "it is not added"
        )
