"""Importing a recording: its rows are written while it is decoded, and show when it is whole.

The same bytes for the same site are one file, however often and however concurrently they come.
What another recording, or an earlier part of the same archive, brought already counts as duplicates
in the file's accounting, so that its sums stay exact and say what is new. Rows are written in short
transactions, hidden by the state of their file until the last of these. Between them nothing is
locked: another import writes its rows while this one decodes. What a failure leaves is removed at
once, what a dead process left before an import begins that is alone.
"""

import hashlib
import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import IO, Any

import structlog
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from app.ais import import_repository, repository
from app.ais.import_repository import Origin
from app.ais.recording import Recording, told_of
from app.ais.rows import RowBatch, in_range, printable
from app.ais.static_repository import remove_known_statics
from app.ais.summary import RecordingSummary
from app.ais.turn import importing, none_importing, turn_to_write
from app.db import Database, now
from app.domain.nmea_bulk import Decoded
from app.domain.table_mapping import TableMapping
from app.errors import Unavailable
from app.storage import Storage
from app.tables.ais import AisFile

log = structlog.get_logger()
_LONGEST_FILE_NAME = 255
_CHUNK_BYTES = 1 << 20
_REPORTS_TOLD = 20
_PAUSE_S = 0.05

Told = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Imported:
    """A file's row, and whether this import made it."""

    file: AisFile
    created: bool


@dataclass(frozen=True, slots=True)
class Importer:
    """For whom: a site or (None) all, by which user; `note` writes beside it what it has to.

    `wait_s` bounds how long to wait for another import of the same bytes, `told` hears how much of
    the recording is read, from 0 to 1, and may raise to stop the import.
    """

    site_id: int | None
    user_id: int | None = None
    note: Callable[[Session, AisFile], None] | None = None
    wait_s: float | None = None
    told: Told | None = None


@dataclass(frozen=True, slots=True)
class Source:
    """A recording's bytes, its name, how much text it may hold, how its tables are to be read."""

    stream: IO[bytes]
    file_name: str
    max_bytes: int
    mapping: TableMapping | None = None


def known_file(database: Database, stream: IO[bytes], site_id: int | None) -> AisFile | None:
    """Return the file with these bytes if it was imported for this site before."""
    sha256, _ = _content(stream)
    with database.reading() as session:
        return repository.file_of_content(session, sha256, site_id)


def import_recording(
    database: Database, storage: Storage, source: Source, importer: Importer
) -> Imported:
    """Import a seekable stream, its tables read by a mapping: all of it, or in the end nothing.

    The same bytes again change nothing. Raises Invalid for what is no recording, TooLarge beyond
    `max_bytes` of text or for an archive made to harm, Unavailable while somebody else imports the
    same bytes for longer than the importer waits.
    """
    sha256, size_bytes = _content(source.stream)
    values = {
        "site_id": importer.site_id,
        "sha256": sha256,
        "file_name": printable(source.file_name, _LONGEST_FILE_NAME) or "recording",
        "format": "",
        "size_bytes": size_bytes,
        "accounting": {},
        "mapping": source.mapping.as_dict() if source.mapping else None,
        "created_at": now(),
        "created_by_id": importer.user_id,
    }
    deadline = None if importer.wait_s is None else time.monotonic() + importer.wait_s
    while deadline is None or time.monotonic() < deadline:
        tidy_up(database)
        with importing(database):
            begun = _begun(database, values)
            if isinstance(begun, AisFile):
                return Imported(begun, created=False)
            if begun is not None:
                return Imported(_whole(database, storage, source, importer, begun), created=True)
        time.sleep(_PAUSE_S)  # without the lock, so that what a dead process left can be removed
    raise Unavailable("the same recording is being stored just now; try again soon")


def tidy_up(database: Database) -> None:
    """Remove what a dead process left, unless an import is under way; a later one does it then."""
    with none_importing(database) as is_alone:
        if not is_alone:
            return
        with database.reading() as session:
            left = import_repository.unfinished(session)
        for file_id in left:
            log.warning("removing an unfinished import", file_id=file_id)
            _remove(database, file_id)


def vessel_rows(summary: RecordingSummary) -> list[dict[str, Any]]:
    """Return the vessels of a recording as rows, in the order that keeps two writers apart."""
    return [
        {
            "mmsi": mmsi,
            "name": printable(vessel.name, 64),
            "callsign": printable(vessel.callsign, 16),
            "imo": in_range(vessel.imo),
            "ship_type": in_range(vessel.ship_type),
            "length_m": vessel.length_m,
            "width_m": vessel.width_m,
            "first_seen_at": vessel.first_seen_at,
            "last_seen_at": vessel.last_seen_at,
        }
        for mmsi, vessel in sorted(summary.vessels.items())
    ]


def _content(stream: IO[bytes]) -> tuple[str, int]:
    """Return the SHA-256 and the length of a stream."""
    stream.seek(0)
    digest = hashlib.sha256()
    while chunk := stream.read(_CHUNK_BYTES):
        digest.update(chunk)
    return digest.hexdigest(), stream.tell()


