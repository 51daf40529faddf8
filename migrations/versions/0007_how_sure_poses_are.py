"""How sure poses are: covariance of the position, sigmas of heading and height.

Revision ID: 0007
Revises: 0006
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

COLUMNS = {
    "position_covariance_in_enu_m2": sa.JSON().with_variant(JSONB(), "postgresql"),
    "heading_sigma_deg": sa.Double(),
    "height_sigma_m": sa.Double(),
}


def upgrade() -> None:
    for name, kind in COLUMNS.items():
        op.add_column("poses", sa.Column(name, kind, nullable=True))


def downgrade() -> None:
    for name in reversed(COLUMNS):
        op.drop_column("poses", name)
