"""Landmarks, models, queues and other smaller things can be deleted for a while too.

Revision ID: 0023
Revises: 0022
"""

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None

PRESENT = sa.text("deleted_at IS NULL")
DELETED = sa.text("deleted_at IS NOT NULL")
# Tables with the columns whose values were unique, and now are so among what is not deleted.
UNIQUE = {
    "landmarks": ["site_id", "name"],
    "models": ["name"],
    "ground_truth_files": ["site_id", "sha256"],
    "ground_truth_images": ["image_id"],
    "watched_folders": ["camera_id", "path"],
    "water_levels": ["site_id", "measured_at"],
}
TABLES = (
    *UNIQUE,
    "calibration_sets",
    "comments",
    "missed_vessels",
    "retention_rules",
    "review_queues",
    "standing_runs",
)
ENTITIES = (
    "calibration_set",
    "comment",
    "feed",
    "ground_truth_file",
    "landmark",
    "missed_vessel",
    "model",
    "retention_rule",
    "review_queue",
    "standing_run",
    "watched_folder",
    "water_levels",
)
PHOTOGRAPHS = "ix_ground_truth_images_image_id"


def upgrade() -> None:
    for table in TABLES:
        op.add_column(table, sa.Column("deleted_at", sa.DateTime(timezone=True), nullable=True))
        op.add_column(table, sa.Column("deletion_id", sa.Integer(), nullable=True))
        op.create_index(op.f(f"ix_{table}_deletion_id"), table, ["deletion_id"])
        op.create_index(
            f"ix_{table}_deleted", table, ["id"], sqlite_where=DELETED, postgresql_where=DELETED
        )
    for table, columns in UNIQUE.items():
        name = f"uq_{table}_{'_'.join(columns)}"
        with op.batch_alter_table(table) as batch_op:
            batch_op.drop_constraint(name, type_="unique")
        op.create_index(
            name, table, columns, unique=True, sqlite_where=PRESENT, postgresql_where=PRESENT
        )
    op.create_index(op.f(PHOTOGRAPHS), "ground_truth_images", ["image_id"])


def downgrade() -> None:
    # The older tables know no deleted ones of these: what is hidden is removed.
    for table in reversed(TABLES):
        op.execute(sa.delete(sa.table(table)).where(DELETED))
    entities = sa.column("entity", sa.String)
    op.execute(sa.delete(sa.table("deletions", entities)).where(entities.in_(ENTITIES)))
    op.drop_index(op.f(PHOTOGRAPHS), "ground_truth_images")
    for table, columns in UNIQUE.items():
        name = f"uq_{table}_{'_'.join(columns)}"
        op.drop_index(name, table_name=table)
        with op.batch_alter_table(table) as batch_op:
            batch_op.create_unique_constraint(name, columns)
    for table in TABLES:
        op.drop_index(f"ix_{table}_deleted", table_name=table)
        op.drop_index(op.f(f"ix_{table}_deletion_id"), table_name=table)
        op.drop_column(table, "deletion_id")
        op.drop_column(table, "deleted_at")
