"""Which features stand still: neither clouds nor what floats on the water.

A ferry photographed twice matches itself beautifully and says that the camera turned. Registration
knows better: it gives the horizon, above which large soft blobs are clouds, and the place where
each line of sight meets the water. Where that place is nearer than the land that was marked in that
direction, there is only water, and what is seen there moves.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.geodesy import WorldFrame
from app.domain.reregistration_features import Features

EARTH_RADIUS_M = 6_371_000.0
HIGHEST_SCENERY_DEG = 15.0
LARGEST_SKYLINE_FEATURE_PX = 24.0
NEAR_SIDE_OF_LAND = 0.85  # quays reach out before the landmark that stands on them
SAME_DIRECTION = 0.1  # of the image's width


@dataclass(frozen=True, eq=False)
class Scene:
    """What registration knows of a site: its frame, its water, and where land was marked.

    `land_in_world` (n, 3) are landmarks; with none of them nothing is taken for water, except
    what is nearer than `nearest_land_m` where that is known.
    """

    frame: WorldFrame
    water_level_m: float
    land_in_world: FloatArray
    nearest_land_m: float | None = None


def scenery(features: Features, camera: Camera, scene: Scene) -> npt.NDArray[np.bool_]:
    """Return which features (n,) may be trusted to stand still, seen by that camera."""
    place = scene.frame.geodetic(camera.center_in_world)
    axes = scene.frame.axes(place.lat_deg, place.lon_deg)
    rays = camera.rays(features.pixels_px) @ axes.T  # east, north, up
    height_m = place.height_m - scene.water_level_m
    dip_rad = np.sqrt(2 * max(height_m, 0.0) / EARTH_RADIUS_M)
    elevation_rad = np.arcsin(np.clip(rays[:, 2], -1, 1))
    is_above = elevation_rad > -dip_rad
    is_sky = is_above & (
        (features.diameters_px > LARGEST_SKYLINE_FEATURE_PX)
        | (elevation_rad > np.radians(HIGHEST_SCENERY_DEG))
    )
    down = np.where(is_above, np.nan, np.maximum(-elevation_rad, 1e-6))
    water_at_m = height_m / np.tan(down)
    land_at_m = _land_at_m(rays, camera, axes, scene)
    is_water = ~is_above & (water_at_m < NEAR_SIDE_OF_LAND * land_at_m)
    return np.asarray(np.isfinite(rays).all(axis=1) & ~is_sky & ~is_water)


def _land_at_m(rays: FloatArray, camera: Camera, axes: FloatArray, scene: Scene) -> FloatArray:
    """Return how far the nearest known land is in each ray's direction (n,), metres."""
    least_m = np.full(len(rays), scene.nearest_land_m or 0.0)
    if len(scene.land_in_world) == 0:
        return least_m
    land = (scene.land_in_world - camera.center_in_world) @ axes.T
    distances_m = np.hypot(land[:, 0], land[:, 1])
    intrinsics = camera.intrinsics
    window_rad = SAME_DIRECTION * intrinsics.width_px / intrinsics.K[0, 0]
    bearing = np.arctan2(rays[:, 0], rays[:, 1])
    turn = np.abs(bearing[:, None] - np.arctan2(land[:, 0], land[:, 1]))
    turn = np.minimum(turn, 2 * np.pi - turn)
    # Where nothing was marked in a direction, the landmark nearest to it speaks for it.
    reach = np.maximum(window_rad, turn.min(axis=1, keepdims=True) + 1e-9)
    near_m: FloatArray = np.where(turn <= reach, distances_m, np.inf).min(axis=1)
    furthest: FloatArray = np.maximum(near_m, least_m)
    return furthest
