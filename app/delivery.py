"""Sending bytes that came from outside: as what they are, and as nothing else.

Our own media type, `nosniff` and a sandboxing policy keep a disguised page from running. The bytes
behind an id never change, so browsers may keep them; one range at a time may be asked for.
"""

import re
from collections.abc import Iterator
from typing import IO

from fastapi import Request, Response
from fastapi.responses import StreamingResponse

from app.errors import AppError
from app.storage import CHUNK_BYTES

RANGE = re.compile(r"bytes=(\d{0,15})-(\d{0,15})")


class RangeRefused(AppError):  # noqa: N818  named after the answer, as in errors.py
    """416: the part asked for does not exist, or more than one was asked for."""

    status = 416
    title = "Range not satisfiable"


def immutable_headers(etag: str, disposition: str) -> dict[str, str]:
    """Return the headers of bytes that never change and came from outside."""
    return {
        "ETag": etag,
        "Cache-Control": "private, max-age=31536000, immutable",
        "Content-Disposition": disposition,
        "Content-Security-Policy": "sandbox",
        "X-Content-Type-Options": "nosniff",
    }


def is_known(request: Request, etag: str) -> bool:
    """Whether the caller already has these bytes (If-None-Match)."""
    tags = request.headers.get("if-none-match", "")
    return tags.strip() == "*" or etag in {
        tag.strip().removeprefix("W/") for tag in tags.split(",")
    }


def not_modified(headers: dict[str, str]) -> Response:
    """Answer 304."""
    return Response(status_code=304, headers=headers)


def send_stream(
    stream: IO[bytes],
    part: tuple[int, int] | None,
    size_bytes: int,
    media_type: str,
    headers: dict[str, str],
) -> Response:
    """Send a file, or the part of it from the first to the last byte, in chunks."""
    headers = headers | {"Accept-Ranges": "bytes"}
    if part is None:
        first, last, status = 0, size_bytes - 1, 200
    else:
        first, last, status = *part, 206
        headers["Content-Range"] = f"bytes {first}-{last}/{size_bytes}"
    headers["Content-Length"] = str(last - first + 1)
    return StreamingResponse(
        _chunks(stream, first, last - first + 1),
        status_code=status,
        media_type=media_type,
        headers=headers,
    )


def wanted_part(request: Request, size_bytes: int, etag: str) -> tuple[int, int] | None:
    """Return the first and last byte asked for; None for all of them. Raises RangeRefused (416)."""
    wanted = request.headers.get("range")
    if wanted is None or request.headers.get("if-range", etag) != etag:
        return None
    if "," in wanted:
        raise _refused("ask for one range at a time", size_bytes)
    found = RANGE.fullmatch(wanted.strip())
    if found is None or found.group(0) == "bytes=-":
        return None
    first, last = found.groups()
    if not first:
        begin, end = max(0, size_bytes - int(last)), size_bytes - 1
    else:
        begin, end = int(first), min(int(last) if last else size_bytes, size_bytes - 1)
    if begin > end or (last and first and int(last) < int(first)):
        raise _refused(f"there are {size_bytes} bytes", size_bytes)
    return begin, end


def _refused(reason: str, size_bytes: int) -> RangeRefused:
    return RangeRefused(reason, headers={"Content-Range": f"bytes */{size_bytes}"})


def _chunks(stream: IO[bytes], first: int, count: int) -> Iterator[bytes]:
    with stream:
        stream.seek(first)
        while count > 0 and (chunk := stream.read(min(CHUNK_BYTES, count))):
            count -= len(chunk)
            yield chunk
