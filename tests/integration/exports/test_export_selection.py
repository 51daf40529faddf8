"""What is selected: every filter against plain SQL, parts without leakage, what changed since."""

import io
import json
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
import sqlalchemy as sa

from app.db import Database
from app.exports.filters import ExportFilters
from app.exports.making import write_export
from app.exports.selection_repository import PoseSelection
from app.tables.exports import Export
from app.tables.identity import User
from app.tables.imagery import Image
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose
from tests.factories.imagery import NOON
from tests.factories.runs import (
    FIRST_MMSI,
    Harbour,
    make_harbour,
    make_pose,
    make_review,
    make_run,
    make_vessel,
)
from tests.integration.exports.test_corrected_exports import correction

FORMATS = ("coco", "bop", "kitti", "bonk", "parquet", "ndjson", "csv")


def written(database: Database, format_name: str = "ndjson", **asked: Any) -> bytes:
    """Return the file of an export; `options` and `anonymise` aside, what is given are filters."""
    target = io.BytesIO()
    export = Export(
        format=format_name,
        options=asked.pop("options", {}),
        anonymise=asked.pop("anonymise", True),
        site_ids=None,
        filters=asked,
    )
    write_export(database, export, target)
    return target.getvalue()


def lines_of(database: Database, **asked: Any) -> list[dict[str, Any]]:
    """Return the lines of a complete NDJSON export but its last."""
    *lines, end = [json.loads(line) for line in written(database, **asked).splitlines()]
    assert end["complete"]
    return lines


def selected(database: Database, **filters: Any) -> list[int]:
    """Return the ids of the poses that are exported."""
    return [line["id"] for line in lines_of(database, **filters) if line["type"] == "pose"]


@pytest.fixture
def poses(database: Database, harbour: Harbour, make_user: Callable[..., User]) -> list[int]:
    """Give poses that differ in all that can be filtered by; two people graded some of them."""
    ada, ben = make_user("reviewer"), make_user("reviewer")
    with database.writing() as session:
        run = make_run(session, harbour, [3])
        make_pose(session, run, harbour.images[1], centroid_in_cam_m=[0.0, 30.0, 1000.0])
        make_pose(session, run, harbour.images[1], FIRST_MMSI + 7, flags=["cut_left", "cut_top"])
        make_pose(session, run, harbour.images[2], person_made=True)
        found = session.scalars(sa.select(Pose).order_by(Pose.id)).all()
        make_review(session, found[0], ada.id, Grade.GOOD)
        make_review(session, found[0], ben.id, Grade.BAD, second_opinion=True)
        make_review(session, found[1], ada.id, Grade.OK)
        make_review(session, found[1], ben.id, Grade.OK, second_opinion=True)
        make_review(session, found[2], ada.id, Grade.GOOD)
        make_review(session, found[2], ben.id, Grade.WRONG, settles=True)
        session.add(correction(found[3], 1, ada))
        session.add(correction(found[4], 1, ada, mmsi=FIRST_MMSI + 9))
        return [pose.id for pose in found]


def test_every_filter_selects_what_plain_sql_does(database: Database, poses: list[int]) -> None:
    """Each filter alone, against the poses somebody would pick by hand."""
    minute = timedelta(minutes=1)
    with database.reading() as session:
        image_ids = session.scalars(sa.select(Image.id).order_by(Image.id)).all()
        ada = session.scalar(sa.select(Review.user_id).order_by(Review.id).limit(1))
        viewport = session.scalar(sa.select(Image.viewport_id).limit(1))
    cases: list[tuple[dict[str, Any], list[int]]] = [
        ({"viewport_id": viewport}, [0, 1, 2, 3, 4, 5]),
        ({"image_id": image_ids[1]}, [3, 4]),
        ({"from": (NOON + minute).isoformat()}, [3, 4, 5]),
        ({"to": (NOON + minute).isoformat()}, [0, 1, 2]),
        ({"from": NOON.isoformat(), "to": (NOON + 2 * minute).isoformat()}, [0, 1, 2, 3, 4]),
        ({"mmsi": FIRST_MMSI + 7}, [4]),
        ({"mmsi": FIRST_MMSI + 9}, []),
        ({"mmsi": FIRST_MMSI + 9, "poses": "corrected"}, [4]),
        ({"mmsi": FIRST_MMSI + 7, "poses": "corrected"}, []),
        ({"grade": ["good"]}, [0]),
        ({"grade": ["good"], "verdict": "newest"}, []),
        ({"grade": ["bad"], "verdict": "newest"}, [0]),
        ({"grade": ["ungraded"]}, [3, 4, 5]),
        ({"grade": ["ungraded", "ok"]}, [1, 3, 4, 5]),
        ({"grade": ["ungraded"], "verdict": "consensus"}, [0, 3, 4, 5]),
        ({"grade": ["wrong"], "verdict": "consensus"}, [2]),
        ({"state": "graded"}, [0, 1, 2]),
        ({"state": "disagreement"}, [0]),
        ({"state": "settled"}, [2]),
        ({"reviewer": ada}, [0, 1, 2]),
        ({"range_min_m": 500}, [3]),
        ({"range_max_m": 300.0}, []),
        ({"range_max_m": 300.02, "range_min_m": 300.01}, [0, 1, 2, 4, 5]),
        ({"range_max_m": 500, "flag": "cut_top"}, [4]),
        ({"flag": "cut"}, []),
        ({"corrected": True}, [3, 4]),
        ({"corrected": False, "person_made": False}, [0, 1, 2]),
        ({"person_made": True}, [5]),
    ]
    for filters, wanted in cases:
        assert selected(database, **filters) == [poses[place] for place in wanted], filters


