"""Writing a recording's rows: as many a second as the database takes.

Both ways go past the ORM: driver tuples on SQLite, COPY on Postgres. A fix that another recording,
or another part of this one, brought already is left out and counted by its absence; repeats within
one part are the decoder's business, which knows the payloads. So a fix counts as known only if its
row was there before its part began. Rows of a recording that is being written at the same time do
not count, because they may go again: of two such, who ends later takes out what both have.
"""

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import psycopg
import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, aliased

from app.ais.postgres_rows import copy_of
from app.ais.rows import POSITION_COLUMNS, STATIC_COLUMNS, Row, arrays_of, text_of
from app.ais.sqlite_image import TABLE, database_image
from app.db import Database
from app.domain.ais_bulk import ACCURACIES, AIS_CLASSES, SOURCES, PositionTable
from app.domain.cells import HOUR_US
from app.domain.nmea_times import moment_of
from app.tables.ais import AisFile, AisPosition, AisStatic, Vessel

_BEGIN_AND_END_LOCK = 0x4149_5303  # "AIS": any number of ours that no other lock has
_ROWS_REMOVED_AT_ONCE = 20_000
_VESSELS_AT_ONCE = 1_000

_POSITIONS = f"ais_positions ({', '.join(POSITION_COLUMNS)}, site_id, file_id)"
_STATICS = f"ais_statics ({', '.join(STATIC_COLUMNS)}, site_id, file_id)"
# What is the same in all rows stands in the statements, as numbers: it need not be bound.
_COUNTS_AS_KNOWN = """
    known.id <= {last_id} AND coalesce(known.site_id, 0) = coalesce({site_id}, 0)
    AND coalesce(known.file_id, 0) <= {file_id} AND coalesce(known.file_id, 0) NOT IN ({others})
    AND coalesce(known.file_id, 0) NOT IN (SELECT id FROM ais_files WHERE deleted_at IS NOT NULL)
"""
_IS_TIME_KNOWN = """
SELECT EXISTS (SELECT 1 FROM ais_positions AS known {by_time}
    WHERE hour BETWEEN {hours} AND fix_time BETWEEN {mark} AND {mark} AND {counts})
"""
_KEEP = f"""
INSERT INTO {_POSITIONS} SELECT {{columns}}, {{site_id}}, {{file_id}} FROM {{arriving}}
"""  # noqa: S608  made of the pieces above
_UNLESS_KNOWN = f"""
WHERE NOT EXISTS (
    SELECT 1 FROM ais_positions AS known
    WHERE known.mmsi = arriving.mmsi AND known.fix_time = arriving.fix_time
        AND known.lat_deg = arriving.lat_deg AND known.lon_deg = arriving.lon_deg
        AND {_COUNTS_AS_KNOWN}
)
"""  # noqa: S608  made of the pieces above
_SQLITE_STATICS = f"""
INSERT INTO {_STATICS} VALUES ({", ".join("?" for _ in STATIC_COLUMNS)}, {{site_id}}, {{file_id}})
"""  # noqa: S608  made of the pieces above
_SQLITE_CACHE = "PRAGMA cache_size = -65536"  # KiB, while rows are written; else SQLite's own
_SQLITE_CACHE_AFTER = "PRAGMA cache_size = -2000"


def _read() -> str:
    """Return the columns of rows that arrive on SQLite, with words in the place of their codes."""
    words = {
        "ais_class": AIS_CLASSES,
        "high_accuracy": ACCURACIES,
        "fix_time_source": [source.value for source in SOURCES],
    }
    columns = []
    for name in POSITION_COLUMNS:
        cases = " ".join(
            f"WHEN {code} THEN {word!r}"
            for code, word in enumerate(words.get(name, ()))
            if word is not None
        )
        columns.append(f"CASE {name} {cases} END" if cases else name)
    return ", ".join(columns)


_READ = _read()
_POSTGRES_ZONE = "SET LOCAL TIME ZONE 'UTC'"  # the rows' moments do not tell theirs
_ARRIVING = """
CREATE TEMPORARY TABLE arriving ON COMMIT DROP AS SELECT * FROM ais_positions LIMIT 0
"""
_INTO_ARRIVING = _POSITIONS.replace("ais_positions", "arriving")


@dataclass(frozen=True, slots=True)
class Origin:
    """Where rows come from: the file, for which site, when it was read, and which part of it.

    `others` are the files that were being written when this one began, `last_id` is the last
    position's id before the part began.
    """

    site_id: int | None
    file_id: int
    read_at: datetime
    others: Sequence[int] = ()
    last_id: int = 0

    def told_in(self, statement: str, **names: str) -> str:
        """Return a statement with these numbers, and the names it leaves open."""
        return statement.format(
            **names,
            site_id="NULL" if self.site_id is None else self.site_id,
            file_id=self.file_id,
            others=", ".join(map(str, self.others)) or "-1",
            last_id=self.last_id,
        )


