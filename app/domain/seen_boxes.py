"""The boxes of a while's images as arrays: what each edge is worth as evidence of a hull.

Beside every detection there are boxes around those that may be hulls of one unit: they are
explained like any other, only that no detection can be part of two explanations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import log

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.borders import cut_sides
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.detection import HALF_PIXEL, Detection
from app.domain.edge_evidence import edge_variance_px2
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import HullEdges
from app.domain.units import edges_of, parts_of, rows_of_hulls, side_by_side

_UNKNOWN_SIZE_SHARE = 0.25  # where AIS gives no size, the middle may be anywhere near the middle
# A detection that is no vessel with AIS: anywhere on the water, of a size of 5 to 200 m.
_WATER_SHARE = 0.5  # of the image's height
_SIZES = log(40.0)


@dataclass(frozen=True, eq=False)
class Scene:
    """What is to be matched in one image: detections that take part, and the candidates."""

    detections: Sequence[Detection]
    candidates: Sequence[Candidate]


@dataclass(frozen=True, eq=False)
class SeenBoxes:
    """Boxes of all images: left, right, lower edges (3, n), sizes (2, n), which are cut (3, n).

    Those of an image stand together from its row in `first` on: its detections, then boxes around
    what may be hulls of one unit. `members` are the detections in each, by their place in the
    image. `parts` tells of each image, unless none of its boxes may be hulls or parts of another,
    which detection (rows) may be a part of which other (columns).
    """

    all: Sequence[Detection]
    scene: IntArray
    first: IntArray
    members: Sequence[tuple[int, ...]]
    edges_px: FloatArray
    size_px: FloatArray
    cut: BoolArray
    is_unit: BoolArray
    parts: Sequence[BoolArray | None]
    edge_sigma_px: float

    @classmethod
    def of(cls, scenes: Sequence[Scene], camera: Camera, settings: FusionSettings) -> "SeenBoxes":
        """Take the detections of all images that are good enough, and what units they may make."""
        every: list[Detection] = []
        members: list[tuple[int, ...]] = []
        counts: list[int] = []
        parts: list[BoolArray | None] = []
        kept = [
            [i for i, one in enumerate(scene.detections) if one.score >= settings.score_threshold]
            for scene in scenes
        ]
        good = [
            [scene.detections[i] for i in of_scene]
            for scene, of_scene in zip(scenes, kept, strict=True)
        ]
        edges = edges_of([box for boxes in good for box in boxes])
        padded = _padded(edges, [len(boxes) for boxes in good])
        after, part = side_by_side(padded), parts_of(padded)
        has_units = [bool(here.any()) for here in after]
        has_parts = [bool(here.any()) for here in part]
        for number, boxes in enumerate(good):
            units = list(rows_of_hulls(boxes, after[number])) if has_units[number] else []
            every += boxes
            every += [box for box, _ in units]
            here: list[tuple[int, ...]] = [(index,) for index in kept[number]]
            here += [tuple(kept[number][hull] for hull in hulls) for _, hulls in units]
            members += here
            counts.append(len(here))
            parts.append(part[number] if has_units[number] or has_parts[number] else None)
        x1, y1, x2, y2 = (edges_of(every) if any(has_units) else edges).T
        cut = cut_sides((x1, y1, x2, y2), camera.intrinsics, settings.border_tolerance_px)
        return cls(
            all=every,
            scene=np.repeat(np.arange(len(scenes)), counts),
            first=np.array(list(accumulate(counts, initial=0)), dtype=np.intp),
            members=members,
            edges_px=np.array([x1, x2, y2]) - HALF_PIXEL,
            size_px=np.array([x2 - x1, y2 - y1]),
            cut=cut.take([0, 2, 3], axis=0),
            is_unit=np.array([len(hulls) > 1 for hulls in members], dtype=bool),
            parts=parts,
            edge_sigma_px=settings.box_sigma_px,
        )

    def pairs_with(self, scene_of_column: IntArray) -> tuple[IntArray, IntArray]:
        """Return all pairs of a box and a column (rising by scene) of the same image."""
        first = np.searchsorted(scene_of_column, self.scene)
        count = np.searchsorted(scene_of_column, self.scene, side="right") - first
        row = np.repeat(np.arange(len(self.scene)), count)
        within = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        return row, first[row] + within

    def excluding(self, scene: int, rows: IntArray) -> tuple[BoolArray, BoolArray] | None:
        """Return which of some boxes of an image cannot both show vessels; None where all can.

        First which share a detection (n, n), then which may be a part of which.
        """
        part = self.parts[scene]
        if part is None:
            return None
        if not self.is_unit[rows].any():
            place = rows - self.first[scene]
            within: BoolArray = part[place[:, None], place]
            return (np.zeros_like(within), within) if within.any() else None
        hulls = [set(self.members[row]) for row in rows]
        shared = np.array([[not (a is b or a.isdisjoint(b)) for b in hulls] for a in hulls])
        single = ~self.is_unit[rows]
        place = np.where(single, rows - self.first[scene], 0)
        return shared, part[place[:, None], place] & single[:, None] & single

    def variance(self, hulls: HullEdges, row: IntArray, column: IntArray) -> FloatArray:
        """Return the variances (3, p) of middle, width and lower edge, px^2."""
        one_side = self.cut[0, row] | self.cut[1, row]
        size_px = self.size_px.take(row, axis=1)
        variance = edge_variance_px2(self.edge_sigma_px, size_px, hulls.px_per_m[column], one_side)
        unsized = ~hulls.has_size[column]
        variance[0, unsized] += (_UNKNOWN_SIZE_SHARE * size_px[0, unsized]) ** 2
        return variance

    def background(self, camera: Camera, row: IntArray, used: BoolArray) -> FloatArray:
        """Return the log density (p,) of the evidence where there is no vessel with AIS."""
        image = camera.intrinsics
        size = np.log(np.maximum(self.size_px[0], 1.0) * _SIZES)[row]
        place, water = log(image.width_px), log(_WATER_SHARE * image.height_px)
        return np.asarray(-(used[0] * place + used[1] * size + used[2] * water))


def _padded(edges_px: FloatArray, counts: Sequence[int]) -> FloatArray:
    """Return edges (m, 4) by images, (images, n, 4), NaN where an image has fewer boxes than n."""
    padded: FloatArray = np.full((len(counts), max(counts, default=0), 4), np.nan)
    padded[np.arange(padded.shape[1]) < np.array(counts)[:, None]] = edges_px
    return padded
