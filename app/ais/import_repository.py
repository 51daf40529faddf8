"""Writing a recording's rows: as many a second as the database takes.

Both ways go past the ORM: driver tuples on SQLite, COPY into a temporary table on Postgres. A fix
that another recording, or another part of this one, brought already is left out and counted by its
absence; repeats within one part are the decoder's business, which knows the payloads. So a fix
counts as known only if its row was there before its part began. Imports take turns (`turn`), so
that of two with the same fixes the second finds those of the first.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import psycopg
import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.tables.ais import AisFile, AisPosition, AisStatic, Vessel

Rows = Sequence[Sequence[tuple[Any, ...]]]

_ROWS_REMOVED_AT_ONCE = 20_000
_VESSELS_AT_ONCE = 1_000

# The numbers of `app.domain.cells`. To an integer SQLite truncates and Postgres rounds.
_SQLITE_INTO_POSITIONS = """
INSERT INTO ais_positions (mmsi, fix_time, received_at, lat_deg, lon_deg, sog_kn, cog_deg,
    heading_deg, rot_deg_min, message_type, ais_class, high_accuracy, fix_time_source, cell,
    site_id, file_id)
"""
_SQLITE_POSITION = """
    ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13,
    CAST((?4 + 90) * 20 AS INTEGER) * 7201 + CAST((?5 + 180) * 20 AS INTEGER),
    {site_id}, {file_id}
"""
_SQLITE_ALL_POSITIONS = f"{_SQLITE_INTO_POSITIONS} VALUES ({_SQLITE_POSITION})"
_SQLITE_NEW_POSITIONS = f"""{_SQLITE_INTO_POSITIONS} SELECT {_SQLITE_POSITION}
WHERE NOT EXISTS (
    SELECT 1 FROM ais_positions
    WHERE mmsi = ?1 AND fix_time = ?2 AND lat_deg = ?4 AND lon_deg = ?5
        AND coalesce(site_id, 0) = coalesce({{site_id}}, 0) AND id <= {{last_id}}
        AND coalesce(file_id, 0) NOT IN (SELECT id FROM ais_files WHERE deleted_at IS NOT NULL)
)
"""  # noqa: S608  made of the two pieces above
_SQLITE_KNOWN_MEANWHILE = """
SELECT EXISTS (
    SELECT 1 FROM ais_positions INDEXED BY ix_ais_positions_time
    WHERE fix_time BETWEEN ? AND ? AND id <= ?
)
"""
_SQLITE_CACHE = "PRAGMA cache_size = -32768"  # KiB, while rows are written; else SQLite's own
_SQLITE_CACHE_AFTER = "PRAGMA cache_size = -2000"
_SQLITE_STATICS = """
INSERT INTO ais_statics (site_id, file_id, mmsi, received_at, name, callsign, imo, ship_type,
    to_bow_m, to_stern_m, to_port_m, to_starboard_m, mothership_mmsi)
VALUES ({site_id}, {file_id}, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)
"""
_ARRIVING_POSITIONS = """
CREATE TEMPORARY TABLE IF NOT EXISTS arriving_positions (
    mmsi integer, fix_time timestamp, received_at timestamp, lat_deg double precision,
    lon_deg double precision, sog_kn double precision, cog_deg double precision,
    heading_deg double precision, rot_deg_min double precision, message_type integer,
    ais_class varchar(1), high_accuracy boolean, fix_time_source varchar(16)
) ON COMMIT DROP
"""
_KEEP_POSITIONS = """
INSERT INTO ais_positions (site_id, file_id, mmsi, fix_time, received_at, lat_deg,
    lon_deg, sog_kn, cog_deg, heading_deg, rot_deg_min, message_type, ais_class, high_accuracy,
    fix_time_source, cell)
SELECT %(site_id)s::integer, %(file_id)s::integer, mmsi, fix_time AT TIME ZONE 'UTC',
    received_at AT TIME ZONE 'UTC', lat_deg, lon_deg, sog_kn, cog_deg, heading_deg, rot_deg_min,
    message_type, ais_class, high_accuracy, fix_time_source,
    floor((lat_deg + 90) * 20)::integer * 7201 + floor((lon_deg + 180) * 20)::integer
FROM arriving_positions AS arriving
WHERE NOT EXISTS (
    SELECT 1 FROM ais_positions AS known
    WHERE known.mmsi = arriving.mmsi AND known.fix_time = arriving.fix_time AT TIME ZONE 'UTC'
        AND known.lat_deg = arriving.lat_deg AND known.lon_deg = arriving.lon_deg
        AND coalesce(known.site_id, 0) = coalesce(%(site_id)s::integer, 0)
        AND known.id <= %(last_id)s::bigint
        AND coalesce(known.file_id, 0)
            NOT IN (SELECT id FROM ais_files WHERE deleted_at IS NOT NULL)
)
"""
_ARRIVING_STATICS = """
CREATE TEMPORARY TABLE IF NOT EXISTS arriving_statics (
    mmsi integer, received_at timestamp, name varchar(64), callsign varchar(16), imo integer,
    ship_type integer, to_bow_m double precision, to_stern_m double precision,
    to_port_m double precision, to_starboard_m double precision, mothership_mmsi integer
) ON COMMIT DROP
"""
_KEEP_STATICS = """
INSERT INTO ais_statics (site_id, file_id, mmsi, received_at, name, callsign, imo, ship_type,
    to_bow_m, to_stern_m, to_port_m, to_starboard_m, mothership_mmsi)
