"""Exports tell how far they are and what is in them; what changed since a moment is found by index.

Revision ID: 0018
Revises: 0017
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
JSON = sa.JSON().with_variant(JSONB(), "postgresql")
PARTIAL = (
    ("ix_images_changed", "images", "changed_at"),
    ("ix_runs_changed", "runs", "changed_at"),
    ("ix_reviews_replaced_at", "reviews", "replaced_at"),
    ("ix_corrections_deleted_at", "corrections", "deleted_at"),
)
WHOLE = (
    ("ix_poses_created_at", "poses", "created_at"),
    ("ix_reviews_created_at", "reviews", "created_at"),
    ("ix_corrections_created_at", "corrections", "created_at"),
)


def _added() -> dict[str, tuple[sa.Column[object], ...]]:
    return {
        "exports": (
            sa.Column("options", JSON, server_default=sa.text("'{}'"), nullable=False),
            sa.Column("item_total", sa.Integer(), nullable=True),
            sa.Column("manifest", JSON, nullable=True),
            sa.Column("started_at", MOMENT, nullable=True),
        ),
        "poses": (sa.Column("created_at", MOMENT, nullable=True),),
        "images": (sa.Column("changed_at", MOMENT, nullable=True),),
        "runs": (sa.Column("changed_at", MOMENT, nullable=True),),
    }


def upgrade() -> None:
    for table, columns in _added().items():
        for column in columns:
            op.add_column(table, column)
    op.execute(
        "UPDATE poses SET created_at = "
        "(SELECT coalesce(finished_at, created_at) FROM runs WHERE runs.id = poses.run_id)"
    )
    for name, table, column in WHOLE:
        op.create_index(name, table, [column])
    for name, table, column in PARTIAL:
        known = sa.text(f"{column} IS NOT NULL")
        op.create_index(name, table, [column], sqlite_where=known, postgresql_where=known)


def downgrade() -> None:
    for name, table, _ in (*PARTIAL, *WHOLE):
        op.drop_index(name, table_name=table)
    for table, columns in _added().items():
        for column in reversed(columns):
            op.drop_column(table, column.name)
