"""Calibration sets: judged poses for newcomers, and what they answered.

Revision ID: 0004
Revises: 0003
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(postgresql.JSONB(), "postgresql")
MOMENT = sa.DateTime(timezone=True)
WIDE = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "calibration_sets",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("from_truth", sa.Boolean(), nullable=False),
        sa.Column("seed", sa.Integer(), nullable=True),
        sa.Column("guideline_version", sa.Integer(), nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        _belongs("calibration_sets", "run_id", "runs", "CASCADE"),
        _belongs("calibration_sets", "created_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibration_sets")),
    )
    op.create_index("ix_calibration_sets_run_id", "calibration_sets", ["run_id"])
    op.create_table(
        "judged_poses",
        sa.Column("id", WIDE, nullable=False),
        sa.Column("set_id", sa.Integer(), nullable=False),
        sa.Column("pose_id", WIDE, nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("grade", _grade(), nullable=False),
        sa.Column("reasons", JSON, nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        _belongs("judged_poses", "set_id", "calibration_sets", "CASCADE"),
        _belongs("judged_poses", "pose_id", "poses", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_judged_poses")),
        sa.UniqueConstraint("set_id", "pose_id", name=op.f("uq_judged_poses_set_id_pose_id")),
    )
    op.create_index("ix_judged_poses_pose_id", "judged_poses", ["pose_id"])
    op.create_table(
        "practice_attempts",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("set_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("started_at", MOMENT, nullable=False),
        _belongs("practice_attempts", "set_id", "calibration_sets", "CASCADE"),
        _belongs("practice_attempts", "user_id", "users", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_practice_attempts")),
        sa.UniqueConstraint(
            "set_id", "user_id", "number", name=op.f("uq_practice_attempts_set_id_user_id_number")
        ),
    )
    op.create_index("ix_practice_attempts_user_id", "practice_attempts", ["user_id"])
    op.create_table(
        "practice_grades",
        sa.Column("id", WIDE, nullable=False),
        sa.Column("attempt_id", sa.Integer(), nullable=False),
        sa.Column("pose_id", WIDE, nullable=False),
        sa.Column("grade", _grade(), nullable=False),
        sa.Column("reasons", JSON, nullable=False),
        sa.Column("seconds", sa.Double(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        _belongs("practice_grades", "attempt_id", "practice_attempts", "CASCADE"),
        _belongs("practice_grades", "pose_id", "poses", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_practice_grades")),
        sa.UniqueConstraint(
            "attempt_id", "pose_id", name=op.f("uq_practice_grades_attempt_id_pose_id")
        ),
    )
    op.create_index("ix_practice_grades_pose_id", "practice_grades", ["pose_id"])


def downgrade() -> None:
    for table in ("practice_grades", "practice_attempts", "judged_poses", "calibration_sets"):
        op.drop_table(table)


def _grade() -> sa.Enum:
    return sa.Enum(
        "good",
        "ok",
        "bad",
        "wrong",
        name="grade",
        native_enum=False,
        create_constraint=True,
        length=32,
    )


def _belongs(table: str, column: str, parent: str, then: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column], [f"{parent}.id"], name=op.f(f"fk_{table}_{column}_{parent}"), ondelete=then
    )