def take_turn(session: Session) -> None:
    """Let imports begin and end one after the other; on SQLite every writer does."""
    if not _is_sqlite(session):
        session.execute(sa.select(sa.func.pg_advisory_xact_lock(_BEGIN_AND_END_LOCK)))


def is_being_written(session: Session, sha256: str, site_id: int | None) -> bool:
    """Whether a file with these bytes is unfinished."""
    same = sa.func.coalesce(AisFile.site_id, 0) == (site_id or 0)
    found = sa.select(AisFile.id).where(AisFile.sha256 == sha256, same, ~AisFile.is_whole)
    return session.scalar(found) is not None


def add_file(session: Session, values: Mapping[str, Any]) -> int:
    """Add the row of a file that nobody sees before `show_file`; return its id."""
    file = AisFile(**values, is_whole=False)
    session.add(file)
    session.flush()
    return file.id


def show_file(session: Session, file_id: int, values: Mapping[str, Any]) -> AisFile:
    """Show a file, with what is known of it now that all its rows are there."""
    file = session.get_one(AisFile, file_id)
    for name, value in values.items():
        setattr(file, name, value)
    file.is_whole = True
    return file


def unfinished(session: Session) -> Sequence[int]:
    """Return the files that are being written, or whose import did not end."""
    return session.scalars(sa.select(AisFile.id).where(~AisFile.is_whole)).all()


def remove_some(session: Session, file_id: int) -> bool:
    """Remove some rows of a file, and the file itself once there are none; return whether it is."""
    for table in (AisPosition, AisStatic):
        some = sa.select(table.id).where(table.file_id == file_id).limit(_ROWS_REMOVED_AT_ONCE)
        result = session.connection().execute(sa.delete(table).where(table.id.in_(some)))
        if result.rowcount:
            return False
    session.execute(sa.delete(AisFile).where(AisFile.id == file_id))
    return True


def last_position_id(session: Session) -> int:
    """Return the id of the position that was stored last, 0 without any."""
    return session.scalar(sa.select(sa.func.coalesce(sa.func.max(AisPosition.id), 0))) or 0


@dataclass(frozen=True, slots=True)
class Arriving:
    """Positions on their way, and on SQLite the database in memory that they arrive as."""

    table: PositionTable
    image: bytes


def arriving(database: Database, table: PositionTable) -> Arriving:
    """Return positions as the database takes them: made while others may still write."""
    return Arriving(table, database_image(arrays_of(table)) if database.is_sqlite else b"")


def add_positions(session: Session, origin: Origin, positions: Arriving) -> int:
    """Add positions of a part; return how many were new."""
    is_known_time = origin.last_id > 0 and _is_time_known(session, origin, positions.table)
    if _is_sqlite(session):
        return _keep_on_sqlite(session, origin, positions.image, is_known_time=is_known_time)
    return _keep_on_postgres(session, origin, positions.table, is_known_time=is_known_time)


def add_statics(session: Session, origin: Origin, rows: Sequence[Row]) -> None:
    """Add static reports, in the order of `STATIC_COLUMNS`."""
    if not rows:
        return
    if _is_sqlite(session):
        _sqlite(session).executemany(origin.told_in(_SQLITE_STATICS), rows)
    else:
        whose = (origin.site_id, origin.file_id)
        _copy(session, f"COPY {_STATICS} FROM STDIN", [(*row, *whose) for row in rows])


def ended_meanwhile(
    session: Session, origin: Origin, first_at: datetime | None, last_at: datetime | None
) -> frozenset[int]:
    """Return the files of the same site and time that were written beside this one and ended."""
    if first_at is None or last_at is None:
        return frozenset()
    statement = sa.select(AisFile.id).where(
        AisFile.is_whole,
        (AisFile.id > origin.file_id) | AisFile.id.in_(origin.others),
        sa.func.coalesce(AisFile.site_id, 0) == (origin.site_id or 0),
        AisFile.first_at <= last_at,
        AisFile.last_at >= first_at,
    )
    return frozenset(session.scalars(statement))


def known_positions(
    session: Session, file_id: int, others: Iterable[int], after_id: int
) -> Sequence[int]:
    """Return some positions of a file that others have too, by id, those after an id."""
    known = aliased(AisPosition)
    is_known = sa.exists().where(
        known.mmsi == AisPosition.mmsi,
        known.fix_time == AisPosition.fix_time,
        known.lat_deg == AisPosition.lat_deg,
        known.lon_deg == AisPosition.lon_deg,
        sa.func.coalesce(known.file_id, 0).in_(others),
    )
    statement = sa.select(AisPosition.id).where(
        AisPosition.file_id == file_id, AisPosition.id > after_id, is_known
    )
    return session.scalars(statement.order_by(AisPosition.id).limit(_ROWS_REMOVED_AT_ONCE)).all()


