"""`quaymark fuse` on files: published labels, labels with gaps, and files that are no labels."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.fuse_files import fuse_files
from app.published_files import PublishedFileError

Write = Callable[[str, object], Path]


@pytest.fixture
def camera_path(shared_dir: Path) -> Path:
    """Camera file of the published label."""
    return shared_dir / "real/bonk/camera.json"


@pytest.fixture
def label(shared_dir: Path) -> dict[str, Any]:
    """Give the published label, free to be changed."""
    path = shared_dir / "real/bonk/label/00139255c1d7dd9c.json"
    loaded: dict[str, Any] = json.loads(path.read_text())
    return loaded


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write values as a JSON file."""

    def to_file(name: str, values: object) -> Path:
        path = tmp_path / name
        path.write_text(json.dumps(values))
        return path

    return to_file


def test_the_published_label_gives_its_published_pose(
    camera_path: Path, label: dict[str, Any], write: Write
) -> None:
    """The command's answer holds the published centroid, rotation and rounded-up height."""
    answer = fuse_files(camera_path, write("label.json", label))
    (pose,) = answer["poses"]  # type: ignore[misc]  # JSON
    published = label["objects"][0]
    np.testing.assert_allclose(
        pose["centroid_in_cam_m"], published["position"]["centroid"], rtol=0, atol=2e-5
    )
    np.testing.assert_allclose(
        pose["rotvec_cam_from_vessel"], np.ravel(published["position"]["eulerAngles"]), atol=1e-9
    )
    assert pose["identifier"] == published["identifier"]
    assert (pose["detection"], pose["vessel"], pose["flags"]) == (0, 0, [])
    assert np.ceil(pose["height_m"]) == published["height"]
    assert len(pose["corners_in_image_px"]) == 8
    assert set(pose["correction_m"]) == {"east", "north", "up"}
    assert pose["position_covariance_in_enu_m2"] is pose["heading_sigma_deg"] is None
    assert answer["unmatched_detections"] == answer["unmatched_vessels"] == []
    json.dumps(answer, allow_nan=False)


def test_preset_waterline_tells_how_sure_it_is(
    camera_path: Path, label: dict[str, Any], write: Write
) -> None:
    """Its poses have a covariance, and sigmas of heading and height."""
    (pose,) = fuse_files(camera_path, write("label.json", label), "waterline")["poses"]  # type: ignore[misc]  # JSON
    assert (np.linalg.eigvalsh(pose["position_covariance_in_enu_m2"]) > 0).all()
    assert pose["heading_sigma_deg"] > 0
    assert pose["height_sigma_m"] > 0


def test_indices_are_those_of_the_label(
    camera_path: Path, label: dict[str, Any], write: Write
) -> None:
    """Objects without a box and vessels without a place are passed over, not renumbered."""
    label["objects"][:0] = [{"identifier": "no box"}, {"bbImage2d": None}]
    label["objects"].append({"bbImage2d": [10, 10, 40, 30]})
    label["vessels"][:0] = [
        {"identifier": "nowhere", "lat": 91, "long": 181, "heading": 10},
        {"identifier": 211000000, "lat": 53.54, "long": 9.98, "heading": None, "size": None},
        {**label["vessels"][0], "identifier": "unsure", "heading": 511},
        {**label["vessels"][0], "identifier": "distant", "lat": 53.0},
    ]
    answer = fuse_files(camera_path, write("label.json", label))
    (pose,) = answer["poses"]  # type: ignore[misc]  # JSON
    assert (pose["detection"], pose["vessel"]) == (2, 4)
    assert answer["unmatched_detections"] == [3]
    assert answer["unmatched_vessels"] == ["nowhere", "211000000", "unsure", "distant"]
    reasons = [entry["reason"] for entry in answer["unmatched_vessel_reasons"]]  # type: ignore[attr-defined]  # JSON
    assert reasons == ["no_position", "no_heading", "no_heading", "out_of_range"]


def test_an_old_report_of_a_label_is_still_used(
    camera_path: Path, label: dict[str, Any], write: Write
) -> None:
    """A published vessel at rest whose report is three minutes old was chosen by its publisher."""
    label["vessels"][0] |= {"speed": 0.0, "secondsSinceLastPositionReport": 180.0}
    assert len(fuse_files(camera_path, write("label.json", label))["poses"]) == 1  # type: ignore[arg-type]  # JSON


