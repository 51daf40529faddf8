"""How well vessels' ways explain the boxes on all images of a camera, its clock shifted by so much.

Hundreds of offsets are tried on a hundred images with dozens of vessels. Asked one by one that is
half a minute for a person who waits. So each vessel is asked once, for all images and offsets, and
only the few moments at which it is in sight are compared with boxes.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.vessel_path import VesselPath

# How unlike a detection and its vessel's rectangle are, one sigma: shares of the box and image.
_CENTRE_OF_WIDTH = 0.2
_BOTTOM_OF_HEIGHT = 0.03
_LOG_WIDTH = 0.4
_EXPLAINED = 50.0  # a perfect pair is this much likelier than clutter
_PAIR_LIMIT = 9.0  # squared unlikeness up to which a pair is one: three sigma
_AROUND_S = np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class TimedImage:
    """What was detected on an image, whose clock said `clock_s` (seconds from any moment)."""

    clock_s: float
    camera: Camera
    water_level_m: float
    detections: Sequence[Detection]


@dataclass(frozen=True, slots=True)
class Sight:
    """A detection and the vessel it shows, whose middle is at `centre_px` and goes on by px a s."""

    image: int
    vessel: int
    box: Detection
    centre_px: float
    px_per_s: float
    px_per_m: float


@dataclass(frozen=True, eq=False)
class _View:
    """Images of one camera: their numbers, clocks (n,), levels (n,), boxes (n, most, 4).

    An image with fewer boxes than the most has NaN rows.
    """

    camera: Camera
    numbers: Sequence[int]
    clock_s: FloatArray
    level_m: FloatArray
    boxes_px: FloatArray

    def rectangles_px(self, path: VesselPath, offsets_s: FloatArray) -> FloatArray:
        """Return a vessel's rectangles (n, offsets, 4) on each image at each offset."""
        moments_s = (self.clock_s[:, None] + offsets_s).ravel()
        level_m = np.repeat(self.level_m, len(offsets_s))
        rectangles = path.rectangles_px(self.camera, level_m, moments_s)
        return rectangles.reshape(len(self.clock_s), len(offsets_s), 4)

    def unlikeness(self, rectangles: FloatArray, at: npt.ArrayLike) -> FloatArray:
        """Squared unlikeness (rows, most) of rectangles (rows, 4) on images `at` to their boxes."""
        inner = self.camera.intrinsics
        x1, _, x2, y2 = np.moveaxis(self.boxes_px[np.asarray(at, dtype=np.int64)], -1, 0)
        width = x2 - x1
        centre = (rectangles[:, 0] + rectangles[:, 2])[:, None] / 2 - (x1 + x2) / 2
        wider = np.log(np.maximum(rectangles[:, 2] - rectangles[:, 0], 1e-6)[:, None] / width)
        squared: FloatArray = (
            (centre / (_CENTRE_OF_WIDTH * width + 0.005 * inner.width_px)) ** 2
            + ((rectangles[:, 3, None] - y2) / (_BOTTOM_OF_HEIGHT * inner.height_px)) ** 2
            + (wider / _LOG_WIDTH) ** 2
        )
        return np.where(np.isnan(squared), np.inf, squared)


def scores(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], offsets_s: FloatArray
) -> FloatArray:
    """Log likelihood (images, n) of each image's detections at each offset, over clutter alone."""
    total = np.zeros((len(images), len(offsets_s)))
    for view in _views(images):
        most = view.boxes_px.shape[1]
        explained = np.full((len(view.numbers) * len(offsets_s), most), np.inf)
        for path in paths:
            rectangles = view.rectangles_px(path, offsets_s).reshape(-1, 4)
            rows = np.flatnonzero(~np.isnan(rectangles[:, 0]))
            unlike = view.unlikeness(rectangles[rows], rows // len(offsets_s))
            explained[rows] = np.minimum(explained[rows], unlike)
        likelier = np.log1p(_EXPLAINED * np.exp(-explained / 2)).sum(axis=1)
        total[list(view.numbers)] = likelier.reshape(len(view.numbers), len(offsets_s))
    return total


def sights(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], offset_s: float
) -> list[Sight]:
    """Pair detections and vessels of each image at an offset, best first."""
    return [sight for view in _views(images) for sight in _paired(view, images, paths, offset_s)]


def _paired(
    view: _View, images: Sequence[TimedImage], paths: Sequence[VesselPath], offset_s: float
) -> Iterable[Sight]:
    if not paths:
        return
    # Vessels come first, then images, then the three moments.
    rectangles = np.stack([view.rectangles_px(path, offset_s + _AROUND_S) for path in paths])
    centres_px = (rectangles[..., 0] + rectangles[..., 2]) / 2
    scales = [path.px_per_m(view.camera, view.level_m, view.clock_s + offset_s) for path in paths]
    for at, number in enumerate(view.numbers):
        boxes = images[number].detections
        costs = view.unlikeness(rectangles[:, at, 1], [at] * len(paths))[:, : len(boxes)]
        while costs.size and costs.min() < _PAIR_LIMIT:
            vessel, box = (int(index) for index in np.unravel_index(costs.argmin(), costs.shape))
            costs[vessel, :] = costs[:, box] = np.inf
            before_px, then_px, after_px = centres_px[vessel, at].tolist()
            px_per_s, px_per_m = (after_px - before_px) / 2, float(scales[vessel][at])
            yield Sight(number, vessel, boxes[box], then_px, px_per_s, px_per_m)


def _views(images: Sequence[TimedImage]) -> Iterable[_View]:
    """Yield images by their cameras."""
    of_camera: dict[int, list[int]] = defaultdict(list)
    for number, image in enumerate(images):
        of_camera[id(image.camera)].append(number)
    for numbers in of_camera.values():
        own = [images[number] for number in numbers]
        most = max(len(image.detections) for image in own)
        boxes_px = np.full((len(own), most, 4), np.nan)
        for row, image in zip(boxes_px, own, strict=True):
            for place, box in zip(row, image.detections, strict=False):
                place[:] = box.x1_px, box.y1_px, box.x2_px, box.y2_px
        yield _View(
            own[0].camera,
            numbers,
            np.array([image.clock_s for image in own]),
            np.array([image.water_level_m for image in own]),
            boxes_px,
        )
