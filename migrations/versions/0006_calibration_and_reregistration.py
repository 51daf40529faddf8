"""Calibrations of cameras, turns told from photographs, and registrations that rest on them.

Revision ID: 0006
Revises: 0005
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

JSON = sa.JSON().with_variant(JSONB(), "postgresql")
METHODS = ("pnp", "homography_water", "homography_pca", "given")
METHOD_CHECK = "registrationmethod"


def upgrade() -> None:
    _allow((*METHODS, "rotation"))
    op.add_column("registrations", sa.Column("provenance", JSON, nullable=True))
    op.create_table(
        "camera_calibrations",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("camera_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column(
            "source",
            sa.Enum(
                "chequerboard",
                "entered",
                name="calibrationsource",
                native_enum=False,
                create_constraint=True,
                length=32,
            ),
            nullable=False,
        ),
        sa.Column(
            "status",
            sa.Enum(
                "queued",
                "running",
                "solved",
                "failed",
                name="calibrationstatus",
                native_enum=False,
                create_constraint=True,
                length=32,
            ),
            nullable=False,
        ),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("workflow_id", sa.String(length=64), nullable=True),
        sa.Column("corner_columns", sa.Integer(), nullable=True),
        sa.Column("corner_rows", sa.Integer(), nullable=True),
        sa.Column("square_mm", sa.Double(), nullable=True),
        sa.Column("intrinsics", JSON, nullable=True),
        sa.Column("deviations", JSON, nullable=True),
        sa.Column("rms_px", sa.Double(), nullable=True),
        sa.Column("coverage", sa.Double(), nullable=True),
        sa.Column("warnings", JSON, nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("activated_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.Column("activated_by_id", sa.Integer(), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["activated_by_id"],
            ["users.id"],
            name=op.f("fk_camera_calibrations_activated_by_id_users"),
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["camera_id"],
            ["cameras.id"],
            name=op.f("fk_camera_calibrations_camera_id_cameras"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["created_by_id"],
            ["users.id"],
            name=op.f("fk_camera_calibrations_created_by_id_users"),
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_camera_calibrations")),
        sa.UniqueConstraint(
            "camera_id", "number", name=op.f("uq_camera_calibrations_camera_id_number")
        ),
        sa.UniqueConstraint("workflow_id", name=op.f("uq_camera_calibrations_workflow_id")),
    )
    op.create_table(
        "calibration_photos",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("calibration_id", sa.Integer(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("file_name", sa.String(length=255), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("media_type", sa.String(length=32), nullable=False),
        sa.Column("corners", JSON, nullable=True),
        sa.Column("problem", sa.Text(), nullable=True),
        sa.Column("is_left_out", sa.Boolean(), nullable=False),
        sa.Column("rms_px", sa.Double(), nullable=True),
        sa.Column("tilt_deg", sa.Double(), nullable=True),
        sa.Column("searched_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(
            ["calibration_id"],
            ["camera_calibrations.id"],
            name=op.f("fk_calibration_photos_calibration_id_camera_calibrations"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibration_photos")),
        sa.UniqueConstraint(
            "calibration_id", "position", name=op.f("uq_calibration_photos_calibration_id_position")
        ),
    )
    op.create_table(
        "reregistrations",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("site_id", sa.Integer(), nullable=False),
        sa.Column("viewport_id", sa.Integer(), nullable=False),
        sa.Column("registration_id", sa.Integer(), nullable=False),
        sa.Column("reference_image_id", sa.Integer(), nullable=False),
        sa.Column("settings", JSON, nullable=False),
        sa.Column(
            "status",
            sa.Enum(
                "queued",
                "running",
                "succeeded",
                "failed",
                "cancelled",
                name="reregistrationstatus",
                native_enum=False,
                create_constraint=True,
                length=32,
            ),
            nullable=False,
        ),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("workflow_id", sa.String(length=64), nullable=False),
        sa.Column("image_count", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("created_by_id", sa.Integer(), nullable=True),
        sa.ForeignKeyConstraint(
            ["created_by_id"],
            ["users.id"],
            name=op.f("fk_reregistrations_created_by_id_users"),
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["reference_image_id"],
            ["images.id"],
            name=op.f("fk_reregistrations_reference_image_id_images"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["registration_id"],
            ["registrations.id"],
            name=op.f("fk_reregistrations_registration_id_registrations"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["site_id"],
            ["sites.id"],
            name=op.f("fk_reregistrations_site_id_sites"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["viewport_id"],
            ["viewports.id"],
            name=op.f("fk_reregistrations_viewport_id_viewports"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_reregistrations")),
        sa.UniqueConstraint("workflow_id", name=op.f("uq_reregistrations_workflow_id")),
    )
    op.create_index(
        op.f("ix_reregistrations_site_id"), "reregistrations", ["site_id"], unique=False
    )
    op.create_index(
        op.f("ix_reregistrations_viewport_id"), "reregistrations", ["viewport_id"], unique=False
    )
    op.create_table(
        "pointings",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("reregistration_id", sa.Integer(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("rotation_from_reference", JSON, nullable=False),
        sa.Column("angle_deg", sa.Double(), nullable=False),
        sa.Column("covariance", JSON, nullable=False),
        sa.Column("first_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("last_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("image_count", sa.Integer(), nullable=False),
        sa.Column(
            "state",
            sa.Enum(
                "proposed",
                "accepted",
                "rejected",
                name="pointingstate",
                native_enum=False,
                create_constraint=True,
                length=32,
            ),
            nullable=False,
        ),
        sa.Column("decided_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("decided_by_id", sa.Integer(), nullable=True),
        sa.Column("viewport_id", sa.Integer(), nullable=True),
        sa.Column("note", sa.Text(), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["decided_by_id"],
            ["users.id"],
            name=op.f("fk_pointings_decided_by_id_users"),
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["reregistration_id"],
            ["reregistrations.id"],
            name=op.f("fk_pointings_reregistration_id_reregistrations"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["viewport_id"],
            ["viewports.id"],
            name=op.f("fk_pointings_viewport_id_viewports"),
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_pointings")),
    )
    op.create_index(
        op.f("ix_pointings_reregistration_id"), "pointings", ["reregistration_id"], unique=False
    )
    op.create_table(
        "reregistration_images",
        sa.Column("reregistration_id", sa.Integer(), nullable=False),
        sa.Column("image_id", sa.Integer(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("pointing_id", sa.Integer(), nullable=True),
        sa.Column("refusal", sa.String(length=32), nullable=True),
        sa.Column("message", sa.Text(), nullable=True),
        sa.Column("rotation_from_reference", JSON, nullable=True),
        sa.Column("covariance", JSON, nullable=True),
        sa.Column("angle_deg", sa.Double(), nullable=True),
        sa.Column("inliers", sa.Integer(), nullable=True),
        sa.Column("hull_share", sa.Double(), nullable=True),
        sa.Column("rmse_px", sa.Double(), nullable=True),
        sa.Column("keyframe_ids", JSON, nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("done_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(
            ["image_id"],
            ["images.id"],
            name=op.f("fk_reregistration_images_image_id_images"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["pointing_id"],
            ["pointings.id"],
            name=op.f("fk_reregistration_images_pointing_id_pointings"),
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["reregistration_id"],
            ["reregistrations.id"],
            name=op.f("fk_reregistration_images_reregistration_id_reregistrations"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint(
            "reregistration_id", "image_id", name=op.f("pk_reregistration_images")
        ),
    )
    op.create_index(
        op.f("ix_reregistration_images_image_id"),
        "reregistration_images",
        ["image_id"],
        unique=False,
    )
    op.create_index(
        "ix_reregistration_images_position",
        "reregistration_images",
        ["reregistration_id", "position"],
        unique=False,
    )


def downgrade() -> None:
    op.drop_index("ix_reregistration_images_position", table_name="reregistration_images")
    op.drop_index(op.f("ix_reregistration_images_image_id"), table_name="reregistration_images")
    op.drop_table("reregistration_images")
    op.drop_index(op.f("ix_pointings_reregistration_id"), table_name="pointings")
    op.drop_table("pointings")
    op.drop_index(op.f("ix_reregistrations_viewport_id"), table_name="reregistrations")
    op.drop_index(op.f("ix_reregistrations_site_id"), table_name="reregistrations")
    op.drop_table("reregistrations")
    op.drop_table("calibration_photos")
    op.drop_table("camera_calibrations")
    op.drop_column("registrations", "provenance")
    # A turned registration is a pose that is known: all that the older tables can say of it.
    op.execute("UPDATE registrations SET method = 'given' WHERE method = 'rotation'")
    _allow(METHODS)


def _allow(methods: tuple[str, ...]) -> None:
    """Let a registration's method be one of these; SQLite copies the table for it."""
    condition = sa.column("method").in_(methods)
    if op.get_bind().dialect.name == "sqlite":
        # The old check is not copied: SQLite does not tell of it.
        with op.batch_alter_table("registrations", recreate="always") as batch_op:
            batch_op.create_check_constraint(METHOD_CHECK, condition)
        return
    op.drop_constraint(op.f(f"ck_registrations_{METHOD_CHECK}"), "registrations", type_="check")
    op.create_check_constraint(op.f(f"ck_registrations_{METHOD_CHECK}"), "registrations", condition)
