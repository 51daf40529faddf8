"""The demo as a newcomer starts it: everything made, detected by the shipped file, judged."""

import hashlib
import re
from inspect import signature
from pathlib import Path

import pytest
import sqlalchemy as sa

from app.config import Settings
from app.db import Database
from app.operation import harbour_site
from app.operation.commands import demo as demo_command
from app.operation.harbour_site import DETECTOR_NAME, HarbourChoice
from app.simulation import DETECTOR_FILE
from app.storage import Storage
from app.tables.detection import DetectionSet, Model
from app.tables.groundtruth import VesselTruth
from app.tables.imagery import Image
from app.tables.runs import Run, RunStatus
from tests.shell import run_quaymark


@pytest.fixture(scope="module")
def demo_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the data folder of a demo that is started again and again."""
    return tmp_path_factory.mktemp("demo")


def demo(folder: Path) -> str:
    """Run `quaymark demo --exit` on a small harbour; returns what it prints."""
    outcome = run_quaymark(
        *("demo", "--exit", "--images=4", "--size=640x480"),
        environment={"QUAYMARK_DATA_DIR": str(folder)},
    )
    assert outcome.code == 0, outcome.error
    return outcome.out


def count(folder: Path, *tables: type) -> list[int]:
    """Count the rows of tables."""
    database = Database(f"sqlite:///{folder / 'quaymark.db'}")
    with database.reading() as session:
        counts = [session.scalar(sa.select(sa.func.count()).select_from(one)) for one in tables]
    database.dispose()
    return [number or 0 for number in counts]


@pytest.mark.slow
def test_the_demo_detects_with_the_shipped_file_and_judges_its_poses(demo_folder: Path) -> None:
    """From an empty folder to errors against the truth, with the trained detector's own boxes."""
    text = demo(demo_folder)

    found = re.search(r"4 images, (\d+) detections, (\d+) poses", text)
    assert found, text
    assert int(found[1]) >= 1
    assert "Against the truth" in text
    if int(found[2]):
        for figure in ("horizontal", "vertical", "heading", "height", "ADD-S"):
            assert f"{figure} error" in text
    database = Database(f"sqlite:///{demo_folder / 'quaymark.db'}")
    with database.reading() as session:
        model = session.scalars(sa.select(Model)).one()
        used = set(session.scalars(sa.select(DetectionSet.model_sha256)))
        states = set(session.scalars(sa.select(Run.status)))
    database.dispose()
    assert (model.name, model.family) == (DETECTOR_NAME, "yolox")
    assert used == {model.sha256} == {hashlib.sha256(DETECTOR_FILE.read_bytes()).hexdigest()}
    assert states == {RunStatus.SUCCEEDED}


@pytest.mark.slow
def test_a_second_demo_makes_nothing_twice(demo_folder: Path) -> None:
    """Started again, the demo shows the same figures of the same rows."""
    first = demo(demo_folder)
    before = count(demo_folder, Image, VesselTruth, Model, DetectionSet, Run)
    again = demo(demo_folder)

    assert count(demo_folder, Image, VesselTruth, Model, DetectionSet, Run) == before
    figures = [[line for line in text.splitlines() if "error" in line] for text in (first, again)]
    assert figures[0] == figures[1]


def test_the_commands_defaults_are_the_harbour_called_demo_harbour() -> None:
    """`quaymark demo` without options makes the harbour whose name has no numbers."""
    defaults = {
        name: parameter.default for name, parameter in signature(demo_command).parameters.items()
    }
    width_px, _, height_px = str(defaults["size"]).partition("x")
    choice = HarbourChoice(defaults["seed"], defaults["images"], int(width_px), int(height_px))

    assert choice.site_name == "Demo harbour"


def test_an_interrupted_start_is_continued(database: Database, settings: Settings) -> None:
    """What was rendered before the power went is kept, and only the rest is rendered."""
    choice = HarbourChoice(seed=3, images=3, width_px=320, height_px=240)
    storage = Storage(settings.storage_url)
    rendered: list[str] = []

    def until_the_third(text: str, *, fleeting: bool = False) -> None:
        if text.startswith("Rendering image 3"):
            raise KeyboardInterrupt
        rendered.extend([text] * fleeting)

    def goes_on(text: str, *, fleeting: bool = False) -> None:
        rendered.extend([text] * fleeting)

    with pytest.raises(KeyboardInterrupt):
        harbour_site.install(database, storage, settings, choice, until_the_third)
    assert harbour_site.find_complete(database, choice) is None
    harbour_site.install(database, storage, settings, choice, goes_on)

    assert harbour_site.find_complete(database, choice) is not None
    assert rendered == [f"Rendering image {number} of 3 ..." for number in (1, 2, 3)]
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Image)) == 3
