"""Images into a detector's input and boxes back."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.letterbox import PADDING_GREY, Letterbox

sizes = st.integers(8, 4000)
inputs = st.sampled_from([(416, 416), (640, 640), (1280, 640)])


@given(sizes, sizes, inputs, st.lists(st.floats(0, 1), min_size=4, max_size=4))
def test_boxes_come_back(
    width: int, height: int, input_size: tuple[int, int], shares: list[float]
) -> None:
    """A box scaled into the input returns to itself in full-image pixels."""
    letterbox = Letterbox(width, height, *input_size)
    box = np.array([shares]) * [width, height, width, height]
    assert letterbox.to_image_px(box * letterbox.ratio) == pytest.approx(box, abs=1e-9)


@given(sizes, sizes, inputs)
def test_the_image_fits_and_touches(width: int, height: int, input_size: tuple[int, int]) -> None:
    """The scaled image lies within the input and fills it in one direction."""
    ratio = Letterbox(width, height, *input_size).ratio
    scaled = (width * ratio, height * ratio)
    assert scaled[0] <= input_size[0] + 1e-9
    assert scaled[1] <= input_size[1] + 1e-9
    assert scaled[0] == pytest.approx(input_size[0]) or scaled[1] == pytest.approx(input_size[1])


def test_boxes_are_clipped_to_the_image() -> None:
    """What a network sees beyond the photograph does not exist."""
    letterbox = Letterbox(2560, 1920, 416, 416)
    boxes = letterbox.to_image_px(np.array([[-10.0, -10.0, 500.0, 500.0]]))
    assert boxes.tolist() == [[0.0, 0.0, 2560.0, 1920.0]]


def test_the_tensor_is_what_yolox_was_trained_on() -> None:
    """Channels first, blue first, 0 to 255, linear interpolation, top-left, grey 114 elsewhere."""
    image = np.random.default_rng(1).integers(0, 256, (192, 256, 3), dtype=np.uint8)
    tensor = Letterbox(256, 192, 416, 416).tensor(image)
    assert tensor.shape == (1, 3, 416, 416)
    assert tensor.dtype == np.float32
    expected = cv2.resize(image, (416, 312), interpolation=cv2.INTER_LINEAR)
    assert (tensor[0, :, :312].transpose(1, 2, 0) == expected).all()
    assert (tensor[0, :, 312:] == PADDING_GREY).all()


def test_an_extreme_panorama_keeps_one_row() -> None:
    """An image so wide that it would scale to nothing still has a row of pixels."""
    tensor = Letterbox(4000, 2, 416, 416).tensor(np.zeros((2, 4000, 3), np.uint8))
    assert (tensor[0, :, 0] == 0).all()
    assert (tensor[0, :, 1:] == PADDING_GREY).all()