def test_the_verdict_that_counts_is_the_one_written(database: Database, poses: list[int]) -> None:
    """The grade beside a pose is by the same rule as the filter, and the manifest counts it."""
    for verdict, grades in (
        ("standing", ["good", "ok", "wrong"]),
        ("newest", ["bad", "ok", "wrong"]),
        ("consensus", [None, "ok", "wrong"]),
    ):
        data = written(database, verdict=verdict, to=(NOON + timedelta(minutes=1)).isoformat())
        *lines, end = [json.loads(line) for line in data.splitlines()]
        found = [line["review"] and line["review"]["grade"] for line in lines]
        assert found == grades
        assert sum(end["counts"]["grades"].values()) == len(lines) == len(poses) - 3


@pytest.mark.parametrize("format_name", FORMATS)
def test_files_tell_no_identity_and_nothing_of_the_moment(
    database: Database, poses: list[int], format_name: str
) -> None:
    """Twice the same bytes, and neither number nor name of a vessel, in archives either."""
    with database.writing() as session:
        make_vessel(session, FIRST_MMSI, "ANNEGRET")
        image = session.scalars(sa.select(Image).order_by(Image.id)).first()
        assert image is not None
        image.file_name = "Annegret II.jpg"
    data = written(database, format_name, mmsi=FIRST_MMSI)
    assert data == written(database, format_name, mmsi=FIRST_MMSI)
    assert poses
    content = data
    if format_name in {"bop", "kitti", "bonk"}:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            content = b"".join(name.encode() + archive.read(name) for name in archive.namelist())
    for telling in (str(FIRST_MMSI).encode(), b"annegret"):
        assert telling not in content.lower()


def test_vessels_and_convoys_are_in_one_part(database: Database, harbour: Harbour) -> None:
    """Vessels seen side by side share a part, whichever seed draws it; others are spread."""
    with database.writing() as session:
        run = make_run(session, harbour)
        for number in range(30):
            place = {"lat_deg": 53.0 + 0.01 * number, "length_m": 50.0, "heading_deg": 0.0}
            make_pose(session, run, harbour.images[0], FIRST_MMSI + 2 * number, **place)
            beside = place | {"lat_deg": place["lat_deg"] + 60 / 111_320}
            make_pose(session, run, harbour.images[0], FIRST_MMSI + 2 * number + 1, **beside)
            make_pose(session, run, harbour.images[1], FIRST_MMSI + 2 * number + 1, **beside)
    seen = set()
    for seed in range(3):
        split = {"by": "vessel", "seed": seed, "train": 0.5, "val": 0.25, "test": 0.25}
        lines = lines_of(database, options={"split": split}, anonymise=False)
        part_of = {(int(line["vessel"]) - FIRST_MMSI) // 2: line["split"] for line in lines}
        assert all(
            line["split"] == part_of[(int(line["vessel"]) - FIRST_MMSI) // 2] for line in lines
        )
        assert set(part_of.values()) == {"train", "val", "test"}
        seen.add(tuple(part_of.values()))
    assert len(seen) == 3


def test_a_day_of_all_cameras_is_in_one_part(database: Database) -> None:
    """Two cameras of a site, two weeks: a local day is never in two parts."""
    with database.writing() as session:
        for _ in range(2):
            harbour = make_harbour(session, images=14, timezone="Pacific/Auckland")
            for day, image in enumerate(harbour.images):
                session.merge(image).captured_at = NOON + timedelta(
                    days=day // 2, hours=6 * (day % 2)
                )
            make_run(session, harbour, [1] * 14)
    split = {"by": "day", "seed": 1, "train": 0.5, "val": 0.25, "test": 0.25}
    lines = lines_of(database, options={"split": split})
    parts: dict[object, set[str]] = {}
    for line in lines:
        moment = datetime.fromisoformat(line["image"]["captured_at"])
        parts.setdefault((moment + timedelta(hours=12)).date(), set()).add(line["split"])
    assert all(len(found) == 1 for found in parts.values())
    assert len(set().union(*parts.values())) > 1


def test_a_pull_reads_indexes_and_scans_no_table(database: Database) -> None:
    """SQLite's plan searches each table that may have changed by its own index."""
    if not database.is_sqlite:
        pytest.skip("plans of SQLite are stable; Postgres plans by its statistics")
    filters = ExportFilters(updated_since=datetime(2026, 1, 1, tzinfo=UTC))
    asked: list[tuple[str, Any]] = []

    def note(_connection: Any, _cursor: Any, statement: str, values: Any, *_: Any) -> None:
        asked.append((statement, values))

    with database.reading() as session:
        connection = session.connection()
        sa.event.listen(connection, "before_cursor_execute", note)
        selection = PoseSelection(filters, None, None)
        assert list(selection.gone(session, selection.chosen(session))) == []
        sa.event.remove(connection, "before_cursor_execute", note)
        steps = [
            row[3]
            for statement, values in asked
            for row in connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", values)
        ]
    tables = ("poses", "reviews", "corrections", "images", "runs")
    assert not {f"SCAN {table}" for table in tables} & {*steps}, steps
    wanted = ("ix_poses_created_at", "ix_poses_changed", "ix_reviews_created_at")
    for index in (*wanted, "ix_reviews_words_at", "ix_images_changed", "ix_runs_changed"):
        assert any(index in step for step in steps), steps
