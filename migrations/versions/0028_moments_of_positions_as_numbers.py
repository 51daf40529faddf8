"""Moments of positions as numbers on SQLite: a third less room, and a quarter less time to write.

Postgres keeps its own type.

Revision ID: 0028
Revises: 0027
"""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None

TABLE = "ais_positions"
MOMENTS = ("fix_time", "received_at", "arrived_at")
NUMBER = "strftime('%s', {0}) * 1000000 + CAST(substr({0}, 21, 6) AS INTEGER)"
TEXT = (
    "strftime('%Y-%m-%d %H:%M:%S', {0} / 1000000, 'unixepoch') "
    "|| '.' || printf('%06d', {0} % 1000000)"
)


def upgrade() -> None:
    if op.get_bind().dialect.name == "sqlite":
        indexes = _without_indexes()
        _fill(NUMBER)
        _make_anew(sa.BigInteger())
        _add(indexes)


def downgrade() -> None:
    if op.get_bind().dialect.name == "sqlite":
        indexes = _without_indexes()
        _make_anew(sa.DateTime())  # before there is text, which making it anew would cut to years
        _fill(TEXT)
        _add(indexes)


def _without_indexes() -> list[str]:
    """Remove the indexes, which are several times as quick to make again as to keep up."""
    found = op.get_bind().exec_driver_sql(
        "SELECT name, sql FROM sqlite_master "
        "WHERE type = 'index' AND sql IS NOT NULL AND tbl_name = ?",
        (TABLE,),
    )
    indexes = [(row.name, row.sql) for row in found]
    for name, _ in indexes:
        op.drop_index(name, TABLE)
    return [sql for _, sql in indexes]


def _fill(made: str) -> None:
    values = ", ".join(f"{name} = {made.format(name)}" for name in MOMENTS)
    # Past SQLAlchemy, to which a percent sign and a colon have meanings of their own.
    op.get_bind().exec_driver_sql(f"UPDATE {TABLE} SET {values}")  # noqa: S608  constants


def _make_anew(kind: sa.types.TypeEngine[object]) -> None:
    with op.batch_alter_table(TABLE) as batch_op:
        for name in MOMENTS:
            batch_op.alter_column(name, type_=kind)


def _add(indexes: list[str]) -> None:
    for sql in indexes:
        op.get_bind().exec_driver_sql(sql)
