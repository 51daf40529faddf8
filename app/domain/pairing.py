"""From images to sightings: which vessels can be there, and which detection shows each.

Every vessel state ends as a sighting or with the reason why it is none. Matching `paper` looks at
each image by itself; matching `likelihood` at all images of a while, which share their water.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from app.domain.borders import CutEdges, cut_edges, cut_like
from app.domain.camera import Camera
from app.domain.candidates import Candidate, UnmatchedReason, candidates_or_reasons
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings, MatchingMethod, Preset
from app.domain.geodesy import WorldFrame
from app.domain.likelihood import LikelyPair, match_by_likelihood
from app.domain.matching import Pair, match
from app.domain.matching_baselines import GroundPair, match_on_water
from app.domain.matching_tracks import match_tracks
from app.domain.seen_boxes import Scene
from app.domain.sighting import SeenImage, Sighting

_ALONE = frozenset({MatchingMethod.PAPER, MatchingMethod.LU_2021, MatchingMethod.GROUND_PLANE})


@dataclass(frozen=True, eq=False)
class MatchedImage:
    """What matching says of one image: pairs to make boxes of, and why states are in none."""

    pairs: list[Sighting]
    unmatched_states: dict[int, str]


def match_images(
    camera: Camera, frame: WorldFrame, images: Sequence[SeenImage], settings: FusionSettings
) -> list[MatchedImage]:
    """Match each image of a viewport. Raises ValueError naming a detection that is no box."""
    _require_boxes(images)
    placed = [_Placed.of(found) for found in _candidates(camera, frame, images, settings)]
    scenes = [
        Scene(image.detections, there.candidates)
        for image, there in zip(images, placed, strict=True)
    ]
    pairs: list[Sequence[Pair | LikelyPair | GroundPair]] = [[] for _ in images]
    if settings.matching in _ALONE:
        pairs = [_matched_alone(camera, scene, settings) for scene in scenes]
    else:
        for window in windows(images, settings.level_window_s):
            times_s = [images[i].at_s for i in window]
            together = _matched_together(camera, [scenes[i] for i in window], times_s, settings)
            for index, found in zip(window, together, strict=True):
                pairs[index] = found
    return [
        _matched(camera, image, there, found, settings)
        for image, there, found in zip(images, placed, pairs, strict=True)
    ]


def _matched_alone(
    camera: Camera, scene: Scene, settings: FusionSettings
) -> Sequence[Pair | GroundPair]:
    """Match an image by a method that looks at no other."""
    if settings.matching is MatchingMethod.PAPER:
        return match(scene.detections, scene.candidates, camera.intrinsics, settings)
    return match_on_water(scene.detections, scene.candidates, camera, settings)


def _matched_together(
    camera: Camera, scenes: Sequence[Scene], times_s: Sequence[float], settings: FusionSettings
) -> Sequence[Sequence[LikelyPair | GroundPair]]:
    """Match the images of a while by a method that looks at all of them."""
    if settings.matching in {MatchingMethod.HUANG_2021, MatchingMethod.QU_2022}:
        return match_tracks(camera, scenes, times_s, settings)
    return match_by_likelihood(camera, scenes, settings, times_s)


@dataclass(frozen=True, eq=False)
class _Placed:
    """The candidates of one image, and why the other states are none."""

    candidates: list[Candidate]
    refused: dict[int, str]

    @classmethod
    def of(cls, placed: Sequence[Candidate | UnmatchedReason]) -> "_Placed":
        return cls(
            [one for one in placed if isinstance(one, Candidate)],
            {i: one for i, one in enumerate(placed) if not isinstance(one, Candidate)},
        )


def _candidates(
    camera: Camera, frame: WorldFrame, images: Sequence[SeenImage], settings: FusionSettings
) -> list[list[Candidate | UnmatchedReason]]:
    levels_m = [image.water_level_m for image in images]
    return candidates_or_reasons(
        [image.states for image in images], camera, frame, levels_m, settings
    )


def _matched(
    camera: Camera,
    image: SeenImage,
    placed: _Placed,
    found: Sequence[Pair | LikelyPair | GroundPair],
    settings: FusionSettings,
) -> MatchedImage:
    """Turn pairs into sightings, and say of all other candidates why they are in none."""
    candidates = placed.candidates
    # The other methods leave out by themselves what is too unlike.
    limit = settings.maximum_cost if settings.matching is MatchingMethod.PAPER else float("inf")
    sightings: list[Sighting] = []
    reasons = dict.fromkeys(range(len(candidates)), UnmatchedReason.NO_DETECTION_LEFT)
    for pair in found:
        candidate = candidates[pair.candidate]
        if pair.cost.total > limit:
            reasons[pair.candidate] = UnmatchedReason.COST_TOO_HIGH
        elif not candidate.has_size:
            reasons[pair.candidate] = UnmatchedReason.SIZE_UNKNOWN
        else:
            del reasons[pair.candidate]
            detection = (
                pair.box if isinstance(pair, LikelyPair) else image.detections[pair.detection]
            )
            cut = _cut(detection, candidate, camera, settings)
            sightings.append(
                Sighting(candidate, pair.detection, detection, cut, pair.cost, image.water_level_m)
            )
    unmatched = placed.refused | {candidates[i].state_index: why for i, why in reasons.items()}
    return MatchedImage(sightings, unmatched)


def _cut(
    detection: Detection, candidate: Candidate, camera: Camera, settings: FusionSettings
) -> CutEdges:
    """Say which edges of a box are the image's border; as published, or told by AIS as well."""
    cut = cut_edges(detection, camera.intrinsics, settings.border_tolerance_px)
    if settings.preset is Preset.PAPER:
        return cut
    expected_px = candidate.rectangle_px.tolist()
    return cut_like(cut, detection, expected_px, camera.intrinsics, settings.box_sigma_px)


def windows(images: Sequence[SeenImage], window_s: float) -> list[list[int]]:
    """Split images, by index, into windows of time during which the water stands still."""
    windows: list[list[int]] = []
    for index in sorted(range(len(images)), key=lambda index: images[index].at_s):
        if windows and images[index].at_s - images[windows[-1][0]].at_s <= window_s:
            windows[-1].append(index)
        else:
            windows.append([index])
    return windows


def _require_boxes(images: Sequence[SeenImage]) -> None:
    """Raise ValueError for the first detection that is no box."""
    boxes = np.array([(*d.edges_px, d.score) for image in images for d in image.detections])
    x1, y1, x2, y2, _ = boxes.reshape(-1, 5).T
    if np.isfinite(boxes).all() and (x1 < x2).all() and (y1 < y2).all():
        return
    for image in images:
        for index, detection in enumerate(image.detections):
            _require_box(index, detection)


def _require_box(index: int, detection: Detection) -> None:
    numbers = (detection.x1_px, detection.y1_px, detection.x2_px, detection.y2_px, detection.score)
    if not all(isfinite(number) for number in numbers):
        raise ValueError(f"detection {index}: coordinates and score must be finite numbers")
    if detection.x1_px >= detection.x2_px or detection.y1_px >= detection.y2_px:
        raise ValueError(f"detection {index}: needs x1 < x2 and y1 < y2, the box is empty")
