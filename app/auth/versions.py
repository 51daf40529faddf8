"""Edits of shared objects say which version they are based on, so that none undoes another's.

A read answers with `ETag: "<version>"`; an edit sends it back in `If-Match`. Without the header the
answer is 428, with a stale one 412. A removal or a switch does what its caller wants of whatever is
there; `If-Match` may be left out, and is heeded where it is sent.
"""

from typing import Annotated

from fastapi import Depends, Header, Request, Response
from fastapi.params import Depends as Dependency

from app.errors import PreconditionFailed, PreconditionRequired


def etag(version: int) -> str:
    """Return the entity tag of a version."""
    return f'"{version}"'


def set_etag(response: Response, version: int) -> None:
    """Tell the reader which version it got."""
    response.headers["ETag"] = etag(version)


def heed_if_match(request: Request, version: int) -> None:
    """Compare versions where the caller sends one. Raises PreconditionFailed when it is stale."""
    if "if-match" in request.headers:
        check_if_match(request, version)


def check_if_match(request: Request, version: int) -> None:
    """Compare the edit's version with the present one.

    Raises PreconditionRequired when `If-Match` is missing, PreconditionFailed when it is stale.
    """
    header = request.headers.get("if-match")
    if header is None:
        raise PreconditionRequired(
            f"send `If-Match: {etag(version)}`, the ETag of the version that was read"
        )
    tags = {tag.strip().removeprefix("W/") for tag in header.split(",")}
    if etag(version) not in tags:
        raise PreconditionFailed(
            f"the present version is {etag(version)}; read it again, then repeat the edit"
        )


async def _take_if_match(
    if_match: Annotated[
        str | None,
        Header(description="The ETag of the version that the change is based on", examples=['"1"']),
    ] = None,
) -> None: ...


VERSIONED: Dependency = Depends(_take_if_match)
"""Declared by every route that reads `If-Match`, so that the OpenAPI document tells it."""
