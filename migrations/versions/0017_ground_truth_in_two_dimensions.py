"""Ground truth in two dimensions: files, photographs that may be absent, and boxes in them.

Revision ID: 0017
Revises: 0016
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(postgresql.JSONB(), "postgresql")
MOMENT = sa.DateTime(timezone=True)
BOXES, IMAGES, FILES = "ground_truth_boxes", "ground_truth_images", "ground_truth_files"


def upgrade() -> None:
    op.create_table(
        FILES,
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("file_name", sa.String(255), nullable=False),
        sa.Column("document", JSON, nullable=False),
        sa.Column("class_of_category", JSON, nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        _belongs(FILES, "site_id", "sites", "CASCADE"),
        _belongs(FILES, "created_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_ground_truth_files"),
        sa.UniqueConstraint("site_id", "sha256", name="uq_ground_truth_files_site_id_sha256"),
    )
    op.create_table(
        IMAGES,
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=True),
        sa.Column("file_id", sa.Integer(), nullable=True),
        sa.Column("file_name", sa.String(1000), nullable=False),
        sa.Column("base_name", sa.String(255), nullable=False),
        sa.Column("width_px", sa.Integer(), nullable=False),
        sa.Column("height_px", sa.Integer(), nullable=False),
        sa.Column("content_sha256", sa.String(64), nullable=False),
        sa.Column("coco_id", sa.BigInteger(), nullable=True),
        sa.Column("entry", JSON, nullable=True),
        sa.Column("is_complete", sa.Boolean(), nullable=False),
        sa.Column("completed_at", MOMENT, nullable=True),
        sa.Column("completed_by_id", sa.Integer(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        _belongs(IMAGES, "site_id", "sites", "CASCADE"),
        _belongs(IMAGES, "image_id", "images", "SET NULL"),
        _belongs(IMAGES, "file_id", FILES, "CASCADE"),
        _belongs(IMAGES, "completed_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_ground_truth_images"),
        sa.UniqueConstraint("image_id", name="uq_ground_truth_images_image_id"),
    )
    op.create_index("ix_ground_truth_images_site", IMAGES, ["site_id", "id"])
    for column in ("file_id", "base_name", "content_sha256"):
        op.create_index(f"ix_ground_truth_images_{column}", IMAGES, [column])
    # Nothing has ever written boxes: there was no way to draw or import them.
    op.drop_table(BOXES)
    op.create_table(
        BOXES,
        *_shared_columns(),
        sa.Column("ground_truth_image_id", sa.Integer(), nullable=False),
        sa.Column("area_px2", sa.Double(), nullable=False),
        sa.Column("is_crowd", sa.Boolean(), nullable=False),
        sa.Column("coco_id", sa.BigInteger(), nullable=True),
        sa.Column("entry", JSON, nullable=True),
        sa.Column("deleted_at", MOMENT, nullable=True),
        _belongs(BOXES, "ground_truth_image_id", IMAGES, "CASCADE"),
    )
    op.create_index("ix_ground_truth_boxes_ground_truth_image_id", BOXES, ["ground_truth_image_id"])


def downgrade() -> None:
    op.drop_table(BOXES)
    op.drop_table(IMAGES)
    op.drop_table(FILES)
    op.create_table(
        BOXES,
        *_shared_columns(),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=True),
        _belongs(BOXES, "site_id", "sites", "CASCADE"),
        _belongs(BOXES, "image_id", "images", "CASCADE"),
    )
    for column in ("site_id", "image_id"):
        op.create_index(f"ix_ground_truth_boxes_{column}", BOXES, [column])


def _shared_columns() -> list[sa.Column[object] | sa.Constraint]:
    """Return what a box had before, too."""
    return [
        sa.Column("id", sa.Integer(), nullable=False),
        *(
            sa.Column(name, sa.Double(), nullable=False)
            for name in ("x1_px", "y1_px", "x2_px", "y2_px")
        ),
        sa.Column(
            "vessel_class",
            sa.Enum(
                "ship",
                "ship_leaving_frame",
                "ship_moored",
                "ship_partial",
                "subvessel",
                name="vesselclass",
                native_enum=False,
                length=32,
                create_constraint=True,
            ),
            nullable=False,
        ),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        _belongs(BOXES, "user_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_ground_truth_boxes"),
    ]


def _belongs(table: str, column: str, other: str, ondelete: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column], [f"{other}.id"], name=f"fk_{table}_{column}_{other}", ondelete=ondelete
    )
