"""Cells of positions: what is near a camera at a moment, found by one index on every database.

Revision ID: 0010
Revises: 0009
"""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

INDEX = "ix_ais_positions_cell_time"
# As `app.domain.cells` counts them. To an integer SQLite truncates and Postgres rounds.
FILL = {
    "sqlite": "CAST((lat_deg + 90) * 20 AS INTEGER) * 7201 + CAST((lon_deg + 180) * 20 AS INTEGER)",
    "postgresql": "floor((lat_deg + 90) * 20)::int * 7201 + floor((lon_deg + 180) * 20)::int",
}


def upgrade() -> None:
    op.add_column("ais_positions", sa.Column("cell", sa.Integer(), nullable=True))
    positions = sa.table("ais_positions", sa.column("cell"))
    cell = sa.literal_column(FILL[op.get_bind().dialect.name])
    op.execute(sa.update(positions).values(cell=cell))
    with op.batch_alter_table("ais_positions") as batch_op:
        batch_op.alter_column("cell", nullable=False)
    op.create_index(INDEX, "ais_positions", ["cell", "fix_time"])


def downgrade() -> None:
    op.drop_index(INDEX, "ais_positions")
    op.drop_column("ais_positions", "cell")
