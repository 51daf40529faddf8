"""Writers against files that were looked at once and are kept: a format must not drift unseen."""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.exports.service import WRITERS
from app.exports.writers import coco, ndjson
from app.exports.writers.records import ImageRecord, PoseRecord, Selection
from tests.unit.exports.records import IMAGES, POSES, SELECTION

Writer = Callable[[Sequence[ImageRecord], Iterable[PoseRecord], Selection], Iterator[bytes]]
GOLDEN = Path(__file__).parent / "golden"


def written(write: Writer, images: Sequence[ImageRecord], poses: Sequence[PoseRecord]) -> bytes:
    """Return a writer's whole file."""
    return b"".join(write(images, iter(poses), SELECTION))


@pytest.mark.parametrize("name", list(WRITERS))
def test_a_file_is_byte_for_byte_what_it_was(name: str) -> None:
    """Each format's file equals the one kept; a new format must be kept too."""
    write, _, suffix = WRITERS[name]
    assert written(write, IMAGES, POSES) == (GOLDEN / f"{name}.{suffix}").read_bytes()


def test_coco_refers_only_to_what_is_there() -> None:
    """Ids begin at 1, every annotation has its image and category, boxes are x, y, w, h."""
    data = json.loads(written(coco.write, IMAGES, POSES))
    assert [image["id"] for image in data["images"]] == [1, 2]
    assert [each["id"] for each in data["annotations"]] == [1, 2, 3]
    assert [each["image_id"] for each in data["annotations"]] == [1, 1, 2]
    assert {each["category_id"] for each in data["annotations"]} == {
        category["id"] for category in data["categories"]
    }
    for each, pose in zip(data["annotations"], POSES, strict=True):
        x, y, width, height = each["bbox"]
        assert (x, y, x + width, y + height) == pose.box_px
        assert each["area"] == width * height
        rotation = np.array(each["cam_R_m2c"]).reshape(3, 3)
        np.testing.assert_array_equal(rotation, pose.rotation_cam_from_vessel)
        np.testing.assert_allclose(each["cam_t_m2c"], np.multiply(pose.centroid_in_cam_m, 1000))
    assert data["annotations"][2]["corners_2d"][0] is None


def test_ndjson_is_one_object_a_line_and_ends_with_its_word() -> None:
    """Every line parses alone, also with line separators in a name; the last counts the others."""
    text = written(ndjson.write, IMAGES, POSES).decode()
    assert text.endswith("\n")
    *poses, end = [json.loads(line) for line in text.splitlines()]
    assert [pose["type"] for pose in poses] == ["pose"] * 3
    assert poses[2]["image"]["file_name"] == IMAGES[1].file_name
    assert poses[0]["image"]["captured_at"] == "2022-07-14T10:20:30Z"
    assert (end["type"], end["complete"], end["poses"], end["images"]) == ("end", True, 3, 2)


@pytest.mark.parametrize("name", list(WRITERS))
def test_nothing_selected_is_a_whole_file_too(name: str) -> None:
    """An export without poses parses and says so."""
    write, _, _ = WRITERS[name]
    text = written(write, [], [])
    if name == "coco":
        data = json.loads(text)
        assert (data["images"], data["annotations"]) == ([], [])
    else:
        assert json.loads(text)["poses"] == 0


@pytest.mark.parametrize("name", list(WRITERS))
def test_a_number_json_has_not_stops_the_file(name: str) -> None:
    """NaN would make a file that only some readers open, so there is none."""
    write, _, _ = WRITERS[name]
    with pytest.raises(ValueError, match="not JSON compliant"):
        written(write, IMAGES, [replace(POSES[0], cost=float("nan"))])


@pytest.mark.parametrize("name", list(WRITERS))
def test_poses_are_taken_as_they_are_written(name: str) -> None:
    """A writer holds one pose at a time, so that years of poses fit into little memory."""
    write, _, _ = WRITERS[name]
    taken: list[int] = []

    def poses() -> Iterator[PoseRecord]:
        for pose in POSES:
            taken.append(pose.id)
            yield pose

    chunks = write(IMAGES, poses(), SELECTION)
    marker = str(POSES[0].id).encode()
    first = next(chunk for chunk in chunks if b'"score":0.875' in chunk and marker in chunk)
    assert first
    assert taken == [POSES[0].id]