def remove_positions(session: Session, ids: Sequence[int]) -> None:
    """Remove positions."""
    session.execute(sa.delete(AisPosition).where(AisPosition.id.in_(ids)))


def update_vessels(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add vessels, or bring known ones up to date: the later heard word counts, field by field."""
    insert = (sqlite if _is_sqlite(session) else postgresql).insert
    statement = insert(Vessel)
    new = statement.excluded
    is_later = new.last_seen_at >= Vessel.last_seen_at
    changes: dict[str, Any] = {
        column.key: sa.case(
            (is_later, sa.func.coalesce(new[column.key], column)),
            else_=sa.func.coalesce(column, new[column.key]),
        )
        for column in (
            Vessel.name,
            Vessel.callsign,
            Vessel.imo,
            Vessel.ship_type,
            Vessel.length_m,
            Vessel.width_m,
        )
    }
    changes["last_seen_at"] = sa.case((is_later, new.last_seen_at), else_=Vessel.last_seen_at)
    changes["first_seen_at"] = sa.case(
        (new.first_seen_at < Vessel.first_seen_at, new.first_seen_at), else_=Vessel.first_seen_at
    )
    statement = statement.on_conflict_do_update(index_elements=[Vessel.mmsi], set_=changes)
    for start in range(0, len(rows), _VESSELS_AT_ONCE):
        session.execute(statement, [dict(row) for row in rows[start : start + _VESSELS_AT_ONCE]])


def _is_sqlite(session: Session) -> bool:
    return session.get_bind().dialect.name == "sqlite"


def _is_time_known(session: Session, origin: Origin, table: PositionTable) -> bool:
    """Whether there is a known position of the time of some others.

    If not, as for most recordings, no row has to be looked up by itself.
    """
    is_sqlite = _is_sqlite(session)
    first_us, last_us = int(table.fix_us.min()), int(table.fix_us.max())
    statement = _IS_TIME_KNOWN.format(
        by_time="INDEXED BY ix_ais_positions_hour_cell_time" if is_sqlite else "",
        hours=f"{first_us // HOUR_US} AND {last_us // HOUR_US}",
        mark="?" if is_sqlite else "(%s::timestamp AT TIME ZONE 'UTC')",
        counts=origin.told_in(_COUNTS_AS_KNOWN),
    )
    moments = (text_of(moment_of(us)) for us in (first_us, last_us))
    bounds = (first_us, last_us) if is_sqlite else tuple(moments)
    return bool(session.connection().exec_driver_sql(statement, bounds).scalar())


def _keep_on_sqlite(session: Session, origin: Origin, image: bytes, *, is_known_time: bool) -> int:
    """Let rows arrive as a database in memory, and copy them out of it."""
    driver = _sqlite(session)
    if not any(name == "arriving" for _, name, _ in driver.execute("PRAGMA database_list")):
        driver.execute("ATTACH ':memory:' AS arriving")
    driver.deserialize(image, name="arriving")
    sa.event.listen(session, "after_commit", lambda _: driver.execute("DETACH arriving"), once=True)
    condition = _UNLESS_KNOWN if is_known_time else ""
    driver.execute(_SQLITE_CACHE)
    inserted = driver.execute(
        origin.told_in(_KEEP + condition, arriving=f"arriving.{TABLE} AS arriving", columns=_READ)
    ).rowcount
    driver.execute(_SQLITE_CACHE_AFTER)
    return inserted


def _keep_on_postgres(
    session: Session, origin: Origin, table: PositionTable, *, is_known_time: bool
) -> int:
    rows = copy_of(table, origin.site_id, origin.file_id)
    if not is_known_time:
        _copy(session, f"COPY {_POSITIONS} FROM STDIN (FORMAT BINARY)", rows)
        return len(table)
    connection = session.connection()
    connection.exec_driver_sql(_ARRIVING)
    _copy(session, f"COPY {_INTO_ARRIVING} FROM STDIN (FORMAT BINARY)", rows)
    keep = origin.told_in(
        _KEEP + _UNLESS_KNOWN, arriving="arriving", columns=", ".join(POSITION_COLUMNS)
    )
    return connection.exec_driver_sql(keep).rowcount


def _sqlite(session: Session) -> sqlite3.Connection:
    return session.connection().connection.driver_connection  # type: ignore[return-value]  # as the engine is SQLite's


def _copy(session: Session, statement: str, rows: Iterable[bytes] | Iterable[Row]) -> None:
    connection = session.connection()
    connection.exec_driver_sql(_POSTGRES_ZONE)
    driver: psycopg.Connection[Any] = connection.connection.driver_connection  # type: ignore[assignment]  # as the engine is psycopg's
    with driver.cursor() as cursor, cursor.copy(statement) as copy:
        for some in rows:
            if isinstance(some, bytes):
                copy.write(some)
            else:
                copy.write_row(some)
