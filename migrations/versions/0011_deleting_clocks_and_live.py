"""Deleting for a while, clocks of cameras, and what goes on by itself.

Revision ID: 0011
Revises: 0010
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(JSONB(), "postgresql")
MOMENT = sa.DateTime(timezone=True)
PRESENT = sa.text("deleted_at IS NULL")
# Tables with the columns of a name that is unique among what is not deleted.
NAMED = {"sites": ["name"], "cameras": ["site_id", "name"], "viewports": ["camera_id", "name"]}
CAMERA_KEY = "fk_api_tokens_camera_id_cameras"


def upgrade() -> None:
    for make in (_deletions, _clocks, _watched, _standing, _retention):
        make()
    for table in (*NAMED, "runs"):
        op.add_column(table, sa.Column("deleted_at", MOMENT, nullable=True))
    for table in (*NAMED, "runs", "images"):
        op.add_column(table, sa.Column("deletion_id", sa.Integer(), nullable=True))
    for table, columns in NAMED.items():
        unique = f"uq_{table}_{'_'.join(columns)}"
        with op.batch_alter_table(table) as batch_op:
            batch_op.drop_constraint(unique, type_="unique")
        op.create_index(
            unique, table, columns, unique=True, sqlite_where=PRESENT, postgresql_where=PRESENT
        )
    for table in (*NAMED, "runs", "images"):
        op.create_index(op.f(f"ix_{table}_deletion_id"), table, ["deletion_id"])
        op.create_index(
            f"ix_{table}_deleted",
            table,
            ["id"],
            sqlite_where=sa.text("deleted_at IS NOT NULL"),
            postgresql_where=sa.text("deleted_at IS NOT NULL"),
        )
    op.add_column(
        "runs",
        sa.Column("has_changed_images", sa.Boolean(), nullable=False, server_default=sa.false()),
    )
    op.add_column("run_images", sa.Column("captured_at", MOMENT, nullable=True))
    with op.batch_alter_table("api_tokens") as batch_op:
        batch_op.add_column(sa.Column("camera_id", sa.Integer(), nullable=True))
        batch_op.create_foreign_key(
            CAMERA_KEY, "cameras", ["camera_id"], ["id"], ondelete="CASCADE"
        )
    op.create_index(op.f("ix_api_tokens_camera_id"), "api_tokens", ["camera_id"])


def downgrade() -> None:
    op.drop_index(op.f("ix_api_tokens_camera_id"), table_name="api_tokens")
    op.execute("DELETE FROM api_tokens WHERE camera_id IS NOT NULL")
    with op.batch_alter_table("api_tokens") as batch_op:
        batch_op.drop_constraint(CAMERA_KEY, type_="foreignkey")
        batch_op.drop_column("camera_id")
    op.drop_column("run_images", "captured_at")
    op.drop_column("runs", "has_changed_images")
    for table in ("retention_rules", "standing_runs", "watched_files", "watched_folders"):
        op.drop_table(table)
    for table in ("clock_estimates", "clock_offsets", "deletions"):
        op.drop_table(table)
    # The older tables know no deleting: what is hidden is removed, runs before what they rest on.
    for table in ("runs", "images", "viewports", "cameras", "sites"):
        if table != "images":
            rows = sa.table(table, sa.column("deleted_at"))
            op.execute(sa.delete(rows).where(rows.c.deleted_at.is_not(None)))
        op.drop_index(f"ix_{table}_deleted", table_name=table)
        op.drop_index(op.f(f"ix_{table}_deletion_id"), table_name=table)
    for table, columns in NAMED.items():
        unique = f"uq_{table}_{'_'.join(columns)}"
        op.drop_index(unique, table_name=table)
        with op.batch_alter_table(table) as batch_op:
            batch_op.create_unique_constraint(unique, columns)
    for table in (*NAMED, "runs"):
        op.drop_column(table, "deleted_at")
    for table in (*NAMED, "runs", "images"):
        op.drop_column(table, "deletion_id")


def _key(table: str, column: str, other: str, ondelete: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column], [f"{other}.id"], name=op.f(f"fk_{table}_{column}_{other}"), ondelete=ondelete
    )


def _choice(name: str, *values: str) -> sa.Enum:
    return sa.Enum(*values, name=name, native_enum=False, create_constraint=True, length=32)


def _deletions() -> None:
    op.create_table(
        "deletions",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("entity", sa.String(length=32), nullable=False),
        sa.Column("entity_id", sa.Integer(), nullable=True),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("label", sa.String(length=300), nullable=False),
        sa.Column("counts", JSON, nullable=False),
        sa.Column("deleted_at", MOMENT, nullable=False),
        sa.Column("deleted_by_id", sa.Integer(), nullable=True),
        _key("deletions", "deleted_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_deletions")),
    )
    op.create_index(op.f("ix_deletions_deleted_at"), "deletions", ["deleted_at"])
    op.create_index(op.f("ix_deletions_site_id"), "deletions", ["site_id"])


def _clocks() -> None:
    op.create_table(
        "clock_offsets",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("camera_id", sa.Integer(), nullable=False),
        sa.Column("valid_from", MOMENT, nullable=True),
        sa.Column("valid_until", MOMENT, nullable=True),
        sa.Column("offset_s", sa.Double(), nullable=False),
        sa.Column("low_s", sa.Double(), nullable=True),
        sa.Column("high_s", sa.Double(), nullable=True),
        sa.Column("source", _choice("offsetsource", "given", "estimated"), nullable=False),
        sa.Column("note", sa.String(length=500), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("undone_at", MOMENT, nullable=True),
        _key("clock_offsets", "camera_id", "cameras", "CASCADE"),
        _key("clock_offsets", "created_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_clock_offsets")),
    )
    op.create_index(op.f("ix_clock_offsets_camera_id"), "clock_offsets", ["camera_id"])
    op.create_table(
        "clock_estimates",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("camera_id", sa.Integer(), nullable=False),
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("begin", MOMENT, nullable=True),
        sa.Column("end", MOMENT, nullable=True),
        sa.Column(
            "status", _choice("estimatestatus", "queued", "succeeded", "failed"), nullable=False
        ),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("workflow_id", sa.String(length=64), nullable=False),
        sa.Column("result", JSON, nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        _key("clock_estimates", "camera_id", "cameras", "CASCADE"),
        _key("clock_estimates", "created_by_id", "users", "SET NULL"),
        _key("clock_estimates", "run_id", "runs", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_clock_estimates")),
        sa.UniqueConstraint("workflow_id", name=op.f("uq_clock_estimates_workflow_id")),
    )
    for column in ("camera_id", "run_id"):
        op.create_index(op.f(f"ix_clock_estimates_{column}"), "clock_estimates", [column])


def _watched() -> None:
    op.create_table(
        "watched_folders",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("camera_id", sa.Integer(), nullable=False),
        sa.Column("path", sa.String(length=1000), nullable=False),
        sa.Column("moves_files", sa.Boolean(), nullable=False),
        sa.Column("paused_at", MOMENT, nullable=True),
        sa.Column("looked_at", MOMENT, nullable=True),
        sa.Column("trouble", sa.Text(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        _key("watched_folders", "camera_id", "cameras", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_watched_folders")),
        sa.UniqueConstraint("camera_id", "path", name=op.f("uq_watched_folders_camera_id_path")),
    )
    op.create_index(op.f("ix_watched_folders_camera_id"), "watched_folders", ["camera_id"])
    op.create_table(
        "watched_files",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("folder_id", sa.Integer(), nullable=False),
        sa.Column("path", sa.String(length=1000), nullable=False),
        sa.Column("size_bytes", sa.BigInteger(), nullable=False),
        sa.Column("modified_ns", sa.BigInteger(), nullable=False),
        sa.Column(
            "status",
            _choice("watchedfilestatus", "waiting", "taken", "known", "refused"),
            nullable=False,
        ),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("seen_at", MOMENT, nullable=False),
        _key("watched_files", "folder_id", "watched_folders", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_watched_files")),
        sa.UniqueConstraint("folder_id", "path", name=op.f("uq_watched_files_folder_id_path")),
    )


def _standing() -> None:
    op.create_table(
        "standing_runs",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("viewport_id", sa.Integer(), nullable=False),
        sa.Column("model_id", sa.Integer(), nullable=False),
        sa.Column("run_id", sa.Integer(), nullable=True),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("preset", sa.String(length=32), nullable=False),
        sa.Column("parameters", JSON, nullable=False),
        sa.Column("ais_wait_s", sa.Double(), nullable=False),
        sa.Column("paused_at", MOMENT, nullable=True),
        sa.Column("looked_at", MOMENT, nullable=True),
        sa.Column("trouble", sa.Text(), nullable=True),
        sa.Column("last_report_id", sa.BigInteger(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        _key("standing_runs", "viewport_id", "viewports", "CASCADE"),
        _key("standing_runs", "model_id", "models", "RESTRICT"),
        _key("standing_runs", "run_id", "runs", "SET NULL"),
        _key("standing_runs", "created_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_standing_runs")),
        sa.UniqueConstraint("run_id", name=op.f("uq_standing_runs_run_id")),
    )
    op.create_index(op.f("ix_standing_runs_viewport_id"), "standing_runs", ["viewport_id"])


def _retention() -> None:
    op.create_table(
        "retention_rules",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("camera_id", sa.Integer(), nullable=True),
        sa.Column(
            "kind",
            _choice("retentionkind", "images", "ais_positions", "previews"),
            nullable=False,
        ),
        sa.Column("keep_days", sa.Integer(), nullable=False),
        sa.Column("takes_judged", sa.Boolean(), nullable=False),
        sa.Column("is_active", sa.Boolean(), nullable=False),
        sa.Column("applied_at", MOMENT, nullable=True),
        sa.Column("applied_count", sa.Integer(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        _key("retention_rules", "site_id", "sites", "CASCADE"),
        _key("retention_rules", "camera_id", "cameras", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_retention_rules")),
    )
    for column in ("site_id", "camera_id"):
        op.create_index(op.f(f"ix_retention_rules_{column}"), "retention_rules", [column])
