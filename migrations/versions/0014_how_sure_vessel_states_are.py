"""How sure vessel states are, how they were made, and what to know before trusting them.

Revision ID: 0014
Revises: 0013
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(JSONB(), "postgresql")


def upgrade() -> None:
    op.add_column("vessel_states", sa.Column("track_method", sa.String(16), nullable=True))
    op.add_column("vessel_states", sa.Column("position_covariance_m2", JSON, nullable=True))
    op.add_column("vessel_states", sa.Column("heading_sigma_deg", sa.Double(), nullable=True))
    op.add_column(
        "vessel_states", sa.Column("flags", JSON, nullable=False, server_default=sa.text("'[]'"))
    )


def downgrade() -> None:
    for name in ("flags", "heading_sigma_deg", "position_covariance_m2", "track_method"):
        op.drop_column("vessel_states", name)
