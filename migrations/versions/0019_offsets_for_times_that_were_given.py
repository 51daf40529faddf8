"""A clock's offset may concern times that somebody gave, not only those its clock told.

Revision ID: 0019
Revises: 0018
"""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "clock_offsets",
        sa.Column("concerns_given", sa.Boolean(), server_default=sa.false(), nullable=False),
    )


def downgrade() -> None:
    with op.batch_alter_table("clock_offsets") as table:
        table.drop_column("concerns_given")
