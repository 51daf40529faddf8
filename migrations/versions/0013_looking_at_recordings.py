"""AIS recordings that are looked at before they are imported, and shown when they are whole.

Revision ID: 0013
Revises: 0012
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(postgresql.JSONB(), "postgresql")
MOMENT = sa.DateTime(timezone=True)
IMPORTING = sa.text("NOT is_whole")


def upgrade() -> None:
    op.create_table(
        "ais_uploads",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=True),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("file_name", sa.String(255), nullable=False),
        sa.Column("size_bytes", sa.BigInteger(), nullable=False),
        sa.Column("mapping", JSON, nullable=True),
        sa.Column(
            "state",
            _choice(
                "uploadstate", "waiting", "queued", "importing", "imported", "failed", "cancelled"
            ),
            nullable=False,
        ),
        sa.Column("progress", sa.Double(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("file_id", sa.Integer(), nullable=True),
        sa.Column("workflow_id", sa.String(64), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("started_at", MOMENT, nullable=True),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        _belongs("site_id", "sites", "CASCADE"),
        _belongs("file_id", "ais_files", "SET NULL"),
        _belongs("created_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_ais_uploads"),
        sa.UniqueConstraint("workflow_id", name="uq_ais_uploads_workflow_id"),
    )
    op.create_index("ix_ais_uploads_site_id", "ais_uploads", ["site_id"])
    op.add_column("ais_files", sa.Column("mapping", JSON, nullable=True))
    op.add_column(
        "ais_files",
        sa.Column("is_whole", sa.Boolean(), nullable=False, server_default=sa.true()),
    )
    op.create_index(
        "ix_ais_files_importing",
        "ais_files",
        ["id"],
        sqlite_where=IMPORTING,
        postgresql_where=IMPORTING,
    )


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM ais_files WHERE NOT is_whole"))
    op.drop_index("ix_ais_files_importing", "ais_files")
    op.drop_column("ais_files", "is_whole")
    op.drop_column("ais_files", "mapping")
    op.drop_table("ais_uploads")


def _choice(name: str, *values: str) -> sa.Enum:
    return sa.Enum(*values, name=name, native_enum=False, length=32, create_constraint=True)


def _belongs(column: str, table: str, ondelete: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column], [f"{table}.id"], name=f"fk_ais_uploads_{column}_{table}", ondelete=ondelete
    )
