"""Writers against files that were looked at once and are kept: a format must not drift unseen."""

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.exports.filters import ExportOptions
from app.exports.formats import FORMATS, file_kind, written
from app.exports.writers.silhouettes import silhouette, silhouettes
from tests.unit.exports.records import NOON, POSES, SOURCE, Records

GOLDEN = Path(__file__).parent / "golden"
PLAIN = ExportOptions()
TEXTS = ("coco", "ndjson", "csv")


def bytes_of(name: str, source: Records = SOURCE, options: ExportOptions = PLAIN) -> bytes:
    """Return an export's whole file."""
    return b"".join(written(name, options, source))


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "parquet"])
def test_a_file_is_byte_for_byte_what_it_was(name: str) -> None:
    """Each format's file equals the one kept; a new format must be kept too."""
    _, suffix = file_kind(name, PLAIN)
    assert bytes_of(name) == (GOLDEN / f"{name}.{suffix}").read_bytes()


@pytest.mark.parametrize("name", list(FORMATS))
def test_the_same_poses_give_the_same_bytes(name: str) -> None:
    """Nothing of the moment of writing is in a file."""
    assert bytes_of(name) == bytes_of(name)


def test_coco_refers_only_to_what_is_there() -> None:
    """Ids begin at 1, every annotation has its image and category, boxes are x, y, w, h."""
    data = json.loads(bytes_of("coco"))
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
    assert [each["silhouette"] for each in data["annotations"]] == ["whole", "whole", "partial"]


def test_ndjson_is_one_object_a_line_and_ends_with_its_word() -> None:
    """Every line parses alone, also with line separators in a name; the last counts the others."""
    text = bytes_of("ndjson", replace(SOURCE, gone_ids=[7, 9])).decode()
    assert text.endswith("\n")
    *lines, end = [json.loads(line) for line in text.splitlines()]
    assert [line["type"] for line in lines] == ["pose"] * 3 + ["gone"] * 2
    assert lines[2]["image"]["file_name"] == NOON.file_name
    assert lines[0]["image"]["captured_at"] == "2022-07-14T10:20:30Z"
    assert [line["id"] for line in lines[3:]] == [7, 9]
    assert (end["type"], end["complete"], end["poses"], end["gone"]) == ("end", True, 3, 2)


@pytest.mark.parametrize("name", list(FORMATS))
def test_nothing_selected_is_a_whole_file_too(name: str) -> None:
    """An export without poses parses and says so."""
    data = bytes_of(name, Records([]))
    if name == "coco":
        assert (json.loads(data)["images"], json.loads(data)["annotations"]) == ([], [])
    if name == "ndjson":
        assert json.loads(data)["poses"] == 0
    assert data


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_number_json_has_not_stops_the_file(name: str) -> None:
    """NaN would make a file that only some readers open, so there is none."""
    with pytest.raises(ValueError, match="not finite"):
        bytes_of(name, Records([replace(POSES[0], height_m=float("nan"))]))


@given(st.lists(st.lists(st.integers(-40, 300), min_size=16, max_size=16), max_size=6))
def test_many_silhouettes_are_each_as_taken_alone(boxes: list[list[int]]) -> None:
    """Boxes of any shape, also with corners in a line, twice the same, outside or behind."""
    poses = [
        replace(
            POSES[0],
            image=replace(NOON, width_px=250, height_px=200),
            corners_in_image_px=[
                [u / 3, v / 7] if u > -39 else None
                for u, v in zip(box[::2], box[1::2], strict=True)
            ],
        )
        for box in boxes
    ]
    of = [(each.corners_in_image_px, each.image, each.box_px) for each in [*POSES, *poses]]
    outlines, kinds = silhouettes(*zip(*of, strict=True))
    assert list(zip(outlines, kinds, strict=True)) == [silhouette(*each) for each in of]


def test_a_split_makes_a_file_or_a_folder_of_each_part() -> None:
    """Parts hold their own poses only; formats of one file need an archive for that."""
    parted = replace(SOURCE, all_poses=[replace(POSES[0], part="train"), POSES[2]])
    parted.parts = ("train", "val", "test")
    options = ExportOptions(archive=True, images=True)
    with zipfile.ZipFile(io.BytesIO(bytes_of("coco", parted, options))) as archive:
        counts = [
            len(json.loads(archive.read(f"{part}.json"))["annotations"]) for part in parted.parts
        ]
        assert counts == [1, 1, 0]
        file_name = json.loads(archive.read("val.json"))["images"][0]["file_name"]
        assert archive.read(file_name).startswith(b"a photograph of")
    with zipfile.ZipFile(io.BytesIO(bytes_of("kitti", parted))) as archive:
        names = archive.namelist()
    assert {"train/label_2/000000.txt", "val/image_2/000000.png"} <= set(names)
