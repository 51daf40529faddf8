"""A Postgres database that test after test begins with nothing in.

Copying a template takes a quarter of a second where tables are many, since each index is a file;
deleting the few rows of a test takes some milliseconds. Whatever else a test did to the database,
to its tables or its version, is noticed, and the next test gets a fresh copy.
"""

from typing import TypeAlias

import psycopg

from tests.postgres import PostgresCluster

OTHERS_END = """
    SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity
    WHERE datname = current_database() AND pid <> pg_backend_pid()
"""
RELATIONS = """
    SELECT format('%I.%I', n.nspname, c.relname), c.relkind::text
    FROM pg_class AS c JOIN pg_namespace AS n ON n.oid = c.relnamespace
    WHERE n.nspname NOT LIKE 'pg\\_%' AND n.nspname <> 'information_schema'
    ORDER BY 1
"""
COUNT_ANEW = """
    SELECT setval(format('%I.%I', schemaname, sequencename)::regclass, start_value, false)
    FROM pg_sequences WHERE last_value IS NOT NULL
"""
MIGRATIONS = ("migrations", "alembic_version")
VERSION = "SELECT version_num, '' FROM alembic_version"
Connection: TypeAlias = "psycopg.Connection[tuple[str, str]]"
Rows = list[tuple[str, str]]


class ReusedDatabase:
    """A copy of a template, emptied after each use over one connection that knows the tables."""

    def __init__(self, cluster: PostgresCluster, name: str, template: str) -> None:
        self._cluster, self._name, self._template = cluster, name, template
        self._connection: Connection | None = None
        self._made: Rows = []

    def lend(self) -> str:
        """Return the address of the database, as the template has it."""
        url = self._cluster.url(self._name)
        if self._connection is None:
            self._cluster.drop(self._name)
            self._cluster.create(self._name, self._template)
            self._connection = psycopg.connect(url.replace("+psycopg", ""), autocommit=True)
            self._made = _made(self._connection)
            # All rows go together: who refers to whom need not be asked.
            self._connection.execute("SET session_replication_role = replica")
        return url

    def take_back(self) -> None:
        """Empty the database, or see to it that the next is a fresh copy."""
        assert self._connection is not None
        try:
            self._connection.execute(OTHERS_END)
            self._empty(self._connection)
        except (psycopg.Error, ChangedError):
            self.close()

    def close(self) -> None:
        """Let go of the database."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _empty(self, connection: Connection) -> None:
        if _made(connection) != self._made:
            raise ChangedError
        tables = [
            name for name, kind in self._made if kind == "r" and not name.endswith(MIGRATIONS)
        ]
        filled = " UNION ALL ".join(f"SELECT '{it}', '' WHERE EXISTS (TABLE {it})" for it in tables)
        with connection.transaction():
            for name, _ in connection.execute(filled.encode()).fetchall():
                connection.execute(f"DELETE FROM {name}".encode())  # noqa: S608 (from the catalog)
            connection.execute(COUNT_ANEW)


class ChangedError(Exception):
    """The tables or their version are no longer those of the template."""


def _made(connection: Connection) -> Rows:
    return connection.execute(RELATIONS).fetchall() + connection.execute(VERSION).fetchall()
