"""Alembic's entry: compares and migrates the application's own tables, and no others."""

from alembic import context

import app.tables  # noqa: F401  registers the tables
from app.db import Base, UtcDateTime, UtcMicroseconds
from app.schema import is_compared

OWN_TABLES = frozenset(Base.metadata.tables)


def include_name(name: str | None, kind: str, _parents: object) -> bool:
    """Keep the job engine's tables, which share the database, out of sight."""
    return kind != "table" or name in OWN_TABLES or name == "alembic_version"


def render_item(kind: str, item: object, _autogen: object) -> str | bool:
    """Write our own column types as what they are: migrations outlive the code's names."""
    if kind == "type" and isinstance(item, UtcDateTime):
        return "sa.DateTime(timezone=True)"
    if kind == "type" and isinstance(item, UtcMicroseconds):
        return 'sa.DateTime(timezone=True).with_variant(sa.BigInteger(), "sqlite")'
    return False


connection = context.config.attributes["connection"]
context.configure(
    connection=connection,
    target_metadata=Base.metadata,
    include_name=include_name,
    include_object=is_compared,
    render_as_batch=connection.dialect.name == "sqlite",
    compare_type=True,
    render_item=render_item,
)
with context.begin_transaction():
    context.run_migrations()
