"""The schema's life: upgrade, downgrade, check, for the application's tables and the job engine's.

One call leaves both ready, so that no process has to create tables while serving.
"""

import sqlite3
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from app.db import Base, Database
from app.errors import Conflict
from app.jobs import migrate_job_tables
from app.locator import locate


def _config(connection: object) -> Config:
    config = Config()
    config.set_main_option("script_location", str(locate("migrations")))
    config.attributes["connection"] = connection
    return config


def upgrade(database: Database, revision: str = "head") -> None:
    """Bring the database up to a revision; the job engine's tables come along."""
    with _migrating(database) as connection:
        command.upgrade(_config(connection), revision)
    migrate_job_tables(database.url)


def downgrade(database: Database, revision: str) -> None:
    """Take the application's tables back to a revision (`base` removes them)."""
    with _migrating(database) as connection:
        command.downgrade(_config(connection), revision)


@contextmanager
def _migrating(database: Database) -> Iterator[sa.Connection]:
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
            with connection.begin():
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
    config = Config()
    config.set_main_option("script_location", str(locate("migrations")))
    head = ScriptDirectory.from_config(config).get_current_head()
    if head is None:
        raise FileNotFoundError("no migrations in this installation")
    return head


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
                "compare_type": True,
            },
        )
        with warnings.catch_warnings():
            # SQLite does not tell what an index on an expression is made of; nobody can act on it.
            warnings.filterwarnings("ignore", "Skipped unsupported reflection")
            warnings.filterwarnings("ignore", "autogenerate skipping metadata-specified expression")
            return list(compare_metadata(migration_context, Base.metadata))
