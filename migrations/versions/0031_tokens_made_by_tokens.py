"""A token remembers the token that made it, so that it ends with it.

Revision ID: 0031
Revises: 0030
"""

import sqlalchemy as sa
from alembic import op

revision = "0031"
down_revision = "0030"
branch_labels = None
depends_on = None

CONSTRAINT = "fk_api_tokens_made_by_id_api_tokens"
INDEX = "ix_api_tokens_made_by_id"


def upgrade() -> None:
    with op.batch_alter_table("api_tokens") as table:
        table.add_column(sa.Column("made_by_id", sa.Integer(), nullable=True))
        table.create_foreign_key(
            CONSTRAINT, "api_tokens", ["made_by_id"], ["id"], ondelete="CASCADE"
        )
    op.create_index(INDEX, "api_tokens", ["made_by_id"])


def downgrade() -> None:
    op.drop_index(INDEX, "api_tokens")
    with op.batch_alter_table("api_tokens") as table:
        table.drop_constraint(CONSTRAINT, type_="foreignkey")
        table.drop_column("made_by_id")
