"""A file of a watched folder, as workers and the database speak of it."""

from typing import NamedTuple

from app.tables.live import WatchedFileStatus


class KnownFile(NamedTuple):
    """A file as it was when last looked at, and what became of it."""

    size_bytes: int
    modified_ns: int
    status: WatchedFileStatus
    reason: str | None = None
