"""AIS: what other features, the worker and the command line may ask for.

`readable` is the set of sites that a caller may read, None for all; shared rows are for everybody.
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import IO, Any

from sqlalchemy.orm import Session

from app.ais import import_repository, repository
from app.ais.area import Area
from app.ais.importing import (
    Imported,
    Importer,
    Source,
    import_recording,
    known_file,
    tidy_up,
)
from app.ais.recording import Recording
from app.ais.reports import ReportWindow, reports_between
from app.ais.summary import RecordingSummary
from app.ais.track import segments
from app.db import Database
from app.domain.accounting import Accounting
from app.domain.rejects import Reject
from app.domain.table_mapping import TableMapping
from app.errors import NotFound
from app.paging import Paging
from app.storage import Storage
from app.tables.ais import AisFile, AisPosition, AisStatic, Vessel

__all__ = [
    "Area",
    "Imported",
    "Importer",
    "PositionFilter",
    "ReportWindow",
    "Source",
    "Track",
    "get_file",
    "get_vessel",
    "import_ais_file",
    "import_recording",
    "inspect",
    "known_file",
    "latest_positions",
    "latest_statics",
    "list_files",
    "list_positions",
    "list_vessels",
    "newest_files",
    "remove_files",
    "reports_between",
    "tidy_up",
    "track",
]

Readable = frozenset[int] | None
LARGEST_MMSI = 999_999_999
LONGEST_TRACK = 20_000  # positions
DEFAULT_MAX_BYTES = 1 << 30
NO_FILE = "there is no such AIS file"
NO_VESSEL = "there is no such vessel"


@dataclass(frozen=True, slots=True)
class PositionFilter:
    """Which positions are wanted; None wants all."""

    mmsi: int | None = None
    start: datetime | None = None
    end: datetime | None = None
    area: Area | None = None


@dataclass(frozen=True, slots=True)
class Track:
    """A vessel's last positions in a time window, oldest first, in unbroken pieces."""

    mmsi: int
    pieces: list[list[AisPosition]]
    truncated: bool


def import_ais_file(
    database: Database,
    storage: Storage,
    source: Path | IO[bytes],
    *,
    site_id: int | None,
    file_name: str,
    max_bytes: int = DEFAULT_MAX_BYTES,
    mapping: TableMapping | None = None,
) -> Imported:
    """Import a recording: a path or a seekable stream of bytes, for a site or (None) for all.

    See `import_recording`.
    """
    with ExitStack() as stack:
        stream = stack.enter_context(source.open("rb")) if isinstance(source, Path) else source
        return import_recording(
            database, storage, Source(stream, file_name, max_bytes, mapping), Importer(site_id)
        )


def inspect(
    paths: Sequence[Path],
    *,
    max_bytes: int = DEFAULT_MAX_BYTES,
    mapping: TableMapping | None = None,
    on_reject: Callable[[str, Reject], None] | None = None,
) -> dict[str, Any]:
    """Decode recordings without storing: the sums of all, the vessels, the first and last moment.

    Returns `{"lines", "sentences", "messages", "vessels", "first", "last", "formats",
    "left_out"}`, the last of them the entries of archives that are no recordings. `on_reject` hears
    of each line that is not taken. Raises Invalid for what is no recording.
    """
    accounting = Accounting()
    summary = RecordingSummary()
    formats = set()
    left_out = []
    for path in paths:
        with path.open("rb") as stream:
            recording = Recording(stream, max_bytes=max_bytes, mapping=mapping, on_reject=on_reject)
            for report in recording.reports():
                summary.add(report)
            accounting.add(recording.accounting)
            formats.add(recording.format)
            left_out += [
                {"file": path.name, "entry": left.entry, "reason": left.reason}
                for left in recording.left_out
            ]
    return {
        **accounting.as_dict(),
        "vessels": summary.vessel_count,
        "first": _iso(summary.first),
        "last": _iso(summary.last),
        "formats": sorted(formats),
        "left_out": left_out,
    }


def list_files(
    session: Session, readable: Readable, paging: Paging, *, site_id: int | None = None
) -> tuple[Sequence[AisFile], str | None]:
    """Return a part of the list of files, oldest first, and the next cursor."""
    return repository.files(session, readable, paging, site_id=site_id)


def newest_files(session: Session, readable: Readable, count: int) -> Sequence[AisFile]:
    """Return the files imported last, newest first."""
    return repository.newest_files(session, readable, count)


def get_file(session: Session, readable: Readable, file_id: int) -> AisFile:
    """Return a file. Raises NotFound, also for one of a site that the caller may not read."""
    file = repository.file(session, readable, file_id)
    if file is None:
        raise NotFound(NO_FILE)
    return file


def remove_files(database: Database, file_ids: Iterable[int]) -> None:
    """Remove recordings for good, their rows in short transactions, so that nobody waits."""
    for file_id in file_ids:
        while True:
            with database.writing() as session:
                if import_repository.remove_some(session, file_id):
                    break


def list_positions(
    session: Session, readable: Readable, paging: Paging, wanted: PositionFilter
) -> tuple[Sequence[AisPosition], str | None]:
    """Return a part of the list of positions, in the order they were stored."""
    return repository.positions(
        session,
        readable,
        paging,
        mmsi=wanted.mmsi,
        start=wanted.start,
        end=wanted.end,
        area=wanted.area,
    )


def list_vessels(
    session: Session, readable: Readable, paging: Paging, search: str = ""
) -> tuple[Sequence[Vessel], str | None]:
    """Return a part of the list of vessels by MMSI; `search` looks into names and call signs."""
    return repository.vessels(session, readable, paging, search.strip())


def get_vessel(session: Session, readable: Readable, mmsi: int) -> Vessel:
    """Return a vessel as last heard of. Raises NotFound."""
    vessel = repository.vessel(session, readable, mmsi) if 0 < mmsi <= LARGEST_MMSI else None
    if vessel is None:
        raise NotFound(NO_VESSEL)
    return vessel


def latest_positions(
    session: Session, readable: Readable, mmsi: int, count: int
) -> Sequence[AisPosition]:
    """Return a vessel's last positions, newest first."""
    return repository.latest_positions(session, readable, mmsi, start=None, end=None, count=count)


def latest_statics(
    session: Session, readable: Readable, mmsi: int, count: int
) -> Sequence[AisStatic]:
    """Return a vessel's last static reports, newest first."""
    return repository.latest_statics(session, readable, mmsi, count)


def track(
    session: Session, readable: Readable, mmsi: int, start: datetime | None, end: datetime | None
) -> Track:
    """Return a vessel's track; of a very long one the latest part. Raises NotFound."""
    get_vessel(session, readable, mmsi)
    newest_first = repository.latest_positions(
        session, readable, mmsi, start=start, end=end, count=LONGEST_TRACK + 1
    )
    kept = newest_first[:LONGEST_TRACK]
    return Track(mmsi, segments(reversed(kept)), truncated=len(newest_first) > LONGEST_TRACK)


def _iso(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat().replace("+00:00", "Z")
