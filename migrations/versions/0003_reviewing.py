"""Reviewing: decisions by name, second opinions, queues with leases, corrections with versions.

Nothing wrote corrections or missed vessels before, so those two tables are made anew.

Revision ID: 0003
Revises: 0002
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(postgresql.JSONB(), "postgresql")
MOMENT = sa.DateTime(timezone=True)
WIDE = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
OPEN = sa.text("done_at IS NULL")


def upgrade() -> None:
    op.add_column("reviews", sa.Column("decision", sa.String(length=200), nullable=True))
    for name in ("second_opinion", "settles"):
        op.add_column(
            "reviews", sa.Column(name, sa.Boolean(), server_default=sa.false(), nullable=False)
        )
    op.add_column("reviews", sa.Column("withdrawn_at", MOMENT, nullable=True))
    op.create_index("ix_reviews_decision", "reviews", ["user_id", "decision"])
    op.add_column(
        "poses", sa.Column("person_made", sa.Boolean(), server_default=sa.false(), nullable=False)
    )
    op.create_index("ix_matches_detection_id", "matches", ["detection_id"])
    op.create_index("ix_image_completions_run_id", "image_completions", ["run_id"])
    op.drop_table("corrections")
    _corrections(
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("kind", _choice("correctionkind", "edited", "rematched"), nullable=False),
        sa.Column("mmsi", sa.Integer(), nullable=False),
        sa.Column("vessel_state_id", WIDE, nullable=True),
        sa.Column("base_height_m", sa.Double(), nullable=False),
        sa.Column("center_height_m", sa.Double(), nullable=False),
        sa.Column("centroid_in_cam_m", JSON, nullable=False),
        sa.Column("rotvec_cam_from_vessel", JSON, nullable=False),
        sa.Column("cost", sa.Double(), nullable=True),
        sa.Column("cost_terms", JSON, nullable=True),
        sa.Column("flags", JSON, nullable=False),
        sa.Column("comment", sa.Text(), nullable=True),
        sa.Column("deleted_at", MOMENT, nullable=True),
        _belongs("corrections", "vessel_state_id", "vessel_states", "SET NULL"),
        sa.UniqueConstraint("pose_id", "version", name=op.f("uq_corrections_pose_id_version")),
    )
    op.drop_table("missed_vessels")
    _missed_vessels(
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("comment", sa.Text(), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        _belongs("missed_vessels", "run_id", "runs", "CASCADE"),
    )
    op.create_index("ix_missed_vessels_run_id", "missed_vessels", ["run_id"])
    _queues()
    _notes()


def downgrade() -> None:
    for table in (
        "key_bindings",
        "comments",
        "bookmarks",
        "review_queue_items",
        "review_queues",
        "missed_vessels",
        "corrections",
    ):
        op.drop_table(table)
    _missed_vessels()
    _corrections()
    op.create_index("ix_corrections_pose_id", "corrections", ["pose_id"])
    op.drop_index("ix_image_completions_run_id", table_name="image_completions")
    op.drop_index("ix_matches_detection_id", table_name="matches")
    op.drop_column("poses", "person_made")
    op.drop_index("ix_reviews_decision", table_name="reviews")
    for name in ("withdrawn_at", "settles", "second_opinion", "decision"):
        op.drop_column("reviews", name)


def _belongs(table: str, column: str, other: str, ondelete: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column], [f"{other}.id"], name=op.f(f"fk_{table}_{column}_{other}"), ondelete=ondelete
    )


def _choice(name: str, *values: str) -> sa.Enum:
    return sa.Enum(*values, name=name, native_enum=False, create_constraint=True, length=32)


def _corrections(*columns: sa.Column[object] | sa.Constraint) -> None:
    op.create_table(
        "corrections",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("pose_id", WIDE, nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("lat_deg", sa.Double(), nullable=False),
        sa.Column("lon_deg", sa.Double(), nullable=False),
        sa.Column("heading_deg", sa.Double(), nullable=False),
        sa.Column("length_m", sa.Double(), nullable=False),
        sa.Column("width_m", sa.Double(), nullable=False),
        sa.Column("height_m", sa.Double(), nullable=False),
        sa.Column("corners_in_image_px", JSON, nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        *columns,
        _belongs("corrections", "pose_id", "poses", "CASCADE"),
        _belongs("corrections", "user_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_corrections")),
    )


def _missed_vessels(*columns: sa.Column[object] | sa.Constraint) -> None:
    reasons = _choice("missedreason", "not_detected", "no_ais", "neither", "cost_too_high")
    op.create_table(
        "missed_vessels",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("x1_px", sa.Double(), nullable=False),
        sa.Column("y1_px", sa.Double(), nullable=False),
        sa.Column("x2_px", sa.Double(), nullable=False),
        sa.Column("y2_px", sa.Double(), nullable=False),
        sa.Column("reason", reasons, nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        *columns,
        _belongs("missed_vessels", "image_id", "images", "CASCADE"),
        _belongs("missed_vessels", "user_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_missed_vessels")),
    )
    op.create_index("ix_missed_vessels_image_id", "missed_vessels", ["image_id"])


def _queues() -> None:
    orders = ("time", "random", "uncertain", "disagreement", "second_opinion")
    op.create_table(
        "review_queues",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("unit", _choice("queueunit", "pose", "image"), nullable=False),
        sa.Column("order", _choice("queueorder", *orders), nullable=False),
        sa.Column("sample", sa.Integer(), nullable=True),
        sa.Column("seed", sa.Integer(), nullable=True),
        sa.Column("double", sa.Boolean(), nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        _belongs("review_queues", "created_by_id", "users", "SET NULL"),
        _belongs("review_queues", "run_id", "runs", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_review_queues")),
    )
    op.create_index("ix_review_queues_run_id", "review_queues", ["run_id"])
    op.create_table(
        "review_queue_items",
        sa.Column("id", WIDE, nullable=False),
        sa.Column("queue_id", sa.Integer(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("slot", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=False),
        sa.Column("pose_id", WIDE, nullable=True),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("leased_until", MOMENT, nullable=True),
        sa.Column("done_at", MOMENT, nullable=True),
        _belongs("review_queue_items", "image_id", "images", "CASCADE"),
        _belongs("review_queue_items", "pose_id", "poses", "CASCADE"),
        _belongs("review_queue_items", "queue_id", "review_queues", "CASCADE"),
        _belongs("review_queue_items", "user_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_review_queue_items")),
        sa.UniqueConstraint(
            "queue_id",
            "position",
            "slot",
            name=op.f("uq_review_queue_items_queue_id_position_slot"),
        ),
    )
    op.create_index("ix_review_queue_items_image_id", "review_queue_items", ["image_id"])
    op.create_index("ix_review_queue_items_pose_id", "review_queue_items", ["pose_id"])
    op.create_index(
        "ix_review_queue_items_open",
        "review_queue_items",
        ["queue_id", "position", "slot"],
        sqlite_where=OPEN,
        postgresql_where=OPEN,
    )


def _notes() -> None:
    op.create_table(
        "bookmarks",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=False),
        sa.Column("pose_id", WIDE, nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        _belongs("bookmarks", "image_id", "images", "CASCADE"),
        _belongs("bookmarks", "pose_id", "poses", "CASCADE"),
        _belongs("bookmarks", "user_id", "users", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_bookmarks")),
    )
    op.create_index("ix_bookmarks_image_id", "bookmarks", ["image_id"])
    op.create_index("ix_bookmarks_pose_id", "bookmarks", ["pose_id"])
    op.create_index(
        "uq_bookmarks_place",
        "bookmarks",
        ["user_id", "image_id", sa.text("coalesce(pose_id, 0)")],
        unique=True,
    )
    op.create_table(
        "comments",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=False),
        sa.Column("pose_id", WIDE, nullable=True),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("text", sa.Text(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        _belongs("comments", "image_id", "images", "CASCADE"),
        _belongs("comments", "pose_id", "poses", "CASCADE"),
        _belongs("comments", "user_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_comments")),
    )
    op.create_index("ix_comments_image_id", "comments", ["image_id"])
    op.create_index("ix_comments_pose_id", "comments", ["pose_id"])
    op.create_table(
        "key_bindings",
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("bindings", JSON, nullable=False),
        _belongs("key_bindings", "user_id", "users", "CASCADE"),
        sa.PrimaryKeyConstraint("user_id", name=op.f("pk_key_bindings")),
    )
