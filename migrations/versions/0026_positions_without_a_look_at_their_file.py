"""Positions stored on Postgres without a look at their file, which took a third of an import.

Revision ID: 0026
Revises: 0025
"""

from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None

TABLE = "ais_positions"
CONSTRAINT = "fk_ais_positions_file_id_ais_files"


def upgrade() -> None:
    if op.get_bind().dialect.name == "postgresql":
        op.drop_constraint(CONSTRAINT, TABLE, type_="foreignkey")


def downgrade() -> None:
    if op.get_bind().dialect.name == "postgresql":
        op.create_foreign_key(
            CONSTRAINT, TABLE, "ais_files", ["file_id"], ["id"], ondelete="CASCADE"
        )
