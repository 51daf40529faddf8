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

    Detections come first, then boxes around those that may be hulls of one unit; `members` are the
    detections in each (their place in the image), `clashes` (n, n) tells which boxes cannot show
    two vessels, as they share a detection, and `part_of` (n, n) which may be a part of which.
    """

    all: Sequence[Detection]
    scene: IntArray
    members: Sequence[tuple[int, ...]]
    edges_px: FloatArray
    size_px: FloatArray
    cut: BoolArray
    is_unit: BoolArray
    clashes: BoolArray
    part_of: BoolArray
    edge_sigma_px: float

    @classmethod
    def of(cls, scenes: Sequence[Scene], camera: Camera, settings: FusionSettings) -> "SeenBoxes":
        """Take the detections of all images that are good enough, and what units they may make."""
        found = [
            (number, index, detection)
            for number, scene in enumerate(scenes)
            for index, detection in enumerate(scene.detections)
            if detection.score >= settings.score_threshold
        ]
        single = [detection for _, _, detection in found]
        scene = np.array([number for number, _, _ in found], dtype=np.intp)
        units = list(rows_of_hulls(single, scene))
        every = [*single, *(box for box, _ in units)]
        inside = [(row,) for row in range(len(single))] + [rows for _, rows in units]
        membership = np.zeros((len(every), len(single)))
        for row, rows in enumerate(inside):
            membership[row, list(rows)] = 1
        part_of = np.zeros((len(every), len(every)), dtype=bool)
        part_of[: len(single), : len(single)] = parts_of(single, scene)
        cuts = [cut_edges(d, camera.intrinsics, settings.border_tolerance_px) for d in every]
        edges = np.array([(d.x1_px, d.x2_px, d.y2_px) for d in every]).reshape(-1, 3)
        return cls(
            all=every,
            scene=scene[[rows[0] for rows in inside]],
            members=[tuple(found[row][1] for row in rows) for rows in inside],
            edges_px=edges - HALF_PIXEL,
            size_px=np.array([(d.x2_px - d.x1_px, d.y2_px - d.y1_px) for d in every]),
            cut=np.array([(cut.left, cut.right, cut.bottom) for cut in cuts]),
            is_unit=np.arange(len(every)) >= len(single),
            clashes=membership @ membership.T > 0,
            part_of=part_of,
            edge_sigma_px=settings.box_sigma_px,
        )

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
