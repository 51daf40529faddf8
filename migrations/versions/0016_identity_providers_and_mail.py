"""People sign in at an identity provider, and links go by mail.

Revision ID: 0016
Revises: 0015
"""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
MAILED = "ix_account_links_mailed_sha256"


def upgrade() -> None:
    op.create_table(
        "provider_identities",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("issuer", sa.String(500), nullable=False),
        sa.Column("subject", sa.String(255), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("last_used_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["user_id"],
            ["users.id"],
            name=op.f("fk_provider_identities_user_id_users"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_provider_identities")),
        sa.UniqueConstraint(
            "issuer", "subject", name=op.f("uq_provider_identities_issuer_subject")
        ),
        sa.UniqueConstraint(
            "user_id", "issuer", name=op.f("uq_provider_identities_user_id_issuer")
        ),
    )
    op.create_index(op.f("ix_provider_identities_user_id"), "provider_identities", ["user_id"])
    op.add_column(
        "login_sessions",
        sa.Column("factor_shown", sa.Boolean(), server_default=sa.false(), nullable=False),
    )
    op.add_column("account_links", sa.Column("mailed_sha256", sa.String(64), nullable=True))
    op.create_index(MAILED, "account_links", ["mailed_sha256"], unique=True)


def downgrade() -> None:
    op.drop_index(MAILED, "account_links")
    op.drop_column("account_links", "mailed_sha256")
    op.drop_column("login_sessions", "factor_shown")
    op.drop_table("provider_identities")
