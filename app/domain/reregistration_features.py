"""What an image has to be recognised by: corners and blobs with descriptors that survive weather.

Fog and backlight flatten contrast, so the picture is first equalised tile by tile (CLAHE). SIFT
finds blobs, at half size, where a photograph is sharp and noise is gone. Descriptors are compared
by their square roots (RootSIFT: Arandjelovic and Zisserman, 2012), and they are upright: a camera
that moved a little did not roll much, and knowing what is up tells window from window.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array, FloatArray, UInt8Array

# OpenCV is imported where it is used: the web process has no need of it.

SCALE = 0.5
CLAHE_CLIP = 2.0
CLAHE_TILES = (8, 8)
MOST_FEATURES = 10_000
CONTRAST_THRESHOLD = 0.01
NEAREST_RATIO = 0.85
LIKE_ENOUGH = 0.6  # distance of unit vectors
NEIGHBOUR_RATIO = 0.9
LARGEST_GROWTH = 0.5  # of the logarithm of the diameters' ratio
_BLOCK = 2048

IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Features:
    """Where an image has structure: full-size pixels (n, 2), RootSIFT (n, 128), diameters (n,) px.

    Strongest first.
    """

    pixels_px: FloatArray
    descriptors: Float32Array
    diameters_px: FloatArray

    def __len__(self) -> int:
        return len(self.pixels_px)

    def keep(self, wanted: npt.NDArray[np.bool_] | slice) -> "Features":
        """Return those chosen by a mask (n,) or a slice."""
        return Features(self.pixels_px[wanted], self.descriptors[wanted], self.diameters_px[wanted])

    def moved_to(self, pixels_px: FloatArray) -> "Features":
        """Return the same features at other pixels (n, 2)."""
        return replace(self, pixels_px=pixels_px)


def extract_features(image: UInt8Array) -> Features:
    """Find the features of an image (height, width, 3), BGR; none in one that is too small."""
    import cv2  # noqa: PLC0415 - see above

    if min(image.shape[:2]) < 64:
        return _none()
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    half = cv2.resize(grey, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA)
    even = cv2.createCLAHE(CLAHE_CLIP, CLAHE_TILES).apply(half)
    # The library keeps the strongest where it is given a number.
    sift = cv2.SIFT.create(nfeatures=MOST_FEATURES, contrastThreshold=CONTRAST_THRESHOLD)
    # A blob with two directions comes twice; upright it is one.
    single = {(point.pt, point.size): point for point in sift.detect(even, None)}
    upright = sorted(single.values(), key=lambda point: -point.response)
    for point in upright:
        point.angle = 0.0
    points, descriptors = sift.compute(even, upright)
    if descriptors is None or not len(points):
        return _none()
    shares = descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-9)
    half_px = np.array([point.pt for point in points], dtype=np.float64)
    diameters = np.array([point.size for point in points], dtype=np.float64)
    return Features(
        (half_px + 0.5) / SCALE - 0.5,  # (0, 0) is the centre of the first pixel at either size
        np.sqrt(shares).astype(np.float32),
        diameters / SCALE,
    )


def match_features(first: Features, second: Features) -> tuple[IntArray, IntArray, FloatArray]:
    """Pair features that are each other's nearest, clearly nearer than the next in the second.

    Returns indices into the first and the second (m,), and by how much they are nearer: the ratio
    of the distances (m,), 0 for beyond doubt.
    """
    if len(first) == 0 or len(second) < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0)
    nearest, best, next_best = (np.empty(len(first), kind) for kind in (np.intp, "f4", "f4"))
    best_back: Float32Array = np.full(len(second), -np.inf, dtype=np.float32)
    for start in range(0, len(first), _BLOCK):
        part = slice(start, start + _BLOCK)
        # Unit vectors: the larger the product, the smaller the distance.
        likeness = first.descriptors[part] @ second.descriptors.T
        np.maximum(best_back, likeness.max(axis=0), out=best_back)
        rows = np.arange(len(likeness))
        nearest[part] = likeness.argmax(axis=1)
        best[part] = likeness[rows, nearest[part]]
        likeness[rows, nearest[part]] = -1.0
        next_best[part] = likeness.max(axis=1)
    distances = np.sqrt(np.maximum(2 - 2 * np.column_stack([best, next_best]), 1e-12))
    ratio = (distances[:, 0] / distances[:, 1]).astype(np.float64)
    chosen = np.flatnonzero((best >= best_back[nearest]) & (ratio < NEAREST_RATIO))
    return chosen, nearest[chosen], ratio[chosen]


def near_pairs(
    features: Features, expected: Features, radius_px: float
) -> tuple[IntArray, IntArray]:
    """Pair expected features with those found within a radius of where they are expected.

    With the place known within a few pixels, a feature need not be unlike all others of the image,
    only like enough, of the same size, and unlike its neighbours. Returns indices (m,) into both.
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - the web process does without SciPy

    there = np.flatnonzero(np.isfinite(expected.pixels_px).all(axis=1))
    if len(there) == 0 or len(features) == 0:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    around = cKDTree(features.pixels_px).query_ball_point(expected.pixels_px[there], radius_px)
    pairs = []
    for index, found in zip(there, around, strict=True):
        near = np.array(found, dtype=np.intp)
        growth = features.diameters_px[near] / expected.diameters_px[index]
        near = near[np.abs(np.log(growth)) < LARGEST_GROWTH]
        if len(near) == 0:
            continue
        likeness = features.descriptors[near] @ expected.descriptors[index]
        distances = np.sqrt(np.maximum(2 - 2 * likeness, 1e-12))
        first, *rest = np.argsort(distances)
        if distances[first] < LIKE_ENOUGH and (
            not rest or distances[first] < NEIGHBOUR_RATIO * distances[rest[0]]
        ):
            pairs.append((near[first], index))
    both = np.array(pairs, dtype=np.intp).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _none() -> Features:
    return Features(np.empty((0, 2)), np.empty((0, 128), np.float32), np.empty(0))
