"""Exports by what changed since tell words put on a verdict later, and poses that were made anew.

Revision ID: 0027
Revises: 0026
"""

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
WORDS, CHANGED = "ix_reviews_words_at", "ix_poses_changed"


def upgrade() -> None:
    op.add_column("reviews", sa.Column("words_at", MOMENT, nullable=True))
    op.add_column("poses", sa.Column("changed_at", MOMENT, nullable=True))
    _index(WORDS, "reviews", "words_at")
    _index(CHANGED, "poses", "changed_at")
    op.create_table(
        "removed_poses",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("pose_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=False),
        sa.Column("person_made", sa.Boolean(), nullable=False),
        sa.Column("removed_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["image_id"],
            ["images.id"],
            name=op.f("fk_removed_poses_image_id_images"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["run_id"], ["runs.id"], name=op.f("fk_removed_poses_run_id_runs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_removed_poses")),
    )
    for column in ("image_id", "removed_at", "run_id"):
        op.create_index(op.f(f"ix_removed_poses_{column}"), "removed_poses", [column])


def downgrade() -> None:
    op.drop_table("removed_poses")
    op.drop_index(CHANGED, "poses")
    op.drop_index(WORDS, "reviews")
    op.drop_column("poses", "changed_at")
    op.drop_column("reviews", "words_at")


def _index(name: str, table: str, column: str) -> None:
    there = sa.text(f"{column} IS NOT NULL")
    op.create_index(name, table, [column], sqlite_where=there, postgresql_where=there)
