"""Photographs into pixels."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from worker.inference.image import decode_image, decode_photograph


def test_pixels_are_those_that_viewers_show() -> None:
    """An EXIF rotation is applied: keypoints are clicked on the upright picture."""
    picture = Image.new("RGB", (64, 32), (255, 0, 0))
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned by 90 degrees
    file = io.BytesIO()
    picture.save(file, "JPEG", exif=exif)
    image = decode_image(file.getvalue())
    assert image.shape == (64, 32, 3)
    assert image[0, 0].argmax() == 2  # red is last: BGR


@pytest.mark.parametrize("kind", ["PNG", "TIFF", "WEBP"])
def test_other_formats_and_grey_images_become_bgr(kind: str) -> None:
    """Whatever an image is stored as, it arrives as three channels of 8 bits."""
    file = io.BytesIO()
    Image.new("L", (8, 4), 77).save(file, kind, lossless=True)
    image = decode_image(file.getvalue())
    assert image.dtype == np.uint8
    assert (image == np.full((4, 8, 3), 77)).all()


@pytest.mark.parametrize("data", [b"", b"<html></html>", b"\xff\xd8\xff\xe0 no jpeg"])
def test_what_is_no_image_is_an_error(data: bytes) -> None:
    """Bytes that are no image raise instead of giving an empty array."""
    with pytest.raises(ValueError, match="cannot be decoded"):
        decode_image(data)


def test_a_photograph_agrees_with_another_decoder(shared_dir: Path) -> None:
    """A real photograph has the same pixels as Pillow reads, to the rounding of JPEG decoders."""
    path = shared_dir / "real/bonk/image/00139255c1d7dd9c.jpg"
    ours = decode_image(path.read_bytes())
    theirs = np.asarray(Image.open(path).convert("RGB"))[:, :, ::-1]
    assert np.abs(ours.astype(int) - theirs).mean() < 0.5


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_a_smaller_photograph_is_the_same_upright_picture(
    shared_dir: Path, orientation: int
) -> None:
    """Decoded at a quarter, turned by EXIF: the whole one averaged, and told of its size."""
    exif = Image.Exif()
    exif[0x0112] = orientation
    file = io.BytesIO()
    picture = Image.open(shared_dir / "real/bonk/image/00139255c1d7dd9c.jpg")
    picture.crop((0, 0, 640, 480)).save(file, "JPEG", exif=exif, quality=95)
    whole = decode_image(file.getvalue())
    seen = decode_photograph(file.getvalue(), lambda size: 4 if size == whole.shape[1::-1] else 1)
    assert (seen.width_px, seen.height_px) == whole.shape[1::-1]
    height, width = whole.shape[0] // 4, whole.shape[1] // 4
    assert seen.pixels_bgr.shape == (height, width, 3)
    averaged = whole.reshape(height, 4, width, 4, 3).mean(axis=(1, 3))
    assert np.abs(seen.pixels_bgr - averaged).mean() < 2


def test_other_formats_are_decoded_whole() -> None:
    """A PNG has no smaller picture in it."""
    file = io.BytesIO()
    Image.new("RGB", (64, 48), (9, 9, 9)).save(file, "PNG")
    seen = decode_photograph(file.getvalue(), lambda _size: 4)
    assert seen.pixels_bgr.shape == (48, 64, 3)
