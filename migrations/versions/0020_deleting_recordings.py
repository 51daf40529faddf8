"""AIS recordings can be deleted for a while, and states tell the static reports they used.

Revision ID: 0020
Revises: 0019
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(JSONB(), "postgresql")
CONTENT = ("uq_ais_files_content", "ais_files", ["sha256", sa.text("coalesce(site_id, 0)")])
PRESENT = sa.text("deleted_at IS NULL")
DELETED = sa.text("deleted_at IS NOT NULL")


def upgrade() -> None:
    op.add_column("ais_files", sa.Column("deleted_at", sa.DateTime(timezone=True), nullable=True))
    op.add_column("ais_files", sa.Column("deletion_id", sa.Integer(), nullable=True))
    op.create_index(op.f("ix_ais_files_deletion_id"), "ais_files", ["deletion_id"])
    op.create_index(
        "ix_ais_files_deleted", "ais_files", ["id"], sqlite_where=DELETED, postgresql_where=DELETED
    )
    sites = sa.table("sites", *map(sa.column, ("id", "deleted_at", "deletion_id")))
    files = sa.table("ais_files", *map(sa.column, ("site_id", "deleted_at", "deletion_id")))
    of_site = {
        name: sa.select(sites.c[name]).where(sites.c.id == files.c.site_id).scalar_subquery()
        for name in ("deleted_at", "deletion_id")
    }
    op.execute(files.update().values(of_site).where(files.c.site_id.is_not(None)))
    op.drop_index("uq_ais_files_content", table_name="ais_files")
    op.create_index(*CONTENT, unique=True, sqlite_where=PRESENT, postgresql_where=PRESENT)
    op.add_column(
        "vessel_states",
        sa.Column("static_ids", JSON, server_default=sa.text("'[]'"), nullable=False),
    )
    with op.batch_alter_table("deletions") as table:
        table.alter_column("site_id", existing_type=sa.Integer(), nullable=True)


def downgrade() -> None:
    # The older tables know no deleted recordings: what is hidden is removed.
    op.execute(
        "DELETE FROM ais_files WHERE deleted_at IS NOT NULL "
        "AND coalesce(site_id, 0) NOT IN (SELECT id FROM sites WHERE deleted_at IS NOT NULL)"
    )
    op.execute("DELETE FROM deletions WHERE entity = 'ais_file'")
    with op.batch_alter_table("deletions") as table:
        table.alter_column("site_id", existing_type=sa.Integer(), nullable=False)
    op.drop_column("vessel_states", "static_ids")
    op.drop_index("uq_ais_files_content", table_name="ais_files")
    op.drop_index("ix_ais_files_deleted", table_name="ais_files")
    op.drop_index(op.f("ix_ais_files_deletion_id"), table_name="ais_files")
    op.create_index(*CONTENT, unique=True)
    op.drop_column("ais_files", "deletion_id")
    op.drop_column("ais_files", "deleted_at")
