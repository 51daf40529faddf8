"""`quaymark import images`, `import ais`, `import detections` and `ais inspect`."""

import gzip
import json
from pathlib import Path

import pytest

from app.ais.service import LARGEST_MMSI, PositionFilter, list_positions
from app.db import Database
from app.imagery.repository import ImageFilter
from app.imagery.service import list_images
from app.paging import Paging
from app.tables.imagery import Image
from app.tables.sites import Camera
from tests.factories import ais
from tests.factories.detectors import results
from tests.factories.imagery import make_image, photograph
from tests.factories.sites import make_camera, make_site
from tests.integration.commands.conftest import Shell

ALL = Paging(limit=100, after=None)


@pytest.fixture
def camera(database: Database) -> Camera:
    """Store a camera of 64 x 48 px."""
    with database.writing() as session:
        return make_camera(session, make_site(session), "East")


def images_of(database: Database, camera: Camera) -> list[Image]:
    """Return a camera's images."""
    with database.reading() as session:
        return list(list_images(session, ImageFilter(camera_id=camera.id), ALL)[0])


def test_folders_of_photographs_come_in_once(
    quaymark: Shell, database: Database, camera: Camera, tmp_path: Path
) -> None:
    """Folders are searched to the bottom; a second import of the same bytes changes nothing."""
    deep = tmp_path / "photos" / "2026" / "november"
    deep.mkdir(parents=True)
    (deep / "20261122_100005.jpg").write_bytes(photograph(1))
    (deep.parent / "20261122_100010.JPG").write_bytes(photograph(2))
    (deep / "Thumbs.db").write_bytes(b"not for us")
    (deep / ".20261122_100015.jpg").write_bytes(b"a draft of somebody's")

    first = quaymark("import", "images", camera.id, tmp_path / "photos")
    again = quaymark("import", "images", camera.id, tmp_path / "photos")

    assert (first.code, again.code) == (0, 0), first.error + again.error
    assert "2 new, 0 known, 0 refused; 1 files with other endings left out" in first.out
    assert "0 new, 2 known, 0 refused" in again.out
    moments = {f"{image.captured_at:%H:%M:%S}" for image in images_of(database, camera)}
    assert moments == {"09:00:05", "09:00:10"}


def test_refused_photographs_are_named_and_fail_the_command(
    quaymark: Shell, database: Database, camera: Camera, tmp_path: Path
) -> None:
    """One bad file costs itself alone: the others come in, it is named with its reason, exit 1."""
    good, bad = tmp_path / "20261122_100005.jpg", tmp_path / "20261122_100010.jpg"
    good.write_bytes(photograph(1))
    bad.write_bytes(b"<html>")
    outcome = quaymark("import", "images", camera.id, good, bad)

    assert outcome.code == 1
    assert f"refused {bad}: " in outcome.error
    assert "neither JPEG nor PNG nor WebP" in outcome.error
    assert "1 of 2 photographs were refused" in outcome.error
    assert [image.file_name for image in images_of(database, camera)] == [good.name]


def test_an_unknown_camera_is_said(quaymark: Shell, tmp_path: Path) -> None:
    """Without the camera nothing is tried."""
    outcome = quaymark("import", "images", 4711, tmp_path)

    assert (outcome.code, outcome.error) == (1, "quaymark: there is no such camera\n")


def test_recordings_come_in_for_a_site(
    quaymark: Shell, database: Database, camera: Camera, tmp_path: Path
) -> None:
    """A recording goes to the site that is named; the same bytes again are known."""
    recording = tmp_path / "heard.csv.gz"
    recording.write_bytes(gzip.compress(ais.table(3)))
    outcome = quaymark("import", "ais", recording, "--site", camera.site_id)
    again = quaymark("import", "ais", recording, "--site", camera.site_id)

    assert outcome.code == 0, outcome.error
    assert outcome.out.startswith(f"imported {recording}: ")
    assert again.out.startswith(f"known {recording}: ")
    with database.reading() as session:
        rows, _ = list_positions(session, None, ALL, PositionFilter())
    assert [row.site_id for row in rows] == [camera.site_id] * 3
    assert all(row.mmsi <= LARGEST_MMSI for row in rows)


def test_what_is_no_recording_is_refused(quaymark: Shell, tmp_path: Path) -> None:
    """A picture among recordings is named and fails the command, the recordings come in."""
    (tmp_path / "a.csv").write_bytes(ais.table(2))
    (tmp_path / "b.jpg").write_bytes(photograph())
    outcome = quaymark("import", "ais", tmp_path / "a.csv", tmp_path / "b.jpg")

    assert outcome.code == 1
    assert "imported" in outcome.out
    assert "this is a JPEG image" in outcome.error
    assert "1 of 2 recordings were refused" in outcome.error


def test_inspecting_stores_nothing_and_accounts_for_every_line(
    quaymark: Shell, database: Database, shared_dir: Path
) -> None:
    """`ais inspect --json` decodes a real recording into the contract's shape, storing no row."""
    recording = shared_dir / "real" / "ais" / "dma_aislib_stream_29s_pghp.txt"
    outcome = quaymark("ais", "inspect", recording, "--json")

    assert outcome.code == 0, outcome.error
    found = json.loads(outcome.out)
    assert list(found) == [
        "lines",
        "sentences",
        "messages",
        "vessels",
        "first",
        "last",
        "formats",
        "left_out",
    ]
    lines = found["lines"]
    assert lines.pop("total") == len(recording.read_bytes().splitlines()) == sum(lines.values())
    assert found["vessels"] > 100
    with database.reading() as session:
        assert not list_positions(session, None, ALL, PositionFilter())[0]


def test_detections_of_another_detector_become_a_model(
    quaymark: Shell, database: Database, camera: Camera, tmp_path: Path
) -> None:
    """A COCO results file is found by its images' names and listed as a ready model."""
    with database.writing() as session:
        make_image(session, camera, file_name="a.jpg")
    file = tmp_path / "results.json"
    file.write_bytes(results(("a.jpg", [1.0, 2.0, 10.0, 20.0], 0.9)))
    outcome = quaymark("import", "detections", file, "--camera", camera.id, "--name", "mine")

    assert outcome.code == 0, outcome.error
    assert outcome.out == "mine: 1 boxes on 1 images\n"
    models = json.loads(quaymark("model", "list", "--json").out)
    assert [(m["name"], m["family"], m["status"]) for m in models] == [
        ("mine", "imported", "ready")
    ]


def test_detections_of_unknown_images_store_nothing(
    quaymark: Shell, camera: Camera, tmp_path: Path
) -> None:
    """A results file whose images are not here is refused, naming the entry."""
    file = tmp_path / "results.json"
    file.write_bytes(results(("b.jpg", [1.0, 2.0, 10.0, 20.0], 0.9)))
    outcome = quaymark("import", "detections", file, "--camera", camera.id, "--name", "mine")

    assert outcome.code == 1
    assert "[0].image_id" in outcome.error
    assert json.loads(quaymark("model", "list", "--json").out) == []
