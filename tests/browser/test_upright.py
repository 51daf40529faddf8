"""Photographs that EXIF says to turn: a browser shows the pixels that detectors see."""

import base64
import io

import numpy as np
from PIL import Image
from playwright.sync_api import Browser

from worker.inference.image import decode_image

DRAW = """async (addresses) => Promise.all(addresses.map(async (address) => {
  const image = new Image();
  image.src = address;
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  const context = canvas.getContext("2d");
  context.drawImage(image, 0, 0);
  const { height, width } = canvas;
  return [height, width, ...context.getImageData(0, 0, width, height).data];
}))"""


def lopsided(orientation: int) -> bytes:
    """Return a picture without symmetry, 16 x 8 as stored."""
    pixels = np.zeros((8, 16, 3), np.uint8)
    pixels[:, :8, 0] = 250
    pixels[:4, :, 1] = 250
    exif = Image.Exif()
    exif[0x0112] = orientation
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", exif=exif, quality=100, subsampling=0)
    return file.getvalue()


def test_a_browser_turns_photographs_as_the_detector_does(browser: Browser) -> None:
    """All eight orientations: the same size, and the same colour at each pixel."""
    stored = [lopsided(orientation) for orientation in range(1, 9)]
    addresses = [f"data:image/jpeg;base64,{base64.b64encode(data).decode()}" for data in stored]
    page = browser.new_page()
    drawn = page.evaluate(DRAW, addresses)
    page.close()
    for data, (height, width, *values) in zip(stored, drawn, strict=True):
        seen = np.array(values, np.uint8).reshape(height, width, 4)[:, :, :3]
        ours = decode_image(data)[:, :, ::-1]
        assert seen.shape == ours.shape
        assert np.abs(seen.astype(int) - ours).max() < 8
