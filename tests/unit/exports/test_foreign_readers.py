"""Files read by others' readers, and conventions computed by hand from the formats' descriptions.

The truth is always the same: the eight corners as the domain projected them.
"""

import contextlib
import csv
import io
import json
import struct
import zipfile
from collections.abc import Sequence
from math import atan2, cos, sin
from pathlib import Path

import geopandas
import numpy as np
import pyarrow.parquet as pq
import pytest
from pycocotools import mask
from pycocotools.coco import COCO

from app.exports.filters import ExportOptions
from app.exports.formats import written
from tests.unit.exports.records import POSES, SIGNS, SOURCE, VIEW, Records, pose

PLAIN = ExportOptions()


def bytes_of(name: str, source: Records = SOURCE) -> bytes:
    """Return an export's whole file."""
    return b"".join(written(name, PLAIN, source))


def archive_of(name: str, source: Records = SOURCE) -> zipfile.ZipFile:
    """Return an export's archive, every checksum in it proved."""
    archive = zipfile.ZipFile(io.BytesIO(bytes_of(name, source)))
    assert archive.testzip() is None
    return archive


def projected(K: Sequence[Sequence[float]], in_cam: np.ndarray) -> np.ndarray:
    """Return pixels of points in a camera frame."""
    in_image = in_cam @ np.array(K).T
    return np.asarray(in_image[:, :2] / in_image[:, 2:])


def test_pycocotools_reads_detections_and_silhouettes(tmp_path: Path) -> None:
    """Every annotation is found by its photograph, and its mask is as large as its polygon."""
    path = tmp_path / "poses.json"
    path.write_bytes(bytes_of("coco"))
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(str(path))
    assert coco.getAnnIds(imgIds=[1]) == [1, 2]
    for annotation in coco.loadAnns(coco.getAnnIds()):
        outline = np.array(annotation["segmentation"][0]).reshape(-1, 2)
        u, v = outline.T
        area = abs(u @ np.roll(v, 1) - v @ np.roll(u, 1)) / 2
        assert coco.annToMask(annotation).sum() == pytest.approx(area, rel=0.05)
        corners = [corner for corner in annotation["corners_2d"] if corner is not None]
        assert {tuple(point) for point in outline} <= {tuple(corner) for corner in corners}


def test_coco_silhouettes_end_where_the_photograph_ends() -> None:
    """A box that reaches over the border has a polygon within it, which pycocotools can fill."""
    moved = [
        [u - 1350.0, v] for u, v in (corner or (0, 0) for corner in POSES[0].corners_in_image_px)
    ]
    cut = pose(1, POSES[0].image, "v", None, corners_in_image_px=moved)
    gone = pose(2, POSES[0].image, "v", None, corners_in_image_px=[None] * 8)
    data = json.loads(bytes_of("coco", Records([cut, gone])))
    outlines = [np.array(each["segmentation"][0]) for each in data["annotations"]]
    assert outlines[0].reshape(-1, 2)[:, 0].min() == pytest.approx(0, abs=1e-9)
    assert all(mask.area(mask.frPyObjects([o.tolist()], 1920, 2560))[0] > 100 for o in outlines)
    assert [each["silhouette"] for each in data["annotations"]] == ["whole", "box"]


def test_bop_numbers_give_the_corners_back() -> None:
    """Mesh, obj_id, cam_R_m2c and cam_t_m2c (mm) with cam_K project to the published corners."""
    with archive_of("bop") as archive:
        scene = "all/000002/"
        camera = json.loads(archive.read(scene + "scene_camera.json"))
        truth = json.loads(archive.read(scene + "scene_gt.json"))
        info = json.loads(archive.read(scene + "scene_gt_info.json"))
        models = json.loads(archive.read("models/models_info.json"))
        assert archive.read(scene + "rgb/000001.png").startswith(b"a photograph")
        meshes = {number: ply_vertices(archive, int(number)) for number in models}
    assert list(truth) == list(camera) == list(info) == ["0", "1"]
    assert sorted(model["size_x"] for model in models.values()) == [29000.0, 31000.0]
    told = [entry for entries in truth.values() for entry in entries]
    boxes = [entry for entries in info.values() for entry in entries]
    for entry, box, record in zip(told, boxes, POSES, strict=True):
        R = np.array(entry["cam_R_m2c"]).reshape(3, 3)
        in_cam_mm = meshes[str(entry["obj_id"])] @ R.T + entry["cam_t_m2c"]
        found = projected(np.array(camera["0"]["cam_K"]).reshape(3, 3).tolist(), in_cam_mm)
        if record.length_m == 29.0:
            np.testing.assert_allclose(found, record.corners_in_image_px, atol=1e-3)
            x, y, w, h = box["bbox_obj"]
            np.testing.assert_allclose([x, y], found.min(axis=0), atol=1e-3)
            np.testing.assert_allclose([x + w, y + h], found.max(axis=0), atol=1e-3)
            assert box["visib_fract"] == 1.0
    in_world = np.array(VIEW.center_ecef_m) * 1000
    R = np.array(camera["0"]["cam_R_w2c"]).reshape(3, 3)
    np.testing.assert_allclose(R @ in_world + camera["0"]["cam_t_w2c"], 0, atol=1e-3)
    assert camera["0"]["depth_scale"] == 1.0


