"""How related systems give AIS to tracks of a camera rather than to single boxes.

Huang et al. (2021, Journal of Navigation 74, "Identity recognition on waterways") follow ships with
DeepSORT, map them to the water by a homography and give each track the AIS, dead-reckoned to the
image's time, that is nearest to it in metres. Qu et al. (2022, IEEE ITSC, "Intelligent maritime
surveillance framework") sort out AIS that is incomplete, out of range or on another course, and
compare when a vessel is at the place where the camera has it. Their detectors and learnt appearance
are left out: all methods here get the same boxes, the same camera and our tracker. A track's cost
is the mean over its boxes; limits are ours, chosen for the fewest errors on simulated traffic.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.image_series import split_series
from app.domain.image_tracks import Sample, image_tracks
from app.domain.matching_baselines import GroundPair, OnWater
from app.domain.seen_boxes import Scene
from app.domain.track_votes import assign_tracks
from app.domain.waterplane import M_PER_S_PER_KN

FARTHEST_M = 60.0  # Huang 2021
LATEST_S = 25.0  # Qu 2022: from when AIS has the vessel at that place
FARTHEST_ASIDE_M = 45.0  # of its course
_NOWHERE_M = 1e9
_SLOWEST_M_S = 1.5  # a vessel at rest arrives nowhere


def match_tracks(
    camera: Camera, scenes: Sequence[Scene], times_s: Sequence[float], settings: FusionSettings
) -> list[list[GroundPair]]:
    """Match by `huang_2021` or `qu_2022`: pairs of each image, costs of at most 1.

    Images come in the order of their times; those too far apart for a series are each their own.
    Detections below the score threshold take no part.
    """
    pairs: list[list[GroundPair]] = [[] for _ in scenes]
    series = split_series(times_s, settings.series_gap_s)
    in_series = {image for images in series for image in images}
    alone = [range(i, i + 1) for i in range(len(scenes)) if i not in in_series]
    for images in [*series, *alone]:
        for image, pair in _of_series(camera, scenes, images, times_s, settings):
            pairs[image].append(pair)
    return [sorted(of_image, key=lambda pair: pair.detection) for of_image in pairs]


def _of_series(
    camera: Camera,
    scenes: Sequence[Scene],
    images: range,
    times_s: Sequence[float],
    settings: FusionSettings,
) -> list[tuple[int, GroundPair]]:
    tracks = _tracks(scenes, images, times_s, settings)
    names = sorted({c.state.identifier for i in images for c in scenes[i].candidates})
    if not tracks or not names:
        return []
    number = {name: index for index, name in enumerate(names)}
    shown = {image for track in tracks for image, _ in track}
    compared = {image: _compare(camera, scenes[image], number, settings) for image in shown}
    cost = np.array([_mean_cost(track, compared) for track in tracks])
    given = assign_tracks(1 - cost, _together(tracks))
    return [
        (image, compared[image].pair(detection, given[row], cost[row, given[row]]))
        for row, track in enumerate(tracks)
        if given[row] >= 0
        for image, detection in track
    ]


def _tracks(
    scenes: Sequence[Scene], images: range, times_s: Sequence[float], settings: FusionSettings
) -> list[list[Sample]]:
    boxes = [
        [
            (i, d)
            for i, d in enumerate(scenes[image].detections)
            if d.score >= settings.score_threshold
        ]
        for image in images
    ]
    if len(images) == 1:
        return [[(images[0], index)] for index, _ in boxes[0]]
    found = image_tracks([times_s[image] for image in images], boxes)
    return [[(images[number], index) for number, index in track] for track in found]


@dataclass(frozen=True, eq=False)
class _Compared:
    """An image's detections (rows) against all vessels of the series by number (columns).

    `cost` is endless for vessels that are no candidates here; `candidate_of` finds the others.
    """

    cost: FloatArray
    candidate_of: Mapping[int, int]
    there: OnWater

    def pair(self, detection: int, vessel: int, total: float) -> GroundPair:
        """Return the pair of a detection and a vessel that is a candidate."""
        candidate = self.candidate_of[vessel]
        return GroundPair(detection, candidate, self.there.cost(detection, candidate, total))


def _compare(
    camera: Camera, scene: Scene, number: Mapping[str, int], settings: FusionSettings
) -> _Compared:
    vessels = [number[candidate.state.identifier] for candidate in scene.candidates]
    cost = np.full((len(scene.detections), len(number)), np.inf)
    there = OnWater.of(scene.detections, scene.candidates, camera)
    huang = settings.matching is MatchingMethod.HUANG_2021
    cost[:, vessels] = (
        there.distance_m / FARTHEST_M if huang else _arrival_cost(there, scene.candidates)
    )
    return _Compared(cost, {vessel: index for index, vessel in enumerate(vessels)}, there)


def _arrival_cost(there: OnWater, candidates: Sequence[Candidate]) -> FloatArray:
    """Return how much earlier or later AIS has vessels at places, in share of the limits."""
    segments = [candidate.segment for candidate in candidates]
    ahead = [(s.enu_axes_in_world @ s.vessel_axes_in_world[0])[:2] for s in segments]
    forward = np.array(ahead).reshape(-1, 2)
    speeds = [candidate.state.speed_kn * M_PER_S_PER_KN for candidate in candidates]
    off = np.nan_to_num(there.off_m, posinf=_NOWHERE_M)
    along = np.abs((off * forward).sum(axis=2))
    aside = np.abs(off[..., 0] * forward[:, 1] - off[..., 1] * forward[:, 0])
    late_s = along / np.maximum(speeds, _SLOWEST_M_S)
    return np.asarray(np.maximum(late_s / LATEST_S, aside / FARTHEST_ASIDE_M))


def _mean_cost(track: Sequence[Sample], compared: Mapping[int, _Compared]) -> FloatArray:
    """Return a track's mean cost of each vessel; endless where it is missing in an image."""
    costs = [compared[image].cost[detection] for image, detection in track]
    return np.asarray(np.mean(costs, axis=0))


def _together(tracks: Sequence[Sequence[Sample]]) -> BoolArray:
    """Return which tracks (n, n) have boxes in the same image."""
    images = [{image for image, _ in track} for track in tracks]
    return np.array([[bool(one & other) for other in images] for one in images])
