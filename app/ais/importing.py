"""Importing a recording: decode first, then write it part by part; it shows when it is whole.

The same bytes for the same site are one file, however often and however concurrently they come.
Fixes that another recording, or an earlier part of the same archive, brought already count as
duplicates in the file's accounting, so that its sums stay exact and say what is new. Rows are
written in short transactions, hidden by the state of their file until the last of these; what a
failure or a dead process left is removed before the next import.
"""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from itertools import islice
from typing import IO, Any

import structlog
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from app.ais import import_repository, repository
from app.ais.recording import Recording
from app.ais.spool import ReportSpool, in_range, printable
from app.ais.summary import RecordingSummary
from app.ais.turn import import_turn
from app.db import Database
from app.domain.accounting import Accounting
from app.domain.table_mapping import TableMapping
from app.errors import Unavailable
from app.storage import Storage
from app.tables.ais import AisFile

log = structlog.get_logger()
_LONGEST_FILE_NAME = 255
_CHUNK_BYTES = 1 << 20
_REPORTS_TOLD = 20
_BATCHES_AT_ONCE = 2  # a transaction of some 10,000 rows keeps others waiting for a moment only

Told = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Decoded:
    """A recording decoded and waiting on the disk to be stored."""

    sha256: str
    size_bytes: int
    file_name: str
    format: str
    mapping: TableMapping | None
    read_at: datetime
    accounting: Accounting
    summary: RecordingSummary
    spool: ReportSpool


@dataclass(frozen=True, slots=True)
class Imported:
    """A file's row, and whether this import made it."""

    file: AisFile
    created: bool


@dataclass(frozen=True, slots=True)
class Importer:
    """For whom: a site or (None) all, by which user; `note` writes beside it what it has to.

    `wait_s` bounds how long to wait for another import, `told` hears how much of the rows is
    stored, from 0 to 1, and may raise to stop the import.
    """

    site_id: int | None
    user_id: int | None = None
    note: Callable[[Session, AisFile], None] | None = None
    wait_s: float | None = None
    told: Told | None = None


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
    storage: Storage,
    stream: IO[bytes],
    file_name: str,
    *,
    max_bytes: int,
    mapping: TableMapping | None = None,
    told: Callable[[], None] | None = None,
) -> Iterator[Decoded]:
    """Decode a recording and keep its bytes; its rows are on the disk while the block lasts.

    `told` is called now and then, and may raise to stop it.

    Raises Invalid for what is no recording, TooLarge for one beyond `max_bytes` of text or for an
    archive made to harm; nothing is kept then.
    """
    with ReportSpool() as spool:
        recording = Recording(stream, max_bytes=max_bytes, mapping=mapping)
        summary = RecordingSummary()
        for reports in recording.parts():
            for count, report in enumerate(reports):
                spool.add(report)
                summary.add(report)
                if told is not None and count % _REPORTS_TOLD == 0:
                    told()
            spool.end_part()
        stream.seek(0)
        stored = storage.put_stream(stream)
        yield Decoded(
            sha256=stored.sha256,
            size_bytes=stored.size_bytes,
            file_name=printable(file_name, _LONGEST_FILE_NAME) or "recording",
            format=recording.format,
            mapping=mapping,
            read_at=recording.read_at,
            accounting=recording.accounting,
            summary=summary,
            spool=spool,
        )


def store(database: Database, recording: Decoded, importer: Importer) -> Imported:
    """Write a decoded recording, unless its bytes are known: all of it, or in the end nothing.

    Raises Unavailable when other imports take longer than the importer waits.
    """
    with import_turn(database, wait_s=importer.wait_s):
        remove_unfinished(database)
        with database.writing() as session:
            known = repository.file_of_content(session, recording.sha256, importer.site_id)
            if known is not None:
                return Imported(known, created=False)
            file_id = import_repository.add_file(session, _file_values(recording, importer))
        try:
            return Imported(_stored(database, recording, importer, file_id), created=True)
        except BaseException:
            # What cannot be removed now is removed before the next import.
            with suppress(SQLAlchemyError):
                remove_unfinished(database)
            raise


def remove_unfinished(database: Database) -> None:
    """Remove what imports left that did not end; call it with the turn in hand."""
    with database.reading() as session:
        left = import_repository.unfinished(session)
    for file_id in left:
        log.warning("removing an unfinished import", file_id=file_id)
        is_gone = False
        while not is_gone:
            with database.writing() as session:
                is_gone = import_repository.remove_some(session, file_id)


def tidy_up(database: Database) -> None:
    """Remove what a killed process left, unless an import is under way; its end does it then."""
    with suppress(Unavailable), import_turn(database, wait_s=0.0):
        remove_unfinished(database)


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


def _file_values(recording: Decoded, importer: Importer) -> dict[str, Any]:
    return {
        "site_id": importer.site_id,
        "sha256": recording.sha256,
        "file_name": recording.file_name,
        "format": recording.format,
        "size_bytes": recording.size_bytes,
        "accounting": {},
        "mapping": recording.mapping.as_dict() if recording.mapping else None,
        "first_at": recording.summary.first,
        "last_at": recording.summary.last,
        "created_at": recording.read_at,
        "created_by_id": importer.user_id,
    }


def _stored(database: Database, recording: Decoded, importer: Importer, file_id: int) -> AisFile:
    """Write a file's rows in short transactions, and show them with the last."""
    messages, spool, site_id = recording.accounting.messages, recording.spool, importer.site_id
    total = max(1, messages.positions)
    new = done = 0
    for batches in spool.positions.parts():
        with database.reading() as session:
            last_id = import_repository.last_position_id(session)
        while some := list(islice(batches, _BATCHES_AT_ONCE)):
            with database.writing() as session:
                new += import_repository.add_positions(session, site_id, file_id, last_id, some)
            done += sum(map(len, some))
            if importer.told is not None:
                importer.told(done / total)
    for batches in spool.statics.parts():
        while some := list(islice(batches, _BATCHES_AT_ONCE)):
            with database.writing() as session:
                import_repository.add_statics(session, site_id, file_id, some)
    accounting = recording.accounting
    messages.duplicates += messages.positions - new
    messages.positions = new
    vessels = vessel_rows(recording.summary)
    counts = {**accounting.as_dict(), "vessels": len(vessels)}
    return _shown(database, importer, file_id, counts, vessels)


def _shown(
    database: Database,
    importer: Importer,
    file_id: int,
    counts: dict[str, Any],
    vessels: Sequence[dict[str, Any]],
) -> AisFile:
    with database.writing() as session:
        import_repository.update_vessels(session, vessels)
        file = import_repository.show_file(session, file_id, counts)
        if importer.note is not None:
            importer.note(session, file)
        session.flush()
        return file
