"""Preset `waterline`: where all ships of a while stand on one water surface.

The published method puts the error of the water's height and that of a ship's range into one
vertical shift. Here both are told apart by all ships together (`shared_water`), and each box stands
where the camera shows its ship, so that it fits the image although the camera is a little off.

The top is raised along the vertical to the upper edge of the detection. Which part of a ship
touches that edge nobody knows: on a low barge it is the farther end of the deck, on a ship with a
mast something amidships. The height lies between the two, and its sigma says how far they differ.
"""

from collections.abc import Sequence
from itertools import compress

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.box_noise import USUAL_SHARE, BoxNoise
from app.domain.camera import Camera
from app.domain.covariances import carried
from app.domain.fusion_settings import FusionSettings
from app.domain.roads import Roads, times
from app.domain.shared_water import Solution, solve
from app.domain.sighting import BoxSigmas, Sighting, VesselBoxes

# A place this unsure along its worst direction, and evidence that contradicts AIS this much.
_UNSURE_PLACE_M = 10.0
_CONTRADICTION = 4.0
_TOP_M = 0.05  # masts a detector overlooks
# Of a ship's breadth so much may be missing by its shape or a loose box before it counts as hidden.
_SEEN_WHOLE = 0.12
_MUCH_HIDDEN = 0.1
# What is hidden may be higher than what is seen by so much, and by this share of the length.
_MAST_M, _MAST_SHARE = 4.0, 0.08
# Poles vanish where a metre has few pixels, and this much of the height with them.
_POLE_PX_PER_M = 4.0
_POLE_M = 1.0
# A ship this high in share of its length has masts or a house amidships rather than a flat deck.
_TALL_SHARE = 0.2
_TOP_SIGMA = 0.33  # of where between the farthest corner and the middle the highest point is
# Bow-port, bow-starboard, stern-starboard, stern-port, in half lengths and half widths.
_CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


def waterline_boxes(
    camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
) -> VesselBoxes:
    """Find the boxes of all sightings, one at least, of one viewport within one time window."""
    roads = Roads(camera, sightings, settings)
    return _boxes(sightings, roads, solve(roads))


def _boxes(sightings: Sequence[Sighting], roads: Roads, solution: Solution) -> VesselBoxes:
    """Raise each ship's corners from the water to the upper edge of its detection."""
    forward, port = roads.turned(solution.own[2])
    antenna = roads.antennas(solution.own, solution.shared)
    middle = antenna + roads.ahead_m * forward + roads.aport_m * port
    along, across = _CORNERS.T[..., None] * roads.sizes[:, None] / 2
    bottom = middle[:, None] + along * forward[:, None] + across * port[:, None]
    rise = (roads.delta * roads.up).sum(axis=0)
    height_m, top_sigma_m = _heights(roads, rise, middle, bottom)
    by_place = -times(roads.enu, roads.delta) / rise
    bottom_covariance = _bottom_covariance(roads, solution)
    hidden = _hidden_share(roads, solution)
    top_variance = (
        _edge_m(roads, solution.box_noise) ** 2
        + _TOP_M**2
        + _vanished_m(roads) ** 2
        + top_sigma_m**2
        + hidden * (_MAST_M + _MAST_SHARE * roads.sizes[0]) ** 2
    )
    by_bottom = (by_place * times(bottom_covariance, by_place)).sum(axis=0)
    covariance = _centroid_covariance(bottom_covariance, by_place, top_variance)
    level_m, pitch, _, roll = solution.shared
    given_m = np.array([sighting.water_level_m for sighting in sightings])
    given_deg = np.array([sighting.candidate.state.heading_deg for sighting in sightings])
    return VesselBoxes(
        vessel_axes_in_world=np.array([forward, port, roads.up]).transpose(2, 0, 1),
        heading_deg=(given_deg + np.degrees(solution.own[2])) % 360,
        bottom_in_world=np.ascontiguousarray(bottom.T),
        top_from_bottom_m=(height_m * roads.up).T,
        height_m=height_m,
        water_level_m=given_m + level_m + pitch * roads.range_m + roll * roads.aside_m,
        sigmas=BoxSigmas(
            position_covariance_in_enu_m2=np.ascontiguousarray(covariance.T),
            heading_deg=np.degrees(np.sqrt(solution.covariance[2, 2])),
            height_m=np.sqrt(by_bottom + top_variance),
        ),
        doubts=_doubts(covariance, solution.deviation, hidden),
    )