def ply_vertices(archive: zipfile.ZipFile, number: int) -> np.ndarray:
    """Return a mesh's vertices; its triangles must point outwards."""
    header, _, data = archive.read(f"models/obj_{number:06}.ply").partition(b"end_header\n")
    assert b"format binary_little_endian 1.0" in header
    vertices = np.frombuffer(data[:96], "<f4").reshape(8, 3).astype(float)
    faces = [struct.unpack_from("<Biii", data, 96 + 13 * face)[1:] for face in range(12)]
    for a, b, c in faces:
        normal = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
        assert normal @ vertices[a] > 0
    assert len(data) == 96 + 13 * 12
    return vertices


def test_kitti_lines_and_sidecar_give_the_corners_back() -> None:
    """15 columns; location is the bottom face's middle; the sidecar has the full rotation.

    The angle alone, as KITTI's devkit turns its boxes, is off as soon as the camera is pitched.
    """
    with archive_of("kitti") as archive:
        lines = archive.read("all/label_2/000000.txt").decode().splitlines()
        sidecar = json.loads(archive.read("all/pose/000000.json"))
        rows = dict(
            line.split(": ", 1)
            for line in archive.read("all/calib/000000.txt").decode().splitlines()
        )
        assert archive.read("ImageSets/all.txt") == b"000000\n000001\n"
    P2 = np.array(rows["P2"].split(), float).reshape(3, 4)
    np.testing.assert_array_equal(P2[:, :3], VIEW.K)
    assert set(rows) == {"P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"}
    for line, beside, record in zip(lines, sidecar["objects"], POSES[:2], strict=True):
        kind, *columns = line.split()
        assert (kind, len(columns)) == ("Vessel", 14)
        truncated, occluded, alpha, x1, y1, x2, y2, h, w, length, x, y, z, ry = map(float, columns)
        assert (truncated, occluded) == (0.0, 3.0)
        np.testing.assert_allclose([x1, y1, x2, y2], record.box_px, atol=1e-4)
        R = np.array(beside["R_cam_from_vessel"])
        corners = (SIGNS * [length / 2, w / 2, h / 2] + [0, 0, h / 2]) @ R.T + [x, y, z]
        np.testing.assert_allclose(
            projected(VIEW.K, corners), record.corners_in_image_px, atol=1e-4
        )
        forward = R[:, 0]
        assert ry == pytest.approx(-atan2(forward[2], forward[0]), abs=1e-8)
        off = (alpha - (ry - atan2(x, z)) + np.pi) % (2 * np.pi) - np.pi
        assert off == pytest.approx(0, abs=1e-8)
        turned = [[cos(ry), 0, sin(ry)], [0, 1, 0], [-sin(ry), 0, cos(ry)]]
        assert abs((np.array(turned) @ [1, 0, 0]) @ forward) > 0.99


def test_geopandas_reads_places_and_their_reference_system(tmp_path: Path) -> None:
    """GeoPandas finds a point of longitude and latitude for each pose, and the manifest."""
    path = tmp_path / "poses.parquet"
    path.write_bytes(bytes_of("parquet"))
    frame = geopandas.read_parquet(path)
    assert frame.crs.equals("OGC:CRS84")
    assert (frame.geometry.x[0], frame.geometry.y[0]) == (POSES[0].lon_deg, POSES[0].lat_deg)
    assert list(frame["pose_id"]) == [101, 102, 230]
    assert frame["grade"].tolist()[:2] == ["good", "bad"]
    assert frame["corner1_u_px"].isna().tolist() == [False, False, True]
    metadata = pq.read_schema(path).metadata
    assert json.loads(metadata[b"geo"])["version"] == "1.1.0"
    assert json.loads(metadata[b"quaymark"])["code_version"] == "1.2.3"


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r"])
def test_a_spreadsheet_takes_no_text_for_a_formula(start: str) -> None:
    """Text gets a leading quote, also within commas and quotes; negative numbers stay numbers."""
    image = POSES[0].image
    named = type(image)(image.id, f'{start}1+"2",\n3.jpg', "ab" * 32, 64, 48, image.captured_at)
    data = bytes_of("csv", Records([pose(1, named, f"{start}cmd", None, lon_deg=-9.5)]))
    (row,) = csv.DictReader(io.StringIO(data.decode(), newline=""))
    assert row["file_name"] == f"'{named.file_name}"
    assert row["vessel"] == f"'{start}cmd"
    assert (row["lon_deg"], row["split"], row["y_cam_m"]) == ("-9.5", "", "-3.25")


def test_an_archive_is_read_by_an_unzip_of_another_kind() -> None:
    """Members of known and of unknown size are what was written; papers go with them."""
    with archive_of("kitti") as archive:
        photograph = archive.getinfo("all/image_2/000000.jpg")
        label = archive.getinfo("all/label_2/000000.txt")
        assert (photograph.compress_type, photograph.date_time) == (0, (2000, 1, 1, 0, 0, 0))
        assert photograph.file_size == len(b"a photograph of ") + 64
        assert label.file_size > 0
        readme = archive.read("README.md").decode()
        manifest = json.loads(archive.read("manifest.json"))
    assert "375" not in readme
    assert "12.22" in readme
    assert "elbe\\|\\*.csv" in readme
    assert manifest["counts"]["poses"] == 3
