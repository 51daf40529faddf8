"""`quaymark import bonk` and `quaymark run`: a published data set through the whole house."""

import json
import shlex
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.bonk import pseudo_mmsi
from app.config import Settings
from app.stand_ins import FIRST_STAND_IN, STAND_INS
from tests.integration.commands.conftest import Shell
from tests.worker_process import WorkerProcess

IMAGE = "00139255c1d7dd9c"


@pytest.fixture
def dataset(shared_dir: Path, tmp_path: Path) -> Path:
    """Copy the published sample, to be changed."""
    folder = tmp_path / "bonk"
    for name in ("image", "label", "calib"):
        (folder / name).mkdir(parents=True)
        for file in (shared_dir / "real" / "bonk" / name).iterdir():
            shutil.copyfile(file, folder / name / file.name)
    shutil.copyfile(shared_dir / "real" / "bonk" / "camera.json", folder / "camera.json")
    return folder


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
@pytest.mark.slow
def test_an_imported_data_set_gives_the_published_poses(
    quaymark: Shell, settings: Settings, dataset: Path, tmp_path: Path
) -> None:
    """Import, run and export give each photograph's published centroid within 1e-3 m.

    A second photograph with the same vessel elsewhere must not disturb the first.
    """
    label = json.loads((dataset / "label" / f"{IMAGE}.json").read_text())
    moved = json.loads((dataset / "label" / f"{IMAGE}.json").read_text())
    moved["vessels"][0]["lat"] += 0.0005
    del moved["2d_annotation_gt"]
    (dataset / "label" / "1.json").write_text(json.dumps(moved))
    photograph = (dataset / "image" / f"{IMAGE}.jpg").read_bytes()
    (dataset / "image" / "1.jpg").write_bytes(photograph + b"\0")

    imported = quaymark("import", "bonk", dataset)
    assert imported.code == 0, imported.error
    command = shlex.split(imported.out.splitlines()[-1])[1:]
    with WorkerProcess(settings, tmp_path / "worker.log"):
        run = quaymark(*command)
    assert run.code == 0, run.error
    out = tmp_path / "poses.ndjson"
    quaymark("export", "--format", "ndjson", "--out", out, "--with-identities")

    poses = [json.loads(line) for line in out.read_text().splitlines()][:-1]
    pose = next(pose for pose in poses if pose["image"]["file_name"] == f"{IMAGE}.jpg")
    published = label["objects"][0]["position"]["centroid"]
    assert np.abs(np.array(pose["centroid_in_cam_m"]) - published).max() < 1e-3
    assert pose["vessel"] == str(pseudo_mmsi(label["vessels"][0]["identifier"]))

    written = exported(quaymark, tmp_path / "once")
    assert_same_label(json.loads((written / "label" / f"{IMAGE}.json").read_text()), label)
    assert (written / "image" / f"{IMAGE}.jpg").read_bytes() == photograph
    calibration = (dataset / "calib" / f"{IMAGE}.txt").read_text().split()
    assert (written / "calib" / f"{IMAGE}.txt").read_text().split() == calibration
    again = quaymark("import", "bonk", written, "--name", "Again")
    assert "site 'Again': 1 photographs" in again.out, again.error
    fused = quaymark(
        *("fuse", "--camera", written / "camera.json"),
        *("--label", written / "label" / f"{IMAGE}.json"),
    )
    (found,) = json.loads(fused.out)["poses"]
    assert np.abs(np.array(found["centroid_in_cam_m"]) - published).max() < 1e-3


def exported(quaymark: Shell, folder: Path) -> Path:
    """Export everything as BONK-pose with names and photographs, and unpack it."""
    out = folder.with_suffix(".zip")
    done = quaymark(*("export", "--format", "bonk", "--out", out), "--with-identities", "--images")
    assert done.code == 0, done.error
    with zipfile.ZipFile(out) as archive:
        archive.extractall(folder)  # our own
    return folder


def assert_same_label(written: dict[str, Any], label: dict[str, Any]) -> None:
    """Compare what is published of a photograph, numbers to what a moment can hold."""
    (ours,), (theirs,) = written["objects"], label["objects"]
    for name in ("identifier", "height", "width", "length"):
        assert ours[name] == theirs[name]
    np.testing.assert_allclose(ours["bbImage2d"], theirs["bbImage2d"], atol=1e-9)
    for name, tolerance in (("centroid", 1e-3), ("eulerAngles", 1e-6)):
        np.testing.assert_allclose(ours["position"][name], theirs["position"][name], atol=tolerance)
    assert ours["height"] - 1 < ours["height_exact"] <= ours["height"]
    (vessel,), (published,) = written["vessels"], label["vessels"]
    age = "secondsSinceLastPositionReport"
    assert vessel[age] == pytest.approx(published[age], abs=1e-6)
    assert {**vessel, age: 0} == {**published, age: 0}
    assert written["2d_annotation_gt"] == label["2d_annotation_gt"]


def test_photographs_of_other_cameras_are_left_out(quaymark: Shell, dataset: Path) -> None:
    """A photograph whose K is not that of camera.json is counted, not imported."""
    for folder, ending in (("image", "jpg"), ("label", "json"), ("calib", "txt")):
        shutil.copyfile(dataset / folder / f"{IMAGE}.{ending}", dataset / folder / f"2.{ending}")
    np.savetxt(dataset / "calib" / "2.txt", np.eye(3))
    outcome = quaymark("import", "bonk", dataset, "--name", "Elbe")

    assert outcome.code == 0, outcome.error
    assert "site 'Elbe': 1 photographs; 1 of other cameras left out" in outcome.out


def test_a_broken_data_set_stores_nothing(quaymark: Shell, dataset: Path) -> None:
    """All labels are read before anything is stored, so the mended data set comes in."""
    photograph = dataset / "image" / f"{IMAGE}.jpg"
    photograph.rename(dataset / "elsewhere.jpg")
    broken = quaymark("import", "bonk", dataset)
    (dataset / "elsewhere.jpg").rename(photograph)

    assert broken.code == 1
    assert "its photograph" in broken.error
    assert quaymark("import", "bonk", dataset).code == 0


def test_a_second_import_needs_another_name(quaymark: Shell, dataset: Path) -> None:
    """A site of the same name is not mixed with another import."""
    quaymark("import", "bonk", dataset)
    outcome = quaymark("import", "bonk", dataset)

    assert outcome.code == 1
    assert "there is already a site named 'BONK-pose'" in outcome.error


def test_pseudo_numbers_are_stable_and_nobodys() -> None:
    """A vessel has the same number in every import, with the digits 200 that no country has."""
    assert pseudo_mmsi("16d85289b2ac78f0") == pseudo_mmsi("16d85289b2ac78f0")
    numbers = {pseudo_mmsi(str(each)) for each in range(1000)}
    assert min(numbers) >= FIRST_STAND_IN
    assert max(numbers) < FIRST_STAND_IN + STAND_INS
    assert len(numbers) > 990