SELECT %(site_id)s::integer, %(file_id)s::integer, mmsi, received_at AT TIME ZONE 'UTC', name,
    callsign, imo, ship_type, to_bow_m, to_stern_m, to_port_m, to_starboard_m, mothership_mmsi
FROM arriving_statics
"""
_EMPTY_POSITIONS = "TRUNCATE arriving_positions"
_EMPTY_STATICS = "TRUNCATE arriving_statics"
_COPY_POSITIONS = "COPY arriving_positions FROM STDIN"
_COPY_STATICS = "COPY arriving_statics FROM STDIN"


def add_file(session: Session, values: Mapping[str, Any]) -> int:
    """Add the row of a file that nobody sees before `show_file`; return its id."""
    file = AisFile(**values, is_whole=False)
    session.add(file)
    session.flush()
    return file.id


def show_file(session: Session, file_id: int, accounting: Mapping[str, Any]) -> AisFile:
    """Show a file, with what became of every line, now that all its rows are there."""
    file = session.get_one(AisFile, file_id)
    file.accounting, file.is_whole = dict(accounting), True
    return file


def unfinished(session: Session) -> Sequence[int]:
    """Return the files whose import did not end."""
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


def add_positions(
    session: Session, site_id: int | None, file_id: int, last_id: int, rows: Rows
) -> int:
    """Add positions of a part, in the order of `spool`'s tuples; return how many were not known.

    `last_id` is the last position's id before the part began.
    """
    if _is_sqlite(session):
        is_overlap = last_id > 0 and _is_known_meanwhile(session, last_id, rows)
        statement = _SQLITE_NEW_POSITIONS if is_overlap else _SQLITE_ALL_POSITIONS
        return _insert_on_sqlite(session, statement, site_id, file_id, rows, last_id=last_id)
    return _copy_on_postgres(
        session,
        (_ARRIVING_POSITIONS, _EMPTY_POSITIONS, _COPY_POSITIONS, _KEEP_POSITIONS),
        {"site_id": site_id, "file_id": file_id, "last_id": last_id},
        rows,
    )


def add_statics(session: Session, site_id: int | None, file_id: int, rows: Rows) -> int:
    """Add a part's static reports, in the order of `spool`'s tuples; return how many."""
    if _is_sqlite(session):
        return _insert_on_sqlite(session, _SQLITE_STATICS, site_id, file_id, rows)
    return _copy_on_postgres(
        session,
        (_ARRIVING_STATICS, _EMPTY_STATICS, _COPY_STATICS, _KEEP_STATICS),
        {"site_id": site_id, "file_id": file_id},
        rows,
    )


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


def _is_known_meanwhile(session: Session, last_id: int, rows: Rows) -> bool:
    """Whether positions up to `last_id` are of the time of the rows.

    If not, as for most recordings, no row has to be looked up by itself.
    """
    moments = [row[1] for batch in rows for row in batch]
    found = session.connection().exec_driver_sql(
        _SQLITE_KNOWN_MEANWHILE, (min(moments), max(moments), last_id)
    )
    return bool(found.scalar())


def _insert_on_sqlite(
    session: Session,
    statement: str,
    site_id: int | None,
    file_id: int,
    rows: Rows,
    **numbers: int,
) -> int:
    """Insert rows as they are; what is the same in all stands in the statement itself."""
    connection = session.connection()
    connection.exec_driver_sql(_SQLITE_CACHE)
    told = statement.format(
        site_id="NULL" if site_id is None else site_id, file_id=file_id, **numbers
    )
    inserted = sum(connection.exec_driver_sql(told, list(batch)).rowcount for batch in rows)
    connection.exec_driver_sql(_SQLITE_CACHE_AFTER)
    return inserted


def _copy_on_postgres(
    session: Session,
    statements: tuple[str, str, str, str],
    origin: Mapping[str, int | None],
    rows: Rows,
) -> int:
    create, empty, copy_in, keep = statements
    connection = session.connection()
    connection.exec_driver_sql(create)
    connection.exec_driver_sql(empty)  # of the part before: the table lasts for the transaction
    driver: psycopg.Connection[Any] = connection.connection.driver_connection  # type: ignore[assignment]  # as the engine is psycopg's
    with driver.cursor() as cursor, cursor.copy(copy_in) as copy:
        for batch in rows:
            for row in batch:
                copy.write_row(row)
    return connection.exec_driver_sql(keep, dict(origin)).rowcount
