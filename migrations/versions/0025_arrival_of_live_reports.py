"""Reports of live feeds keep when they came, beside what their receiver's clock said.

Revision ID: 0025
Revises: 0024
"""

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
ARRIVALS = "ix_ais_positions_suspect_arrival"


def upgrade() -> None:
    op.add_column("ais_positions", sa.Column("arrived_at", MOMENT, nullable=True))
    op.add_column("ais_positions", sa.Column("clock_suspect", sa.Boolean(), nullable=True))
    op.add_column("ais_statics", sa.Column("arrived_at", MOMENT, nullable=True))
    op.create_index(
        ARRIVALS,
        "ais_positions",
        ["arrived_at"],
        sqlite_where=sa.text("clock_suspect = 1"),
        postgresql_where=sa.text("clock_suspect"),
    )


def downgrade() -> None:
    op.drop_index(ARRIVALS, "ais_positions")
    op.drop_column("ais_statics", "arrived_at")
    op.drop_column("ais_positions", "clock_suspect")
    op.drop_column("ais_positions", "arrived_at")