def _begun(database: Database, values: dict[str, Any]) -> Origin | AisFile | None:
    """Add a file that nobody sees; return the one with these bytes, None while it is written."""
    sha256, site_id = values["sha256"], values["site_id"]
    with database.writing() as session:
        import_repository.take_turn(session)
        known = repository.file_of_content(session, sha256, site_id)
        if known is not None:
            return known
        if import_repository.is_being_written(session, sha256, site_id):
            return None
        others = import_repository.unfinished(session)
        file_id = import_repository.add_file(session, values)
        return Origin(site_id, file_id, values["created_at"], others)


def _whole(
    database: Database, storage: Storage, source: Source, importer: Importer, origin: Origin
) -> AisFile:
    """Write a file and show it; where that fails, remove it."""
    try:
        recording = Recording(
            source.stream,
            max_bytes=source.max_bytes,
            mapping=source.mapping,
            read_at=origin.read_at,
        )
        summary = RecordingSummary()
        new = _stored(database, origin, _told(recording, source.stream, importer.told), summary)
        source.stream.seek(0)
        storage.put_stream(source.stream)
        return _shown(database, origin, recording, summary, new, importer)
    except BaseException:
        # What cannot be removed now is removed before the next import.
        with suppress(SQLAlchemyError):
            _remove(database, origin.file_id)
        raise


def _remove(database: Database, file_id: int) -> None:
    is_gone = False
    while not is_gone:
        with turn_to_write(database), database.writing() as session:
            is_gone = import_repository.remove_some(session, file_id)


def _stored(
    database: Database,
    origin: Origin,
    parts: Iterator[Iterator[Decoded]],
    summary: RecordingSummary,
) -> int:
    """Write the rows of all parts in short transactions; return how many positions were new."""
    new = 0
    for reports in parts:
        with database.reading() as session:
            part = replace(origin, last_id=import_repository.last_position_id(session))
        batch = RowBatch()
        for report in reports:
            summary.add(report)
            batch.add(report)
            if batch.is_full:
                new += _write(database, part, batch)
                batch = RowBatch()
        new += _write(database, part, batch)
    return new


def _write(database: Database, origin: Origin, batch: RowBatch) -> int:
    # Made before the turn: others may write meanwhile.
    table, statics = batch.positions(), batch.static_rows()
    positions = None if table is None else import_repository.arriving(database, table)
    with turn_to_write(database), database.writing() as session:
        import_repository.add_statics(session, origin, statics)
        if positions is None:
            return 0
        return import_repository.add_positions(session, origin, positions)


def _told(
    recording: Recording, stream: IO[bytes], told: Told | None
) -> Iterator[Iterator[Decoded]]:
    """Yield the recording's parts, telling now and then how much of it is read."""
    size_bytes = stream.seek(0, os.SEEK_END)
    for reports in recording.parts():
        yield reports if told is None else _telling(reports, stream, size_bytes, told)


def _telling(
    reports: Iterator[Decoded], stream: IO[bytes], size_bytes: int, told: Told
) -> Iterator[Decoded]:
    for count, report in enumerate(reports):
        if count % _REPORTS_TOLD == 0:
            told(min(1.0, stream.tell() / max(1, size_bytes)))
        yield report


def _shown(
    database: Database,
    origin: Origin,
    recording: Recording,
    summary: RecordingSummary,
    new: int,
    importer: Importer,
) -> AisFile:
    """Show a file to all, without the positions of those that ended before it."""
    vessels = vessel_rows(summary)
    first_at = min((vessel["first_seen_at"] for vessel in vessels), default=None)
    last_at = max((vessel["last_seen_at"] for vessel in vessels), default=None)
    compared: frozenset[int] = frozenset()
    while True:
        with database.writing() as session:
            import_repository.take_turn(session)
            others = import_repository.ended_meanwhile(session, origin, first_at, last_at)
            others -= compared
            if not others:
                messages = recording.accounting.messages
                messages.duplicates += messages.positions - new
                messages.positions = new
                known = remove_known_statics(session, origin.file_id, origin.site_id)
                known = min(
                    known, messages.statics
                )  # those of a position's row are none of their own
                messages.duplicates += known
                messages.statics -= known
                values = {
                    "format": recording.format,
                    "first_at": first_at,
                    "last_at": last_at,
                    "accounting": {
                        **recording.accounting.as_dict(),
                        "vessels": len(vessels),
                        "left_out": told_of(recording.left_out),
                    },
                }
                import_repository.update_vessels(session, vessels)
                file = import_repository.show_file(session, origin.file_id, values)
                if importer.note is not None:
                    importer.note(session, file)
                session.flush()
                return file
        new -= _removed(database, origin.file_id, others)
        compared |= others


def _removed(database: Database, file_id: int, others: frozenset[int]) -> int:
    """Remove the positions of a file that others have too; return how many."""
    count = last_id = 0
    while True:
        with database.reading() as session:
            known = import_repository.known_positions(session, file_id, others, last_id)
        if not known:
            return count
        with turn_to_write(database), database.writing() as session:
            import_repository.remove_positions(session, known)
        count, last_id = count + len(known), known[-1]