def _doubts(
    covariance: FloatArray, deviation: FloatArray, hidden: FloatArray
) -> list[tuple[str, ...]]:
    """Say of which boxes the place is unsure, which contradict AIS and which are half hidden."""
    east, north, both = covariance[0, 0], covariance[1, 1], covariance[0, 1]
    # The larger variance of the two along the ellipse's axes.
    worst = (east + north) / 2 + np.hypot((east - north) / 2, both)
    conditions = (
        ("unsure_place", worst > _UNSURE_PLACE_M**2),
        ("contradicts_ais", deviation > _CONTRADICTION),
        ("partly_hidden", hidden > _MUCH_HIDDEN),
    )
    rows = zip(*(holds.tolist() for _, holds in conditions), strict=True)
    names = [name for name, _ in conditions]
    return [tuple(compress(names, row)) for row in rows]


def _hidden_share(roads: Roads, solution: Solution) -> FloatArray:
    """Return how much of each ship's breadth (n,) is surely not in its box, 0 to 1.

    It has left the image or is behind another ship, and with it perhaps its highest point.
    """
    seen_m = roads.size_px[0] * roads.range_m / roads.focal_px
    share = solution.hidden_m / (solution.hidden_m + seen_m)
    return np.asarray(np.maximum(0.0, share - _SEEN_WHOLE) / (1 - _SEEN_WHOLE))


def _heights(
    roads: Roads, rise: FloatArray, middle: FloatArray, bottom: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return heights (n,) and how unsure they are for not knowing what of a ship is highest."""
    away_m = middle - roads.center_in_world
    from_middle = -(roads.delta * away_m).sum(axis=0) / rise
    to_corners = bottom - roads.center_in_world[:, None]
    from_corner = (-(roads.delta[:, None] * to_corners).sum(axis=0) / rise).min(axis=0)
    share = from_corner / np.maximum(roads.sizes[0], 1.0)
    amidships = np.minimum(np.maximum(0.0, share / _TALL_SHARE), 1.0)
    apart = from_middle - from_corner
    return from_corner + amidships * apart, _TOP_SIGMA * apart


def _edge_m(roads: Roads, box_noise: BoxNoise) -> FloatArray:
    """Return one sigma (n,) of a detection's upper edge in metres at the ship."""
    share_px = USUAL_SHARE * roads.size_px[1]
    usual_px2 = np.stack([np.full_like(share_px, roads.box_sigma_px), share_px]) ** 2
    return np.asarray(np.sqrt(box_noise.of(usual_px2)) * roads.range_m / roads.focal_px)


def _vanished_m(roads: Roads) -> FloatArray:
    """Return one sigma (n,) of what is too thin to be seen at the top of ships far away."""
    px_per_m = roads.focal_px / roads.range_m
    return np.asarray(_POLE_M * np.maximum(0.0, 1 - px_per_m / _POLE_PX_PER_M))


def _bottom_covariance(roads: Roads, solution: Solution) -> FloatArray:
    """Return the covariances (3, 3, n) of the bottoms' middles, east, north, up."""
    to_enu = np.zeros((3, len(solution.covariance), len(roads.range_m)))
    to_enu[0, 0] = to_enu[1, 1] = to_enu[2, 3] = 1.0
    to_enu[:, 2] = times(roads.enu, roads.swung(solution.own))
    to_enu[2, 4], to_enu[2, 6] = roads.range_m, roads.aside_m
    to_enu[:, 5] = roads.range_m * times(roads.enu, roads.right)
    return carried(to_enu, solution.covariance)


def _centroid_covariance(
    bottom: FloatArray, height_by_place: FloatArray, top_variance: FloatArray
) -> FloatArray:
    """Return the covariances of the boxes' centroids: half a height above their bottoms."""
    to_centroid = np.zeros_like(bottom)
    to_centroid[0, 0] = to_centroid[1, 1] = to_centroid[2, 2] = 1.0
    to_centroid[2] += height_by_place / 2
    covariance = carried(to_centroid, bottom)
    covariance[2, 2] += top_variance / 4
    return covariance
