"""Importing a recording: decode first, then write all of it or nothing.

The same bytes for the same site are one file, however often and however concurrently they come.
Fixes that another recording, or an earlier part of the same archive, brought already count as
duplicates in the file's accounting, so that its sums stay exact and say what is new.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import IO, Any

from sqlalchemy.orm import Session

from app.ais import import_repository, repository
from app.ais.recording import Recording
from app.ais.spool import ReportSpool, in_range, printable
from app.ais.summary import RecordingSummary
from app.db import Database
from app.domain.accounting import Accounting
from app.errors import NotFound
from app.storage import Storage
from app.tables.ais import AisFile

_LONGEST_FILE_NAME = 255
_CHUNK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Decoded:
    """A recording decoded and waiting on the disk to be stored."""

    sha256: str
    size_bytes: int
    file_name: str
    format: str
    accounting: Accounting
    summary: RecordingSummary
    spool: ReportSpool


@dataclass(frozen=True, slots=True)
class Imported:
    """A file's row, and whether this import made it."""

    file: AisFile
    created: bool


def known_file(database: Database, stream: IO[bytes], site_id: int | None) -> AisFile | None:
    """Return the file with these bytes if it was imported for this site before."""
    stream.seek(0)
    digest = hashlib.sha256()
    while chunk := stream.read(_CHUNK_BYTES):
        digest.update(chunk)
    sha256 = digest.hexdigest()
    with database.reading() as session:
        return repository.file_of_content(session, sha256, site_id)


@contextmanager
def decoded(
    storage: Storage, stream: IO[bytes], file_name: str, *, max_bytes: int
) -> Iterator[Decoded]:
    """Decode a recording and keep its bytes; its rows are on the disk while the block lasts.

    Raises Invalid for what is no recording, TooLarge for one beyond `max_bytes` of text or for an
    archive made to harm; nothing is kept then.
    """
    with ReportSpool() as spool:
        recording = Recording(stream, max_bytes=max_bytes)
        summary = RecordingSummary()
        for reports in recording.parts():
            for report in reports:
                spool.add(report)
                summary.add(report)
            spool.end_part()
        stream.seek(0)
        stored = storage.put_stream(stream)
        yield Decoded(
            sha256=stored.sha256,
            size_bytes=stored.size_bytes,
            file_name=printable(file_name, _LONGEST_FILE_NAME) or "recording",
            format=recording.format,
            accounting=recording.accounting,
            summary=summary,
            spool=spool,
        )


def store(
    session: Session, recording: Decoded, *, site_id: int | None, user_id: int | None
) -> Imported:
    """Write a decoded recording in the session's transaction, unless its bytes are known."""
    summary = recording.summary
    file_id = import_repository.add_file(
        session,
        {
            "site_id": site_id,
            "sha256": recording.sha256,
            "file_name": recording.file_name,
            "format": recording.format,
            "size_bytes": recording.size_bytes,
            "accounting": {},
            "first_at": summary.first,
            "last_at": summary.last,
            "created_by_id": user_id,
        },
    )
    if file_id is not None:
        _store_reports(session, recording, site_id, file_id)
    file = repository.file_of_content(session, recording.sha256, site_id)
    if file is None:
        raise NotFound("the file was deleted while it was imported again")
    return Imported(file, created=file_id is not None)


def _store_reports(session: Session, recording: Decoded, site_id: int | None, file_id: int) -> None:
    messages = recording.accounting.messages
    spool = recording.spool
    new = sum(
        import_repository.add_positions(session, site_id, file_id, batches)
        for batches in spool.positions.parts()
    )
    messages.duplicates += messages.positions - new
    messages.positions = new
    for batches in spool.statics.parts():
        import_repository.add_statics(session, site_id, file_id, batches)
    import_repository.update_vessels(session, vessel_rows(recording.summary))
    import_repository.set_accounting(
        session,
        file_id,
        {**recording.accounting.as_dict(), "vessels": len(recording.summary.vessels)},
    )


def vessel_rows(summary: RecordingSummary) -> list[dict[str, Any]]:
    """Return the vessels of a recording as rows, in the order that keeps two writers apart."""
    rows = []
    for mmsi, vessel in sorted(summary.vessels.items()):
        values = asdict(vessel)
        del values["said_at"]
        values["name"] = printable(vessel.name, 64)
        values["callsign"] = printable(vessel.callsign, 16)
        values["imo"] = in_range(vessel.imo)
        values["ship_type"] = in_range(vessel.ship_type)
        rows.append({"mmsi": mmsi, **values})
    return rows
