"""Batches of photographs on their way in, and the moment an image's source told.

Revision ID: 0008
Revises: 0007
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(JSONB(), "postgresql")
SOURCES = ("given", "exif", "file_name")
NEW_SOURCES = ("csv", "file_time")
SOURCE_CHECK = "capturetimesource"
IMPORT_KEY = "fk_images_import_id_image_imports"


def upgrade() -> None:
    op.create_table(
        "image_imports",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("camera_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column(
            "status",
            sa.Enum(
                "collecting",
                "committed",
                "undone",
                "discarded",
                name="importstatus",
                native_enum=False,
                create_constraint=True,
                length=32,
            ),
            nullable=False,
        ),
        sa.Column("times", JSON, nullable=False),
        sa.Column("image_count", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("committed_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("undone_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["camera_id"],
            ["cameras.id"],
            name=op.f("fk_image_imports_camera_id_cameras"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["created_by_id"],
            ["users.id"],
            name=op.f("fk_image_imports_created_by_id_users"),
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["site_id"],
            ["sites.id"],
            name=op.f("fk_image_imports_site_id_sites"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_image_imports")),
    )
    op.create_index(op.f("ix_image_imports_camera_id"), "image_imports", ["camera_id"])
    op.create_index(op.f("ix_image_imports_site_id"), "image_imports", ["site_id"])
    op.create_table(
        "import_files",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("import_id", sa.Integer(), nullable=False),
        sa.Column("path", sa.String(length=500), nullable=False),
        sa.Column("path_key", sa.String(length=64), nullable=False),
        sa.Column("size_bytes", sa.BigInteger(), nullable=False),
        sa.Column("received_bytes", sa.BigInteger(), nullable=False),
        sa.Column("modified_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column(
            "state",
            sa.Enum(
                "waiting",
                "staged",
                "known",
                "skipped",
                "refused",
                "unpacked",
                name="filestate",
                native_enum=False,
                create_constraint=True,
                length=32,
            ),
            nullable=False,
        ),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("sha256", sa.String(length=64), nullable=True),
        sa.Column("media_type", sa.String(length=32), nullable=True),
        sa.Column("width_px", sa.Integer(), nullable=True),
        sa.Column("height_px", sa.Integer(), nullable=True),
        sa.Column("exif_at", sa.String(length=40), nullable=True),
        sa.Column("listed_at", sa.String(length=40), nullable=True),
        sa.ForeignKeyConstraint(
            ["import_id"],
            ["image_imports.id"],
            name=op.f("fk_import_files_import_id_image_imports"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_import_files")),
        sa.UniqueConstraint(
            "import_id", "path_key", name=op.f("uq_import_files_import_id_path_key")
        ),
    )
    op.create_index(op.f("ix_import_files_sha256"), "import_files", ["sha256"])
    op.create_index("ix_import_files_state", "import_files", ["import_id", "state", "id"])
    op.add_column("images", sa.Column("captured_at_raw", sa.DateTime(timezone=True)))
    op.add_column("images", sa.Column("import_id", sa.Integer()))
    op.execute("UPDATE images SET captured_at_raw = captured_at")
    _rebuild_images((*SOURCES, *NEW_SOURCES), is_up=True)
    op.create_index(op.f("ix_images_import_id"), "images", ["import_id"])


def downgrade() -> None:
    op.execute(
        "UPDATE images SET captured_at_source = 'given' "
        "WHERE captured_at_source IN ('csv', 'file_time')"
    )
    op.drop_index(op.f("ix_images_import_id"), "images")
    _rebuild_images(SOURCES, is_up=False)
    op.drop_column("images", "captured_at_raw")
    op.drop_column("images", "import_id")
    op.drop_table("import_files")
    op.drop_table("image_imports")


def _rebuild_images(sources: tuple[str, ...], *, is_up: bool) -> None:
    """Set which sources of a moment there are, and the new columns' constraints.

    SQLite copies the table for it, and does not tell of the old check, which so goes.
    """
    is_sqlite = op.get_bind().dialect.name == "sqlite"
    with op.batch_alter_table("images", recreate="always" if is_sqlite else "auto") as batch_op:
        if not is_sqlite:
            batch_op.drop_constraint(batch_op.f(f"ck_images_{SOURCE_CHECK}"), type_="check")
        batch_op.create_check_constraint(
            SOURCE_CHECK if is_sqlite else batch_op.f(f"ck_images_{SOURCE_CHECK}"),
            sa.column("captured_at_source").in_(sources),
        )
        if is_up:
            batch_op.alter_column("captured_at_raw", nullable=False)
            batch_op.create_foreign_key(
                IMPORT_KEY, "image_imports", ["import_id"], ["id"], ondelete="SET NULL"
            )
        else:
            batch_op.drop_constraint(IMPORT_KEY, type_="foreignkey")