def test_missing_motion_is_flagged(camera_path: Path, label: dict[str, Any], write: Write) -> None:
    """Without speed or age the vessel stays where it reported, and the pose says so."""
    label["vessels"][0]["speed"] = 102.3
    del label["vessels"][0]["secondsSinceLastPositionReport"]
    (pose,) = fuse_files(camera_path, write("label.json", label))["poses"]  # type: ignore[misc]  # JSON
    assert pose["flags"] == ["no_speed", "no_report_age"]


def test_distortion_of_the_camera_file_is_used(
    camera_path: Path, label: dict[str, Any], write: Write
) -> None:
    """Four or five coefficients in the camera file change where lines of sight lead."""
    camera = json.loads(camera_path.read_text())
    plain = fuse_files(camera_path, write("label.json", label))["poses"]
    for coefficients in ([-0.21, 0, 0, 0], [-0.21, 0, 0, 0, 0]):
        path = write("camera.json", {**camera, "distortion": coefficients})
        bent = fuse_files(path, write("label.json", label))["poses"]
        gap = np.subtract(bent[0]["centroid_in_cam_m"], plain[0]["centroid_in_cam_m"])  # type: ignore[index]  # JSON
        assert 1e-4 < np.abs(gap).max() < 1


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"objects": [{"bbImage2d": [1, 2, 3]}]}, "objects.0.bbImage2d"),
        ({"objects": [{"bbImage2d": [5, 2, 3, 9]}]}, "objects.0.bbImage2d"),
        ({"objects": None}, "objects"),
        ({"vessels": [{"lat": 1}]}, "vessels.0.identifier"),
        ({"vessels": [{"identifier": "a", "size": {"to_bow": -1}}]}, "vessels.0.size.to_bow"),
        ({"vessels": [{"identifier": "a", "heading": "north"}]}, "vessels.0.heading"),
    ],
)
def test_a_broken_label_is_refused_in_one_line(
    camera_path: Path,
    label: dict[str, Any],
    write: Write,
    change: dict[str, object],
    field: str,
) -> None:
    """The error names the file and the field."""
    path = write("label.json", label | change)
    with pytest.raises(PublishedFileError) as caught:
        fuse_files(camera_path, path)
    message = caught.value.detail  # what the command line prints
    assert message.startswith(f"{path}: {field}: ")
    assert "\n" not in message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"K": [[1, 0, 0], [0, 1, 0]]}, "K"),
        ({"K": [[1, 2, 0], [0, 1, 0], [0, 0, 1]]}, "skew"),
        ({"R_cam_from_ecef": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}, "rotation"),
        ({"distortion": [0.1]}, "distortion"),
        ({"width": 0}, "width"),
    ],
)
def test_a_broken_camera_is_refused_in_one_line(
    camera_path: Path,
    label: dict[str, Any],
    write: Write,
    change: dict[str, object],
    words: str,
) -> None:
    """The error names the camera file and what is wrong with the camera."""
    path = write("camera.json", json.loads(camera_path.read_text()) | change)
    with pytest.raises(PublishedFileError, match=words) as caught:
        fuse_files(path, write("label.json", label))
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("content", [b"", b"{", b"[" * 5000, b"\xff\xfe", b'{"objects": NaN}'])
def test_a_file_that_is_no_json_is_refused(
    camera_path: Path, tmp_path: Path, content: bytes
) -> None:
    """Empty, cut, deeply nested, binary and not-quite-JSON files give the same kind of error."""
    path = tmp_path / "label.json"
    path.write_bytes(content)
    with pytest.raises(PublishedFileError, match=r"label\.json"):
        fuse_files(camera_path, path)


def test_a_missing_file_and_an_unknown_preset_are_refused(
    camera_path: Path, label: dict[str, Any], write: Write, tmp_path: Path
) -> None:
    """What cannot be done is said before anything is computed."""
    with pytest.raises(PublishedFileError, match="No such file"):
        fuse_files(camera_path, tmp_path / "absent.json")
    with pytest.raises(PublishedFileError, match=r"tideline.*paper, waterline"):
        fuse_files(camera_path, write("label.json", label), preset="tideline")
