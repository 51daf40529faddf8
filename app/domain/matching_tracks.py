"""How related systems give AIS to tracks of a camera rather than to single boxes.

Huang et al. (2021, Journal of Navigation 74, "Identity recognition on waterways") follow ships with
DeepSORT, map them to the water by a homography and give each track the AIS, dead-reckoned to the
image's time, that is nearest to it in metres. Qu et al. (2022, IEEE ITSC, "Intelligent maritime
surveillance framework") sort out AIS that is incomplete, out of range or on another course, and
compare when a vessel is at the place where the camera has it. Their detectors and learnt appearance
are left out: all methods here get the same boxes, the same camera and our tracker. A track's cost
is the mean over its boxes; limits are ours, chosen for the fewest errors on simulated traffic.
"""

from collections.abc import Sequence

import numpy as np

from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate
from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.image_series import split_series
from app.domain.image_tracks import Sample, image_tracks
from app.domain.matching_baselines import GroundCost, GroundPair, OnWater, on_water
from app.domain.seen_boxes import Scene
from app.domain.track_votes import assign_tracks
from app.domain.waterplane import M_PER_S_PER_KN

FARTHEST_M = 60.0  # Huang 2021
LATEST_S = 25.0  # Qu 2022: from when AIS has the vessel at that place
FARTHEST_ASIDE_M = 45.0  # of its course
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
    compared = [
        [_compare(camera, scenes[image], detection, settings) for image, detection in track]
        for track in tracks
    ]
    cost = np.array([_mean_cost(boxes, number) for boxes in compared])
    given = assign_tracks(1 - cost, _together(tracks))
    return [
        (image, GroundPair(detection, candidate, GroundCost(cost[row, given[row]], *where)))
        for row, track in enumerate(tracks)
        if given[row] >= 0
        for (image, detection), box in zip(track, compared[row], strict=True)
        for name, (candidate, _, *where) in box.items()
        if number[name] == given[row]
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


# By vessel: the candidate's index, its cost, and how far the box is from it (m, deg).
Compared = dict[str, tuple[int, float, float, float]]


def _compare(camera: Camera, scene: Scene, detection: int, settings: FusionSettings) -> Compared:
    huang = settings.matching is MatchingMethod.HUANG_2021
    compared: Compared = {}
    for index, candidate in enumerate(scene.candidates):
        there = on_water(scene.detections[detection], candidate, camera)
        if there is None:
            continue
        cost = there.distance_m / FARTHEST_M if huang else _arrival_cost(there, candidate)
        name = candidate.state.identifier
        compared[name] = (index, cost, there.distance_m, there.bearing_deg)
    return compared


def _arrival_cost(there: OnWater, candidate: Candidate) -> float:
    """Return how much earlier or later AIS has a vessel at a place, in share of the limits."""
    state, segment = candidate.state, candidate.segment
    forward = (segment.enu_axes_in_world @ segment.vessel_axes_in_world[0])[:2]
    along = abs(float(there.off_m @ forward))
    aside = abs(float(there.off_m[0] * forward[1] - there.off_m[1] * forward[0]))
    late_s = along / max(state.speed_kn * M_PER_S_PER_KN, _SLOWEST_M_S)
    return max(late_s / LATEST_S, aside / FARTHEST_ASIDE_M)


def _mean_cost(boxes: Sequence[Compared], number: dict[str, int]) -> FloatArray:
    """Return a track's mean cost of each vessel; endless where it is missing in an image."""
    costs = np.full((len(boxes), len(number)), np.inf)
    for row, box in enumerate(boxes):
        for name, (_, cost, *_) in box.items():
            costs[row, number[name]] = cost
    return np.asarray(costs.mean(axis=0))


def _together(tracks: Sequence[Sequence[Sample]]) -> BoolArray:
    """Return which tracks (n, n) have boxes in the same image."""
    images = [{image for image, _ in track} for track in tracks]
    return np.array([[bool(one & other) for other in images] for one in images])
