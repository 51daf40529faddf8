"""Live feeds of AIS, and leases: which worker does what only one may do at a time.

Revision ID: 0009
Revises: 0008
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(postgresql.JSONB(), "postgresql")
MOMENT = sa.DateTime(timezone=True)
WIDE = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
IN_USE = sa.text("removed_at IS NULL")
LIVE = sa.text("feed_id IS NOT NULL")
REPORTS = ("ais_positions", "ais_statics")


def upgrade() -> None:
    op.create_table(
        "leases",
        sa.Column("name", sa.String(128), nullable=False),
        sa.Column("holder", sa.String(64), nullable=True),
        sa.Column("epoch", sa.BigInteger(), nullable=False),
        sa.Column("taken_at", MOMENT, nullable=False),
        sa.Column("renewed_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_leases"),
    )
    op.create_table(
        "ais_feeds",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("kind", _choice("feedkind", "tcp", "udp"), nullable=False),
        sa.Column("host", sa.String(255), nullable=False),
        sa.Column("port", sa.Integer(), nullable=False),
        sa.Column("allowed_senders", JSON, nullable=False),
        sa.Column("silent_after_s", sa.Double(), nullable=False),
        sa.Column("enabled", sa.Boolean(), nullable=False),
        sa.Column("started_at", MOMENT, nullable=False),
        sa.Column("removed_at", MOMENT, nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        _belongs("ais_feeds", "site_id", "sites", "CASCADE"),
        _belongs("ais_feeds", "created_by_id", "users", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_ais_feeds"),
    )
    op.create_index("ix_ais_feeds_site_id", "ais_feeds", ["site_id"])
    op.create_index(
        "uq_ais_feeds_site_id_name",
        "ais_feeds",
        ["site_id", "name"],
        unique=True,
        sqlite_where=IN_USE,
        postgresql_where=IN_USE,
    )
    op.create_table(
        "ais_feed_statuses",
        sa.Column("feed_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column(
            "condition",
            _choice("feedcondition", "waiting", "connected", "refused"),
            nullable=False,
        ),
        sa.Column("condition_since", MOMENT, nullable=False),
        sa.Column("peer", sa.String(64), nullable=True),
        sa.Column("connections", sa.Integer(), nullable=False),
        sa.Column("last_message_at", MOMENT, nullable=True),
        sa.Column("rate_per_s", sa.Double(), nullable=False),
        sa.Column("receiver_lag_s", sa.Double(), nullable=True),
        sa.Column("foreign_datagrams", WIDE, nullable=False),
        sa.Column("last_error", sa.String(500), nullable=True),
        sa.Column("last_error_at", MOMENT, nullable=True),
        sa.Column("accounting", JSON, nullable=False),
        sa.Column("written_at", MOMENT, nullable=False),
        _belongs("ais_feed_statuses", "feed_id", "ais_feeds", "CASCADE"),
        sa.PrimaryKeyConstraint("feed_id", name="pk_ais_feed_statuses"),
    )
    for table in REPORTS:
        with op.batch_alter_table(table) as batch:
            batch.add_column(sa.Column("feed_id", sa.Integer(), nullable=True))
            batch.create_foreign_key(
                f"fk_{table}_feed_id_ais_feeds",
                "ais_feeds",
                ["feed_id"],
                ["id"],
                ondelete="CASCADE",
            )
        op.create_index(
            f"ix_{table}_feed_id", table, ["feed_id"], sqlite_where=LIVE, postgresql_where=LIVE
        )


def downgrade() -> None:
    for table in REPORTS:
        op.drop_index(f"ix_{table}_feed_id", table)
        with op.batch_alter_table(table) as batch:
            batch.drop_constraint(f"fk_{table}_feed_id_ais_feeds", type_="foreignkey")
            batch.drop_column("feed_id")
    op.drop_table("ais_feed_statuses")
    op.drop_table("ais_feeds")
    op.drop_table("leases")


def _choice(name: str, *values: str) -> sa.Enum:
    return sa.Enum(*values, name=name, native_enum=False, create_constraint=True, length=32)


def _belongs(table: str, column: str, parent: str, then: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column],
        [f"{parent}.id"],
        name=f"fk_{table}_{column}_{parent}",
        ondelete=then,
    )
