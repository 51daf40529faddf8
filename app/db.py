"""The database: engine, sessions, column types shared by all tables.

SQLite and Postgres behave alike from here on. On SQLite a transaction that writes must say so when
it begins: a reader that turns writer half-way fails at once instead of waiting, whatever the busy
timeout. So sessions are opened either to read (deferred) or to write (immediate).
"""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import sqlalchemy as sa
from pydantic_core import PydanticSerializationError, from_json, to_json
from sqlalchemy.dialects.postgresql import JSONB
from sqlalchemy.orm import DeclarativeBase, Session
from sqlalchemy.orm.interfaces import ORMOption

from app.domain.nmea_times import epoch_us, moment_of

BUSY_TIMEOUT_MS = 30_000
_PAGE_BYTES = 16_384  # as it comes SQLite has 4,096; a million positions take 0.7 of the time
# Connections kept and made at need; requests with a session are fewer, for others need some too.
POOL = {"pool_size": 10, "max_overflow": 20}
MOST_SESSIONS = 20
IDLE_LIMIT = "idle_in_transaction_session_timeout"  # of Postgres, in milliseconds
_ENCODER = json.JSONEncoder(allow_nan=False)
CONSTRAINT_NAMES = {
    "ix": "ix_%(column_0_N_label)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}

ONLY_ON = "only_on"  # in a constraint's `info`: the one dialect whose databases have it

Json = sa.JSON().with_variant(JSONB(), "postgresql")


class UtcDateTime(sa.types.TypeDecorator[datetime]):
    """A moment in UTC: aware in Python, also on SQLite, which stores no zones."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        """Refuse a moment without a zone; store UTC."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("a moment needs a time zone")
        moment = value.astimezone(UTC)
        return moment.replace(tzinfo=None) if dialect.name == "sqlite" else moment

    def process_result_value(
        self,
        value: datetime | None,
        dialect: sa.Dialect,  # noqa: ARG002  SQLAlchemy's signature
    ) -> datetime | None:
        """Give the moment back aware, in UTC."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class UtcMicroseconds(sa.types.TypeDecorator[datetime]):
    """As `UtcDateTime`, but on SQLite the whole microseconds since 1970 began.

    SQLite would keep 26 letters of each moment, once more in each index: the table with the most
    rows and its indexes take 0.64 of the room this way, and 0.75 of the time to write.
    """

    impl = sa.BigInteger
    cache_ok = True

    def load_dialect_impl(self, dialect: sa.Dialect) -> sa.types.TypeEngine[Any]:
        """Return the database's own type."""
        is_sqlite = dialect.name == "sqlite"
        return dialect.type_descriptor(sa.BigInteger() if is_sqlite else _MOMENT)

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> object:
        """Refuse a moment without a zone; store UTC."""
        moment = _MOMENT.process_bind_param(value, dialect)
        return epoch_us(value) if value is not None and dialect.name == "sqlite" else moment

    def process_result_value(self, value: Any, dialect: sa.Dialect) -> datetime | None:  # noqa: ANN401  an integer or a moment
        """Give the moment back aware, in UTC."""
        if value is not None and dialect.name == "sqlite":
            return moment_of(value)
        return _MOMENT.process_result_value(value, dialect)


_MOMENT = UtcDateTime()


class Base(DeclarativeBase):
    """Parent of all tables."""

    metadata = sa.MetaData(naming_convention=CONSTRAINT_NAMES)
    type_annotation_map = {  # noqa: RUF012  SQLAlchemy reads it as a class attribute
        datetime: UtcDateTime(),
        dict[str, Any]: Json,
        list[Any]: Json,
        list[str]: Json,
        list[float]: Json,
        list[int]: Json,
        list[list[float]]: Json,
    }


def enum_type(values: type[StrEnum]) -> sa.Enum:
    """Return the column type of an enumeration: its values as text, checked by the database."""
    return sa.Enum(
        values,
        native_enum=False,
        create_constraint=True,
        length=32,
        values_callable=lambda members: [member.value for member in members],
        name=values.__name__.lower(),
    )


Row = TypeVar("Row", bound=Base)


def find(session: Session, table: type[Row], identifier: int, *options: ORMOption) -> Row | None:
    """Return the row with an id; None for unknown ids and for those no column could hold."""
    is_wide = isinstance(sa.inspect(table).primary_key[0].type, sa.BigInteger)
    largest = 2**63 - 1 if is_wide else 2**31 - 1
    if not 0 < identifier <= largest:
        return None
    return session.get(table, identifier, options=options)


def now() -> datetime:
    """Return the present moment in UTC."""
    return datetime.now(UTC)


def json_text(value: object) -> str:
    """Return a JSON column's text. Raises ValueError for NaN and infinity, which JSON has not.

    SQLite would keep them, and every answer that holds the row would fail ever after. The standard
    library's writer, a fifth as fast, is asked only where there may be one, or half of a surrogate
    pair, which is no text to the other.
    """
    try:
        text = to_json(value, inf_nan_mode="constants").decode()
    except PydanticSerializationError:
        return _ENCODER.encode(value)
    return _ENCODER.encode(value) if "NaN" in text or "Infinity" in text else text


def from_json_text(text: str | bytes) -> Any:  # noqa: ANN401  whatever was stored
    """Return what a JSON column's text says, four times as fast as the standard library's reader.

    That one is asked where this one is stricter: half of a surrogate pair is no text to it.
    """
    try:
        return from_json(text)
    except ValueError:
        return json.loads(text)


def end_idle_writers(engine: sa.Engine, limit_s: float) -> None:
    """Have Postgres end a transaction that writes and stands idle for longer than this.

    That of a frozen process, or behind a dead network, would keep its locks for hours, and with
    them all who wait for its rows. SQLite has no such setting: its locks end with the process.
    """

    @sa.event.listens_for(engine, "begin")
    def _limit(connection: sa.Connection) -> None:
        if connection.get_execution_options().get("writes", False):
            connection.exec_driver_sql(f"SET LOCAL {IDLE_LIMIT} = {int(limit_s * 1000)}")


def make_engine(database_url: str) -> sa.Engine:
    """Make an engine for SQLite (WAL, foreign keys, busy timeout, full durability) or Postgres.

    New SQLite databases get large pages: an import writes many rows to few of them.
    """
    url = sa.make_url(database_url)
    if url.get_backend_name() != "sqlite":
        return sa.create_engine(
            url,
            **POOL,
            pool_pre_ping=True,
            json_serializer=json_text,
            json_deserializer=from_json_text,
        )
    if url.database and url.database != ":memory:":
        Path(url.database).parent.mkdir(parents=True, exist_ok=True)
    engine = sa.create_engine(
        url,
        **({} if url.database == ":memory:" else POOL),
        connect_args={"timeout": BUSY_TIMEOUT_MS / 1000},
        json_serializer=json_text,
        json_deserializer=from_json_text,
    )
    sa.event.listen(engine, "connect", _configure_sqlite)

    @sa.event.listens_for(engine, "begin")
    def _begin(connection: sa.Connection) -> None:
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _configure_sqlite(connection: sqlite3.Connection, _record: object) -> None:
    # The driver's own transaction handling begins too late and commits too early.
    connection.isolation_level = None
    for pragma in (
        f"page_size={_PAGE_BYTES}",  # of a new database, before anything is written to it
        "journal_mode=WAL",
        "foreign_keys=ON",
        f"busy_timeout={BUSY_TIMEOUT_MS}",
        "synchronous=FULL",
    ):
        connection.execute(f"PRAGMA {pragma}")


class Database:
    """An engine with the two ways to open a session on it."""

    def __init__(self, database_url: str, *, idle_limit_s: float | None = None) -> None:
        self.url = database_url
        self.engine = make_engine(database_url)
        self.is_sqlite = self.engine.dialect.name == "sqlite"
        if idle_limit_s is not None and not self.is_sqlite:
            end_idle_writers(self.engine, idle_limit_s)
        self._writing_engine = self.engine.execution_options(writes=True)
        # The event loop's own connection: it must never wait for one that a request holds which
        # only the loop could bring to its end.
        self._loop_engine = make_engine(database_url) if self.is_sqlite else self.engine

    def session(self, *, writes: bool) -> Session:
        """Open a session; its transaction begins at the first statement."""
        return Session(
            self._writing_engine if writes else self.engine,
            expire_on_commit=False,
        )

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Give a session that only reads."""
        with self.session(writes=False) as session:
            yield session

    @contextmanager
    def glancing(self) -> Iterator[Session]:
        """Give a session for a short look-up: on SQLite one that is safe on the event loop."""
        with Session(self._loop_engine, expire_on_commit=False) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Give a session in one transaction, committed when the block ends well."""
        with self.session(writes=True) as session, session.begin():
            yield session

    def dispose(self) -> None:
        """Close all connections."""
        self.engine.dispose()
        self._loop_engine.dispose()
