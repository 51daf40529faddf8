"""The same data in both databases: every format's file is the same, byte for byte."""

import io
import shutil
from datetime import timedelta
from pathlib import Path

import sqlalchemy as sa

from app.db import Base, Database, now
from app.exports.formats import FORMATS
from app.exports.making import write_export
from app.tables.exports import Export
from app.tables.identity import Role
from app.tables.reviews import Grade
from app.tables.runs import Pose
from tests.factories.identity import make_user
from tests.factories.imagery import NOON
from tests.factories.runs import (
    CORNERS_PX,
    FIRST_MMSI,
    make_harbour,
    make_pose,
    make_review,
    make_run,
)
from tests.integration.conftest import TEMPLATE
from tests.integration.exports.test_corrected_exports import correction
from tests.postgres import PostgresCluster

NAME = "same_world"
ASKED: tuple[tuple[dict[str, object], dict[str, object]], ...] = (
    ({}, {}),
    ({"poses": "corrected", "verdict": "newest", "range_max_m": 1000}, {}),
    ({"updated_since": "2022-01-01T00:00:00Z"}, {"archive": True, "split": {"by": "vessel"}}),
)


def test_both_databases_give_the_same_bytes(
    sqlite_template: Path, postgres_cluster: PostgresCluster, tmp_path: Path
) -> None:
    """All formats, plain, corrected and split: neither numbers, order nor moments differ."""
    shutil.copy(sqlite_template, tmp_path / "here.db")
    here = Database(f"sqlite:///{tmp_path / 'here.db'}")
    there = Database(postgres_cluster.create(NAME, TEMPLATE))
    _fill(here)
    _copy(here, there)
    for filters, options in ASKED:
        for name in FORMATS:
            asked = Export(
                format=name, filters=filters, options=options, site_ids=None, anonymise=True
            )
            one, other = io.BytesIO(), io.BytesIO()
            assert write_export(here, asked, one).count == 4
            write_export(there, asked, other)
            assert one.getvalue() == other.getvalue(), (name, filters)
    here.dispose()
    there.dispose()
    postgres_cluster.drop(NAME)


def _fill(database: Database) -> None:
    """Make poses whose numbers have many digits, few, a sign and none."""
    with database.writing() as session:
        ada, ben = (make_user(session, Role.REVIEWER) for _ in range(2))
        harbour = make_harbour(session, images=3)
        run = make_run(session, harbour)
        poses = [
            make_pose(session, run, image, FIRST_MMSI + number, **changes)
            for number, (image, changes) in enumerate(
                zip([*harbour.images, harbour.images[0]], _CHANGES, strict=True)
            )
        ]
        make_review(session, poses[0], ada.id, Grade.BAD, reasons=["height", "other"])
        make_review(session, poses[0], ben.id, Grade.OK, second_opinion=True)
        make_review(session, poses[1], ada.id, created_at=NOON + timedelta(microseconds=1))
        session.add(correction(session.get_one(Pose, poses[2].id), 1, ada, deleted_at=now()))
        session.add(correction(session.get_one(Pose, poses[3].id), 1, ada, heading_deg=1 / 3))


_CHANGES: tuple[dict[str, object], ...] = (
    {"centroid_in_cam_m": [1 / 3, -1e-7, 300.0], "height_m": 0.1 + 0.2},
    {"rotvec_cam_from_vessel": [-0.0, 0, 1e-300], "correction_in_enu_m": [-1e16, 5, -0.0]},
    {
        "corners_in_image_px": [None, [-0.0, 1e16], [-3e300, 0.1], *CORNERS_PX[3:]],
        "flags": ["cut_left"],
    },
    {
        "position_covariance_in_enu_m2": [[4, 0.5, -0.0], [0.5, 9.25e-5, 0], [0, 0, 2.5]],
        "heading_sigma_deg": 2.5,
    },
)


def _copy(here: Database, there: Database) -> None:
    with here.engine.connect() as source, there.engine.begin() as target:
        target.execute(sa.text("SET session_replication_role = replica"))  # in any order
        for table in Base.metadata.sorted_tables:
            target.execute(table.delete())
            rows = [dict(row) for row in source.execute(table.select()).mappings()]
            if rows:
                target.execute(table.insert(), rows)
