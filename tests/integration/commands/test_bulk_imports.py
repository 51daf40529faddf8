"""`quaymark import images` on whole cards: looked at first, and with archives among them."""

import json
from pathlib import Path

from app.db import Database
from app.imagery.repository import ImageFilter
from app.imagery.service import count_images
from app.tables.sites import Camera
from tests.factories.archives import HOSTILE, zipped
from tests.factories.imagery import photograph
from tests.factories.sites import make_camera, make_site
from tests.integration.commands.conftest import Shell


def card(database: Database, folder: Path) -> Camera:
    """Store a camera, and a folder with two photographs and a zip of two more."""
    (folder / "a.jpg").write_bytes(photograph(1, taken="2026:10:25 02:30:00"))
    (folder / "20260701_120000.jpg").write_bytes(photograph(2))
    packed = {"in/20260701_130000.jpg": photograph(3), "in/.DS_Store": b"x"}
    (folder / "day.zip").write_bytes(zipped(packed | {"in/again.jpg": photograph(2)}))
    with database.writing() as session:
        return make_camera(session, make_site(session), "East", timezone="Europe/Berlin")


def count(database: Database, camera: Camera) -> int:
    """Count a camera's images."""
    with database.reading() as session:
        return count_images(session, ImageFilter(camera_id=camera.id))


def test_a_card_is_looked_at_before_it_comes_in(
    quaymark: Shell, database: Database, tmp_path: Path
) -> None:
    """A dry run tells all and stores no image; the same command then goes on with that batch."""
    camera = card(database, tmp_path)
    looked = quaymark("import", "images", camera.id, tmp_path, "--dry-run", "--json")
    told = json.loads(looked.out)
    assert looked.code == 0, looked.error
    assert (told["status"], told["new"], told["known"]) == ("collecting", 3, 1)
    assert told["odd"] == {"repeated": 1, "skipped": 1, "repeated_hour": 1}
    assert count(database, camera) == 0
    done = quaymark("import", "images", camera.id, tmp_path, "--json")
    assert json.loads(done.out)["import_id"] == told["import_id"]
    assert json.loads(done.out)["last_at"] == "2026-10-25T00:30:00+00:00"
    assert count(database, camera) == 3


def test_a_hostile_archive_costs_itself_alone(
    quaymark: Shell, database: Database, tmp_path: Path
) -> None:
    """A bomb and an archive that is cut off are named with the reason; the rest comes in."""
    camera = card(database, tmp_path)
    (tmp_path / "bomb.zip").write_bytes(HOSTILE["bomb"][0])
    (tmp_path / "cut.zip").write_bytes((tmp_path / "day.zip").read_bytes()[:-40])
    outcome = quaymark("import", "images", camera.id, tmp_path, "--no-summer-time")
    assert outcome.code == 1
    assert "unfolds to more than 100 times" in outcome.error
    assert "cut.zip: this is a zip archive that is damaged or cut off" in outcome.error
    assert count(database, camera) == 3
