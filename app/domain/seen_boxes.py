"""The boxes of a while's images as arrays: what each edge is worth as evidence of a hull.

Beside every detection there are boxes around those that may be hulls of one unit: they are
explained like any other, only that no detection can be part of two explanations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from app.domain.arrays import BoolArray, FloatArray, IntArray
from app.domain.borders import cut_edges
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.detection import HALF_PIXEL, Detection
from app.domain.edge_evidence import edge_variance_px2
from app.domain.fusion_settings import FusionSettings
from app.domain.hull_edges import HullEdges
from app.domain.units import parts_of, rows_of_hulls

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
    """Boxes of all images: left, right, lower edges (n, 3), sizes (n, 2), which are cut (n, 3).

    Those of an image stand together: its detections, then boxes around what may be hulls of one
    unit. `members` are the detections in each, by their place in the image; `entangled` tells of
    each image whether any of its boxes may be hulls or parts of another.
    """

    all: Sequence[Detection]
    scene: IntArray
    members: Sequence[tuple[int, ...]]
    edges_px: FloatArray
    size_px: FloatArray
    cut: BoolArray
    is_unit: BoolArray
    entangled: Sequence[bool]
    edge_sigma_px: float

    @classmethod
    def of(cls, scenes: Sequence[Scene], camera: Camera, settings: FusionSettings) -> "SeenBoxes":
        """Take the detections of all images that are good enough, and what units they may make."""
        every: list[Detection] = []
        members: list[tuple[int, ...]] = []
        counts, entangled = [], []
        for scene in scenes:
            before = len(every)
            kept = [
                index
                for index, detection in enumerate(scene.detections)
                if detection.score >= settings.score_threshold
            ]
            good = [scene.detections[index] for index in kept]
            units = list(rows_of_hulls(good))
            every += [*good, *(box for box, _ in units)]
            members += [(index,) for index in kept]
            members += [tuple(kept[hull] for hull in hulls) for _, hulls in units]
            counts.append(len(every) - before)
            entangled.append(bool(units) or bool(parts_of(good).any()))
        cuts = [cut_edges(d, camera.intrinsics, settings.border_tolerance_px) for d in every]
        edges = np.array([(d.x1_px, d.x2_px, d.y2_px) for d in every]).reshape(-1, 3)
        return cls(
            all=every,
            scene=np.repeat(np.arange(len(scenes)), counts),
            members=members,
            edges_px=edges - HALF_PIXEL,
            size_px=np.array([(d.x2_px - d.x1_px, d.y2_px - d.y1_px) for d in every]),
            cut=np.array([(cut.left, cut.right, cut.bottom) for cut in cuts]),
            is_unit=np.array([len(hulls) > 1 for hulls in members], dtype=bool),
            entangled=entangled,
            edge_sigma_px=settings.box_sigma_px,
        )

    def pairs_with(self, scene_of_column: IntArray) -> tuple[IntArray, IntArray]:
        """Return all pairs of a box and a column (rising by scene) of the same image."""
        first = np.searchsorted(scene_of_column, self.scene)
        count = np.searchsorted(scene_of_column, self.scene, side="right") - first
        row = np.repeat(np.arange(len(self.scene)), count)
        within = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        return row, first[row] + within

    def clashes(self, rows: IntArray) -> BoolArray:
        """Return which of some boxes of an image share a detection (n, n)."""
        if not self.is_unit[rows].any():
            return np.zeros((len(rows), len(rows)), dtype=bool)
        hulls = [set(self.members[row]) for row in rows]
        shared = [[bool(a & b) and a is not b for b in hulls] for a in hulls]
        return np.array(shared)

    def parts(self, rows: IntArray) -> BoolArray:
        """Return which of some boxes of an image may be a part of which other, (n, n)."""
        parts = parts_of([self.all[row] for row in rows])
        single = ~self.is_unit[rows]
        return np.asarray(parts & single[:, None] & single[None])

    def variance(self, hulls: HullEdges, row: IntArray, column: IntArray) -> FloatArray:
        """Return the variances (p, 3) of middle, width and lower edge, px^2."""
        one_side = self.cut[row, 0] | self.cut[row, 1]
        variance = edge_variance_px2(
            self.edge_sigma_px, self.size_px[row], hulls.px_per_m[column], one_side
        )
        unsized = ~hulls.has_size[column]
        variance[unsized, 0] += (_UNKNOWN_SIZE_SHARE * self.size_px[row[unsized], 0]) ** 2
        return variance

    def background(self, camera: Camera, row: IntArray, used: BoolArray) -> FloatArray:
        """Return the log density (p,) of the evidence where there is no vessel with AIS."""
        image = camera.intrinsics
        spread = np.column_stack(
            [
                np.full(len(row), log(image.width_px)),
                np.log(np.maximum(self.size_px[row, 0], 1.0) * _SIZES),
                np.full(len(row), log(_WATER_SHARE * image.height_px)),
            ]
        )
        return np.asarray(-(spread * used).sum(axis=1))
