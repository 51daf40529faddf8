"""Water levels as a series, the level each image was fused at, and versions of landmarks.

Revision ID: 0005
Revises: 0004
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

WIDE = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "water_levels",
        sa.Column("id", WIDE, nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("measured_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("level_m", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(
            ["site_id"],
            ["sites.id"],
            name=op.f("fk_water_levels_site_id_sites"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_water_levels")),
        sa.UniqueConstraint(
            "site_id", "measured_at", name=op.f("uq_water_levels_site_id_measured_at")
        ),
    )
    op.add_column(
        "landmarks", sa.Column("version", sa.Integer(), server_default="1", nullable=False)
    )
    op.add_column("run_images", sa.Column("water_level_m", sa.Double(), nullable=True))
    op.add_column("run_images", sa.Column("water_level_source", sa.String(16), nullable=True))


def downgrade() -> None:
    op.drop_column("run_images", "water_level_source")
    op.drop_column("run_images", "water_level_m")
    op.drop_column("landmarks", "version")
    op.drop_table("water_levels")
