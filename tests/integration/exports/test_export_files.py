"""What is in an export's file: the right poses, of one moment, in the same bytes every time."""

import io
import json
import sys
from collections.abc import Callable
from typing import IO, Any

import pytest
import sqlalchemy as sa

from app.db import Database, now
from app.domain.pseudonyms import pseudonym
from app.exports import reading
from app.exports.making import write_export
from app.tables.ais import AisStatic
from app.tables.exports import Export
from app.tables.identity import User
from app.tables.imagery import Image
from app.tables.reviews import Grade
from app.tables.runs import Match, Pose
from app.tables.sites import Site
from tests.factories.imagery import NOON
from tests.factories.runs import (
    CORNERS_PX,
    FIRST_MMSI,
    Harbour,
    make_pose,
    make_review,
    make_run,
    make_vessel,
)


def written(
    database: Database,
    format_name: str = "ndjson",
    *,
    anonymise: bool = True,
    site_ids: list[int] | None = None,
    **filters: object,
) -> bytes:
    """Return the file of an export with these filters."""
    target = io.BytesIO()
    asked = Export(format=format_name, filters=filters, site_ids=site_ids, anonymise=anonymise)
    write_export(database, asked, target)
    return target.getvalue()


def poses_in(data: bytes) -> list[dict[str, Any]]:
    """Return the poses of a complete NDJSON file."""
    *poses, end = [json.loads(line) for line in data.decode().splitlines()]
    assert (end["complete"], end["poses"]) == (True, len(poses))
    return poses


def pose_ids(database: Database) -> list[int]:
    """Return the ids of all poses."""
    with database.reading() as session:
        return list(session.scalars(sa.select(Pose.id).order_by(Pose.id)))


def test_filters_select_together(
    database: Database, harbour: Harbour, make_user: Callable[..., User]
) -> None:
    """Run, site, camera and grades narrow the file; a grade is that of the newest verdict."""
    ada, ben = make_user("reviewer"), make_user("reviewer")
    with database.writing() as session:
        run = make_run(session, harbour, [3, 1])
        other = make_run(session, harbour, [1])
        poses = session.scalars(
            sa.select(Pose).where(Pose.run_id == run.id).order_by(Pose.id)
        ).all()
        make_review(session, poses[0], ada.id, Grade.GOOD)
        make_review(session, poses[1], ada.id, Grade.GOOD)
        make_review(session, poses[1], ben.id, Grade.BAD)
        make_review(session, poses[2], ada.id, Grade.OK)
    ids = [pose.id for pose in poses]

    def selected(**filters: object) -> list[int]:
        return [pose["id"] for pose in poses_in(written(database, **filters))]

    assert selected() == pose_ids(database)
    assert selected(run_id=run.id) == ids
    assert selected(run_id=run.id, grade=["good"]) == [ids[0]]
    assert selected(run_id=run.id, grade=["ok", "bad"]) == [ids[1], ids[2]]
    assert selected(run_id=other.id, grade=["good"]) == []
    assert selected(site_id=harbour.site.id, camera_id=harbour.camera.id) == pose_ids(database)
    assert selected(camera_id=harbour.camera.id + 1) == []
    assert selected(site_ids=[harbour.site.id + 1]) == []


@pytest.mark.parametrize("format_name", ["coco", "ndjson"])
def test_the_same_data_gives_the_same_bytes(
    database: Database, harbour: Harbour, format_name: str
) -> None:
    """Two exports with the same filters are equal byte for byte; another filter tells itself."""
    with database.writing() as session:
        run = make_run(session, harbour, [2, 2, 1])
    first, second = (written(database, format_name, run_id=run.id) for _ in range(2))
    assert first == second
    assert written(database, format_name) != first


@pytest.mark.parametrize("format_name", ["coco", "ndjson"])
def test_no_identity_is_anywhere_in_an_anonymised_file(
    database: Database, harbour: Harbour, make_user: Callable[..., User], format_name: str
) -> None:
    """Neither MMSI nor name, also where a photograph's file or a comment tells them."""
    person = make_user("reviewer", email="captain@harbour.example")
    with database.writing() as session:
        for image, name in zip(
            harbour.images,
            (f"{FIRST_MMSI}.jpg", "Annegret II.jpg", "20220714_120000.jpg"),
            strict=True,
        ):
            session.merge(image).file_name = name
        run = make_run(session, harbour, [1, 2, 1])
        make_vessel(session, FIRST_MMSI, "ANNEGRET II")
        make_vessel(session, FIRST_MMSI + 1, "Bugsier 7")
        session.add(AisStatic(mmsi=FIRST_MMSI, received_at=NOON, name="ANNEGRET II"))
        pose = session.scalars(sa.select(Pose).limit(1)).one()
        make_review(session, pose, person.id, Grade.BAD, comment="that is ANNEGRET II")
    data = written(database, format_name, run_id=run.id)
    text = data.decode().casefold()
    for telling in (str(FIRST_MMSI), str(FIRST_MMSI + 1), "annegret", "bugsier", "captain"):
        assert telling not in text
    assert "20220714_120000.jpg" in text
    with database.reading() as session:
        key = session.get_one(Site, run.site_id).pseudonym_key
    assert text.count(pseudonym(FIRST_MMSI, key).casefold()) == 3
    named = written(database, format_name, anonymise=False, run_id=run.id).decode()
    assert named.count(f'"{FIRST_MMSI}"') == 3
    assert "Annegret II.jpg" in named


