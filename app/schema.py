"""The schema's life: upgrade, downgrade, check, for the application's tables and the job engine's.

One call leaves both ready, so that no process has to create tables while serving.
"""

import sqlite3
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from app.db import ONLY_ON, Base, Database
from app.errors import Conflict
from app.locator import locate


def _config(connection: object) -> Config:
    config = Config()
    config.set_main_option("script_location", str(locate("migrations")))
    config.attributes["connection"] = connection
    return config


def upgrade(database: Database, revision: str = "head") -> None:
    """Bring the database up to a revision; the job engine's tables come along."""
    from app.jobs import migrate_job_tables  # noqa: PLC0415  commands need no engine of jobs

    with migrating(database) as connection:
        upgrade_within(connection, revision)
    migrate_job_tables(database.url)


def upgrade_within(connection: sa.Connection, revision: str = "head") -> None:
    """Bring the application's tables up to a revision in a transaction of `migrating`."""
    command.upgrade(_config(connection), revision)


def downgrade(database: Database, revision: str) -> None:
    """Take the application's tables back to a revision (`base` removes them)."""
    with migrating(database) as connection:
        downgrade_within(connection, revision)


def downgrade_within(connection: sa.Connection, revision: str) -> None:
    """Take the application's tables back to a revision in a transaction of `migrating`."""
    command.downgrade(_config(connection), revision)


@contextmanager
def migrating(database: Database) -> Iterator[sa.Connection]:
    """Give a writing transaction in which SQLite lets a table be made anew.

    Where SQLite changes a constraint it copies the table and drops the old one, which would take
    along every row that refers to it; so foreign keys rest meanwhile.
    """
    with database.engine.execution_options(writes=True).connect() as connection:
        raw = connection.connection.driver_connection
        on_sqlite = raw if isinstance(raw, sqlite3.Connection) else None
        if on_sqlite:
            on_sqlite.execute("PRAGMA foreign_keys=OFF")
        try:
            with connection.begin(), _calm_about_expressions():
                yield connection
        finally:
            if on_sqlite:
                on_sqlite.execute("PRAGMA foreign_keys=ON")


def current_revision(database: Database) -> str | None:
    """Return the revision the database is at, or None for an empty one."""
    with database.engine.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


def head_revision() -> str:
    """Return the newest revision this code knows."""
    return known_revisions()[0]


@cache
def known_revisions() -> tuple[str, ...]:
    """Return the revisions this code knows, newest first."""
    scripts = ScriptDirectory.from_config(_config(None)).walk_revisions()
    known = tuple(script.revision for script in scripts)
    if not known:
        raise FileNotFoundError("no migrations in this installation")
    return known


def refuse_other_version(database: Database) -> None:
    """Raise Conflict naming the remedy when the database is not at this version's revision."""
    current, head = current_revision(database), head_revision()
    if current != head:
        raise Conflict(
            f"the database is at {current or 'nothing'}, this version needs {head}: "
            "run `quaymark db upgrade`"
        )


def differences(database: Database) -> list[object]:
    """Return what the tables in the code and in the database disagree about."""
    own = frozenset(Base.metadata.tables)
    with database.engine.connect() as connection:
        migration_context = MigrationContext.configure(
            connection,
            opts={
                "include_name": lambda name, kind, _parents: kind != "table" or name in own,
                "include_object": is_compared,
                "compare_type": True,
            },
        )
        with _calm_about_expressions():
            return list(compare_metadata(migration_context, Base.metadata))


def is_compared(
    item: sa.sql.schema.SchemaItem,
    _name: str | None,
    _kind: str,
    _is_reflected: bool,  # noqa: FBT001  Alembic's signature
    _other: sa.sql.schema.SchemaItem | None,
) -> bool:
    """Leave out what only SQLite's databases have; those were made with it, and keep it."""
    return ONLY_ON not in item.info


@contextmanager
def _calm_about_expressions() -> Iterator[None]:
    """Keep quiet that SQLite does not tell what an index on an expression is made of.

    Nobody can act on it, and tables with such an index are never made anew.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Skipped unsupported reflection")
        warnings.filterwarnings("ignore", "autogenerate skipping metadata-specified expression")
        yield
