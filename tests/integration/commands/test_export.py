"""`quaymark export`."""

import json
from pathlib import Path

import pytest

from app.db import Database
from app.domain.pseudonyms import pseudonym
from app.tables.runs import Pose
from app.tables.sites import Site
from tests.factories.world import make_world
from tests.integration.commands.conftest import Shell

MMSI = 211234560


@pytest.fixture
def world(database: Database) -> dict[str, int]:
    """Store one of everything."""
    with database.writing() as session:
        return make_world(session, "Elbe", MMSI)


def poses_in(path: Path) -> list[dict[str, object]]:
    """Return the poses of an NDJSON export that is complete."""
    *poses, end = [json.loads(line) for line in path.read_text().splitlines()]
    assert end["complete"] is True
    return poses


def test_vessels_are_pseudonyms_unless_asked_for(
    quaymark: Shell, database: Database, world: dict[str, int], tmp_path: Path
) -> None:
    """An MMSI leaves the installation only with --with-identities."""
    out = tmp_path / "poses.ndjson"
    hidden = quaymark("export", "--format", "ndjson", "--out", out)
    assert (hidden.code, hidden.out) == (0, f"wrote 1 poses to {out}\n"), hidden.error
    with database.reading() as session:
        key = session.get_one(Site, world["site_id"]).pseudonym_key
    assert [pose["vessel"] for pose in poses_in(out)] == [pseudonym(MMSI, key)]

    quaymark(
        "export", "--format", "ndjson", "--out", out, "--with-identities", "--run", world["run_id"]
    )
    assert [pose["vessel"] for pose in poses_in(out)] == [str(MMSI)]


@pytest.mark.parametrize(
    ("option", "key"), [("--run", "run_id"), ("--site", "site_id"), ("--camera", "camera_id")]
)
def test_filters_select(
    quaymark: Shell,
    database: Database,
    world: dict[str, int],
    tmp_path: Path,
    option: str,
    key: str,
) -> None:
    """Each filter keeps what it names, leaves out all else, and may not name nothing."""
    with database.writing() as session:
        other = make_world(session, "Weser", MMSI + 1)
    out = tmp_path / "poses.json"
    for ids in (world, other):
        outcome = quaymark("export", "--format", "coco", "--out", out, option, ids[key])
        assert outcome.code == 0, outcome.error
        annotations = json.loads(out.read_text())["annotations"]
        assert [each["quaymark_pose_id"] for each in annotations] == [ids["pose_id"]]
    unknown = quaymark("export", "--format", "coco", "--out", out, option, 999_999)
    assert (unknown.code, unknown.error.count("\n")) == (1, 1)
    assert unknown.error.startswith("quaymark: there is no such")


def test_a_failed_export_leaves_the_old_file(
    quaymark: Shell, database: Database, world: dict[str, int], tmp_path: Path
) -> None:
    """The old file stands until the new one is complete, and no draft stays behind."""
    out = tmp_path / "exports" / "poses.ndjson"
    out.parent.mkdir()
    out.write_text("the old one")
    with database.writing() as session:
        # An unknown rotation cannot be written as a matrix.
        pose = session.get_one(Pose, world["pose_id"])
        pose.rotvec_cam_from_vessel = []
    outcome = quaymark("export", "--format", "ndjson", "--out", out)

    assert outcome.code not in {0, None}
    assert out.read_text() == "the old one"
    assert list(out.parent.iterdir()) == [out]


def test_a_folder_that_does_not_exist_is_one_line(quaymark: Shell, tmp_path: Path) -> None:
    """A path that cannot be written is named in one line."""
    outcome = quaymark("export", "--format", "coco", "--out", tmp_path / "none" / "poses.json")

    assert outcome.code == 1
    assert outcome.error.count("\n") == 1
    assert "No such file or directory" in outcome.error
