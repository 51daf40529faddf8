"""Pictures turned as EXIF says: one and the same wherever pixels are made."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image, ImageOps

from app.errors import Invalid
from app.imagery import upright
from app.imagery.photo import inspect
from app.imagery.preview import make_preview
from tests.factories.imagery import photograph
from worker.inference.image import decode_image

ORIENTATIONS = range(1, 9)


def quarters(orientation: int, kind: str = "JPEG") -> bytes:
    """Return a picture of four colours, 64 x 48 as stored."""
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:24, :32] = 255, 0, 0
    pixels[:24, 32:] = 0, 255, 0
    pixels[24:, :32] = 0, 0, 255
    exif = Image.Exif()
    exif[0x0112] = orientation
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind, exif=exif, quality=95, subsampling=0)
    return file.getvalue()


@pytest.mark.parametrize("orientation", ORIENTATIONS)
def test_all_that_makes_pixels_agrees(orientation: int) -> None:
    """Detectors, previews and sizes see what Pillow and OpenCV make of the tag."""
    data = quarters(orientation)
    theirs = np.asarray(ImageOps.exif_transpose(Image.open(io.BytesIO(data)))).astype(int)
    stored = np.asarray(Image.open(io.BytesIO(data)))
    opencv = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert opencv is not None
    detected = decode_image(data)
    preview = np.asarray(Image.open(io.BytesIO(make_preview(data, "image/jpeg", 320)))).astype(int)
    header = inspect(data, 1_000_000)

    assert (upright.turned(stored, orientation) == theirs).all()
    np.testing.assert_array_equal(detected, opencv)
    assert detected.flags.c_contiguous
    assert preview.shape == theirs.shape
    assert np.abs(preview - theirs).mean() < 8  # another round of JPEG
    assert (header.height_px, header.width_px) == theirs.shape[:2]


@pytest.mark.parametrize("kind", ["PNG", "WEBP"])
def test_other_formats_are_not_turned(kind: str) -> None:
    """Not all browsers obey the tag there: the picture is refused, with what to do about it."""
    with pytest.raises(Invalid, match="exiftool"):
        inspect(quarters(6, kind), 1_000_000)


@pytest.mark.parametrize("orientation", [0, 9, 255])
def test_values_without_meaning_turn_nothing(orientation: int) -> None:
    """Viewers ignore them too."""
    data = photograph(orientation=orientation)
    assert upright.orientation_of(data) == upright.UPRIGHT
    assert inspect(data, 1_000_000).width_px == 64


def test_what_xmp_says_is_left_aside() -> None:
    """Pillow would believe it, browsers do not."""
    said = b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf tiff:Orientation="6"/></x:xmpmeta>'
    file = io.BytesIO()
    Image.new("RGB", (64, 48)).save(file, "JPEG", xmp=said)
    assert Image.open(io.BytesIO(file.getvalue())).getexif().get(0x0112) == 6
    assert upright.orientation_of(file.getvalue()) == upright.UPRIGHT