@pytest.mark.parametrize("format_name", ["coco", "ndjson"])
def test_corners_without_a_projection_are_null(
    database: Database, harbour: Harbour, format_name: str
) -> None:
    """A corner behind the camera keeps its place in the file."""
    with database.writing() as session:
        run = make_run(session, harbour)
        make_pose(session, run, harbour.images[0], corners_in_image_px=[None, *CORNERS_PX[1:]])
    data = written(database, format_name)
    pose = json.loads(data)["annotations"][0] if format_name == "coco" else poses_in(data)[0]
    corners = pose["corners_2d" if format_name == "coco" else "corners_in_image_px"]
    assert corners == [None, *CORNERS_PX[1:]]


def test_deleted_photographs_are_not_exported(database: Database, harbour: Harbour) -> None:
    """Who deletes a photograph does not find it in the next data set."""
    with database.writing() as session:
        make_run(session, harbour, [1, 1])
        session.execute(
            sa.update(Image).where(Image.id == harbour.images[0].id).values(deleted_at=now())
        )
    data = json.loads(written(database, "coco"))
    assert [image["quaymark_image_id"] for image in data["images"]] == [harbour.images[1].id]
    assert len(data["annotations"]) == 1


def test_many_poses_come_in_order_without_gap(
    database: Database, harbour: Harbour, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Reading a few at a time gives each pose once, in order."""
    monkeypatch.setattr(reading, "POSES_AT_ONCE", 4)
    with database.writing() as session:
        make_run(session, harbour, [5, 3, 4])
        make_run(session, harbour, [1])
    assert [pose["id"] for pose in poses_in(written(database))] == pose_ids(database)


def test_a_second_process_writes_the_same_bytes_and_says_what_fails(
    database: Database, harbour: Harbour, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many poses are written on two cores: in order, a pose that cannot be is named.

    Where the other process ends, the first goes on alone.
    """
    with database.writing() as session:
        make_run(session, harbour, [3, 1, 3])
    alone = written(database, "coco")
    monkeypatch.setattr(reading, "POSES_AT_ONCE", 2)
    monkeypatch.setattr(reading, "MANY", 1)
    monkeypatch.setattr(reading, "cores", lambda: 2)
    assert written(database, "coco") == alone
    with monkeypatch.context() as patch:
        patch.setattr(sys, "executable", "/bin/false")
        assert written(database, "coco") == alone
    with database.writing() as session:
        session.execute(sa.update(Match).values(cost=float("inf")))
    with pytest.raises(ValueError, match="pose 1 holds a number that is not finite"):
        written(database, "coco")


class Interrupted(io.BytesIO):
    """A file during whose writing a run stores another pose."""

    def __init__(self, interrupt: Callable[[], None]) -> None:
        super().__init__()
        self._interrupt: Callable[[], None] | None = interrupt

    def write(self, data: Any) -> int:
        """Write, after the interruption the first time."""
        if self._interrupt is not None:
            self._interrupt()
            self._interrupt = None
        return super().write(data)


@pytest.mark.parametrize("format_name", ["coco", "ndjson"])
def test_an_export_beside_a_run_is_of_one_moment(
    database: Database,
    harbour: Harbour,
    monkeypatch: pytest.MonkeyPatch,
    format_name: str,
) -> None:
    """Poses stored while the file is written are in the next export, and break nothing."""
    monkeypatch.setattr(reading, "POSES_AT_ONCE", 1)
    with database.writing() as session:
        run = make_run(session, harbour, [2])

    def interrupt() -> None:
        with database.writing() as session:
            make_pose(session, run, session.get_one(Image, harbour.images[2].id))

    target: IO[bytes] = Interrupted(interrupt)
    asked = Export(format=format_name, filters={}, site_ids=None, anonymise=True)
    assert write_export(database, asked, target).count == 2
    assert write_export(database, asked, io.BytesIO()).count == 3
