"""Hours of positions: one index finds what is near at a moment, and what was heard in a time.

It stands for two, the larger part of what an import has to write.

Revision ID: 0029
Revises: 0028
"""

import sqlalchemy as sa
from alembic import op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None

TABLE = "ais_positions"
INDEX = "ix_ais_positions_hour_cell_time"
BEFORE = {"ix_ais_positions_cell_time": ["cell", "fix_time"], "ix_ais_positions_time": ["fix_time"]}
# As `app.domain.cells` counts them; SQLite's moments are microseconds by now.
FILL = {
    "sqlite": "fix_time / 3600000000",
    "postgresql": "floor(extract(epoch FROM fix_time) / 3600)::int",
}


def upgrade() -> None:
    for name in BEFORE:
        op.drop_index(name, TABLE)
    op.add_column(TABLE, sa.Column("hour", sa.Integer(), nullable=True))
    hour = sa.literal_column(FILL[op.get_bind().dialect.name])
    op.execute(sa.update(sa.table(TABLE, sa.column("hour"))).values(hour=hour))
    with op.batch_alter_table(TABLE) as batch_op:
        batch_op.alter_column("hour", nullable=False)
    op.create_index(INDEX, TABLE, ["hour", "cell", "fix_time"])


def downgrade() -> None:
    op.drop_index(INDEX, TABLE)
    op.drop_column(TABLE, "hour")
    for name, columns in BEFORE.items():
        op.create_index(name, TABLE, columns)
