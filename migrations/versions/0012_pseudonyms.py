"""Sites may show vessels as pseudonyms, made with a key of their own.

Revision ID: 0012
Revises: 0011
"""

import secrets

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

KEY_BYTES = 32
SITES = sa.table("sites", sa.column("id"), sa.column("pseudonym_key", sa.LargeBinary()))


def upgrade() -> None:
    op.add_column(
        "sites",
        sa.Column("shows_pseudonyms", sa.Boolean(), nullable=False, server_default=sa.false()),
    )
    op.add_column(
        "sites",
        sa.Column("pseudonym_key", sa.LargeBinary(), nullable=False, server_default=sa.text("''")),
    )
    connection = op.get_bind()
    for site_id in connection.scalars(sa.select(SITES.c.id)).all():
        key = secrets.token_bytes(KEY_BYTES)
        connection.execute(sa.update(SITES).where(SITES.c.id == site_id).values(pseudonym_key=key))
    if connection.dialect.name == "postgresql":
        op.alter_column("sites", "pseudonym_key", server_default=None)


def downgrade() -> None:
    op.drop_column("sites", "pseudonym_key")
    op.drop_column("sites", "shows_pseudonyms")
