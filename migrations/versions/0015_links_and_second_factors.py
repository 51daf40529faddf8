"""People come by links and stay by second factors; files are hashed again and again.

Revision ID: 0015
Revises: 0014
"""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)


def _added() -> dict[str, tuple[sa.Column[object], ...]]:
    return {
        "users": (
            sa.Column("removed_at", MOMENT, nullable=True),
            sa.Column("totp_secret", sa.String(64), nullable=True),
            sa.Column("totp_last_step", sa.BigInteger(), nullable=True),
            sa.Column("totp_required", sa.Boolean(), server_default=sa.false(), nullable=False),
        ),
        "login_sessions": (
            sa.Column("awaits_code", sa.Boolean(), server_default=sa.false(), nullable=False),
            sa.Column("user_agent", sa.String(200), server_default="", nullable=False),
            sa.Column("address", sa.String(64), server_default="", nullable=False),
        ),
    }


def _choice(name: str, *values: str) -> sa.Enum:
    return sa.Enum(*values, name=name, native_enum=False, create_constraint=True, length=32)


def upgrade() -> None:
    for table, columns in _added().items():
        for column in columns:
            op.add_column(table, column)
    op.create_table(
        "account_links",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("kind", _choice("linkkind", "invitation", "password_reset"), nullable=False),
        sa.Column("token_sha256", sa.String(64), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("email", sa.String(254), nullable=False),
        sa.Column(
            "role", _choice("role", "viewer", "reviewer", "operator", "admin"), nullable=True
        ),
        sa.Column("site_id", sa.Integer(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("expires_at", MOMENT, nullable=False),
        sa.Column("used_at", MOMENT, nullable=True),
        sa.ForeignKeyConstraint(
            ["user_id"],
            ["users.id"],
            name=op.f("fk_account_links_user_id_users"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["site_id"],
            ["sites.id"],
            name=op.f("fk_account_links_site_id_sites"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["created_by_id"],
            ["users.id"],
            name=op.f("fk_account_links_created_by_id_users"),
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_account_links")),
        sa.UniqueConstraint("token_sha256", name=op.f("uq_account_links_token_sha256")),
    )
    op.create_index(op.f("ix_account_links_user_id"), "account_links", ["user_id"])
    op.create_table(
        "recovery_codes",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("code_sha256", sa.String(64), nullable=False),
        sa.Column("used_at", MOMENT, nullable=True),
        sa.ForeignKeyConstraint(
            ["user_id"],
            ["users.id"],
            name=op.f("fk_recovery_codes_user_id_users"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_recovery_codes")),
    )
    op.create_index(op.f("ix_recovery_codes_user_id"), "recovery_codes", ["user_id"])
    op.create_table(
        "file_findings",
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("problem", _choice("fileproblem", "missing", "damaged"), nullable=False),
        sa.Column("found_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_file_findings")),
    )


def downgrade() -> None:
    for name in ("file_findings", "recovery_codes", "account_links"):
        op.drop_table(name)
    for table, columns in _added().items():
        for column in reversed(columns):
            op.drop_column(table, column.name)
