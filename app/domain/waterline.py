"""Preset `waterline`: where all ships of a while stand on one water surface.

The published method puts the error of the water's height and that of a ship's range into one
vertical shift. Here both are told apart by all ships together (`shared_water`), and each box stands
where the camera shows its ship, so that it fits the image although the camera is a little off.

The top is raised along the vertical to the upper edge of the detection. Which part of a ship
touches that edge nobody knows: on a low barge it is the farther end of the deck, on a ship with a
mast something amidships. The height lies between the two, and its sigma says how far they differ.
"""

from collections.abc import Sequence

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.fusion_settings import FusionSettings
from app.domain.shared_water import Roads, Solution, solve, times
from app.domain.sighting import Sighting, VesselBox

# A place this unsure along its worst direction, and evidence that contradicts AIS this much.
_UNSURE_PLACE_M = 10.0
_CONTRADICTION = 4.0
_TOP_M = 0.08  # masts a detector overlooks
# A ship this high in share of its length has masts or a house amidships rather than a flat deck.
_TALL_SHARE = 0.2
_TOP_SIGMA = 0.4  # of where between the farthest corner and the middle the highest point is
# Bow-port, bow-starboard, stern-starboard, stern-port, in half lengths and half widths.
_CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


def waterline_boxes(
    camera: Camera, sightings: Sequence[Sighting], settings: FusionSettings
) -> list[VesselBox]:
    """Find the boxes of all sightings of one viewport within one time window, in their order."""
    if not sightings:
        return []
    roads = Roads(camera, sightings, settings)
    return _boxes(sightings, roads, solve(roads))


def _boxes(sightings: Sequence[Sighting], roads: Roads, solution: Solution) -> list[VesselBox]:
    """Raise each ship's corners from the water to the upper edge of its detection."""
    forward, port = roads.turned(solution.own[:, 2])
    middle = roads.middles(solution.own, solution.shared)
    along, across = np.swapaxes(roads.sizes[:, None] / 2 * _CORNERS, 0, 2)
    bottom = np.swapaxes(middle + along[..., None] * forward + across[..., None] * port, 0, 1)
    rise = (roads.delta * roads.up).sum(axis=1)
    height_m, top_sigma_m = _heights(roads, rise, middle, bottom)
    by_place = -times(roads.enu, roads.delta) / rise[:, None]
    bottom_covariance = _bottom_covariance(roads, solution)
    top_variance = _edge_m(roads) ** 2 + _TOP_M**2 + top_sigma_m**2
    height_sigma_m = np.sqrt(
        (by_place * times(bottom_covariance, by_place)).sum(axis=1) + top_variance
    )
    covariance = _centroid_covariance(bottom_covariance, by_place, top_variance)
    heading_sigma_deg = np.degrees(np.sqrt(solution.covariance[:, 2, 2]))
    turn_deg = np.degrees(solution.own[:, 2])
    level_m, pitch, _, roll = solution.shared
    lifted_m = level_m + pitch * roads.range_m + roll * roads.aside_m
    axes = np.stack([forward, port, roads.up], axis=1)
    is_unsure = np.linalg.eigvalsh(covariance[:, :2, :2])[:, -1] > _UNSURE_PLACE_M**2
    is_odd = solution.deviation > _CONTRADICTION
    return [
        VesselBox(
            vessel_axes_in_world=axes[index],
            heading_deg=float((sighting.candidate.state.heading_deg + turn_deg[index]) % 360),
            bottom_in_world=bottom[index],
            top_from_bottom_m=height_m[index] * roads.up[index],
            height_m=float(height_m[index]),
            water_level_m=float(sighting.water_level_m + lifted_m[index]),
            position_covariance_in_enu_m2=covariance[index],
            heading_sigma_deg=float(heading_sigma_deg[index]),
            height_sigma_m=float(height_sigma_m[index]),
            doubts=("unsure_place",) * bool(is_unsure[index])
            + ("contradicts_ais",) * bool(is_odd[index]),
        )
        for index, sighting in enumerate(sightings)
    ]


def _heights(
    roads: Roads, rise: FloatArray, middle: FloatArray, bottom: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return heights (n,) and how unsure they are for not knowing what of a ship is highest."""

    def raised_m(points: FloatArray) -> FloatArray:
        away = points - roads.center_in_world
        return np.asarray(-(away @ roads.delta[..., None])[..., 0] / rise[:, None])

    from_middle = raised_m(middle[:, None])[:, 0]
    from_corner = raised_m(bottom).min(axis=1)
    share = from_corner / np.maximum(roads.sizes[:, 0], 1.0)
    amidships = np.clip(share / _TALL_SHARE, 0.0, 1.0)
    apart = from_middle - from_corner
    return from_corner + amidships * apart, _TOP_SIGMA * apart


def _edge_m(roads: Roads) -> FloatArray:
    """Return one sigma (n,) of a detection's upper edge in metres at the ship."""
    return np.asarray(roads.box_sigma_px * roads.range_m / roads.focal_px)


def _bottom_covariance(roads: Roads, solution: Solution) -> FloatArray:
    """Return the covariances (n, 3, 3) of the bottoms' middles, east, north, up."""
    to_enu = np.zeros((len(roads.range_m), 3, solution.covariance.shape[1]))
    to_enu[:, 0, 0] = to_enu[:, 1, 1] = to_enu[:, 2, 3] = 1.0
    to_enu[:, 2, 4], to_enu[:, 2, 6] = roads.range_m, roads.aside_m
    to_enu[:, :, 5] = roads.range_m[:, None] * times(roads.enu, roads.right)
    return np.asarray(to_enu @ solution.covariance @ np.swapaxes(to_enu, 1, 2))


def _centroid_covariance(
    bottom: FloatArray, height_by_place: FloatArray, top_variance: FloatArray
) -> FloatArray:
    """Return the covariances of the boxes' centroids: half a height above their bottoms."""
    to_centroid = np.tile(np.eye(3), (len(bottom), 1, 1))
    to_centroid[:, 2] += height_by_place / 2
    covariance: FloatArray = to_centroid @ bottom @ np.swapaxes(to_centroid, 1, 2)
    covariance[:, 2, 2] += top_variance / 4
    return covariance
