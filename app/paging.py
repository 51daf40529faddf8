"""Lists come in pages: a limit, and a cursor that stands for "after this id".

Kept apart from the web framework, because repositories page and the worker uses repositories.
"""

from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Sequence
from typing import Generic, TypeVar

import sqlalchemy as sa
from pydantic import BaseModel
from sqlalchemy.orm import Session

from app.errors import Invalid

LARGEST_ID = 2**63 - 1
Item = TypeVar("Item")
Row = TypeVar("Row")


class Paging(BaseModel):
    """Which part of a list is wanted."""

    limit: int
    after: int | None


class Page(BaseModel, Generic[Item]):
    """A part of a list and the way to the next."""

    items: list[Item]
    next_cursor: str | None = None


def encode_cursor(last_id: int) -> str:
    """Return the opaque text that stands for "after this id"."""
    return urlsafe_b64encode(str(last_id).encode()).decode().rstrip("=")


def decode_cursor(cursor: str) -> int:
    """Return the id a cursor stands for. Raises Invalid for a text that is no cursor of ours."""
    try:
        last_id = int(urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)))
    except ValueError:
        last_id = -1
    if not 0 <= last_id <= LARGEST_ID:
        raise Invalid.field("cursor", "is not one of ours; leave it out to begin anew")
    return last_id


def fetch_page(
    session: Session,
    statement: sa.Select[Row],
    identifier: sa.ColumnElement[int] | sa.orm.InstrumentedAttribute[int],
    paging: Paging,
) -> tuple[Sequence[Row], str | None]:
    """Return a statement's rows in order of an id after the cursor, and the next cursor."""
    if paging.after is not None:
        statement = statement.where(identifier > sa.literal(paging.after, sa.BigInteger()))
    rows = session.scalars(statement.order_by(identifier).limit(paging.limit + 1)).all()
    if len(rows) <= paging.limit:
        return rows, None
    rows = rows[: paging.limit]
    return rows, encode_cursor(getattr(rows[-1], identifier.key or "id"))
