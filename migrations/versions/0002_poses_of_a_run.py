"""An index for the poses of a run in their order: the next one to review comes from it.

Revision ID: 0002
Revises: 0001
"""

from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_index("ix_poses_run_order", "poses", ["run_id", "id"])


def downgrade() -> None:
    op.drop_index("ix_poses_run_order", table_name="poses")
