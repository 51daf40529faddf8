"""The skin of a hull: paint that weathers, corners in shade, the sun's shadow, glass and waterline.

Flat faces of one colour give a drawing away. Rust runs down from the deck, plates differ a little,
panes mirror different pieces of the sky, and a hull is dark and wet where the water has just been.
"""

from functools import cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.simulation.fleet_view import HullView
from app.simulation.light import Light
from app.simulation.mesh import Mesh, Shade, Surface, rgb
from app.simulation.noise import cloud_tile
from app.simulation.shadows import SunView, openness
from app.simulation.sightlines import sight_lines

IntArray: TypeAlias = npt.NDArray[np.int32]

_SHADOW_TEXELS = 320
_RUST = np.array(rgb(150, 92, 60), dtype=np.float32)


@cache
def _grain() -> Shade:
    return cloud_tile(np.random.default_rng(17), 256, 1.0)


def hull_colours(
    camera: Camera,
    view: HullView,
    light: Light,
    R_enu_from_vessel: FloatArray,
    middle_in_enu_m: FloatArray,
) -> Shade:
    """Return linear colours (n, 3) of a hull's n samples, row by row, with the haze before them.

    Rotation (3, 3) and middle (3,) of the ship on the water say where a pattern sticks to it.
    """
    mask, mesh = view.raster.mask, view.mesh
    face = view.raster.face[mask]
    sight = sight_lines(camera, view.raster.window)[mask]
    ahead = camera.R_cam_from_world[2].astype(np.float32)
    away = 1 / (view.raster.inverse_depth[mask] * (sight @ ahead))
    place = sight * away[:, None] + camera.center_in_world.astype(np.float32)
    on_ship = (place - middle_in_enu_m.astype(np.float32)) @ R_enu_from_vessel.astype(np.float32)
    direct, around = light.parts_on(mesh.normals(), mesh.colours)
    colour: Shade = direct[face] * _sunlit(mesh, light, place)[:, None]
    px_m = float(np.median(away)) / float(camera.intrinsics.K[0, 0])
    reach = int(np.clip(0.9 / px_m, 1, 24)) * view.raster.window.samples_per_px
    open_sky = openness(view.raster.inverse_depth, mask, reach, 1.6)[mask][:, None]
    colour = colour + around[face] * open_sky
    colour = _weathered(colour, mesh, face, on_ship)
    glass = mesh.surfaces[face] == Surface.GLASS
    mirrored = 0.06 + 0.45 * _hashed(face[glass])[:, None] ** 3
    colour[glass] += light.horizon * mirrored
    colour *= np.clip(0.55 + 0.45 * on_ship[:, 2:] / 0.7, 0.55, 1.0)  # wet at the waterline
    clear = np.exp(-away / light.weather.visibility_m)[:, None]
    hazy: Shade = colour * clear + light.haze * (1 - clear)
    return hazy


def _sunlit(mesh: Mesh, light: Light, place: Shade) -> Shade:
    if not light.casts_shadows:
        return np.ones(len(place), dtype=np.float32)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    radius_m = float(np.linalg.norm(high - low)) / 2
    sun = SunView.of(mesh, light.to_sun_in_enu, (low + high) / 2, radius_m, _SHADOW_TEXELS)
    return sun.lit(place)


def _weathered(colour: Shade, mesh: Mesh, face: IntArray, on_ship: Shade) -> Shade:
    along, up = on_ship[:, 0] + np.float32(0.6) * on_ship[:, 1], on_ship[:, 2]
    plates, runs = _grain_at(along / 24, up / 34), _grain_at(along / 7, up / 90 + 0.31)
    colour = colour * (1 + 0.055 * plates + 0.05 * runs)[:, None]
    upright = np.abs(mesh.normals()[face, 2]) < 0.5
    rusty = np.clip(runs - 1.1, 0, 1) * upright * (mesh.surfaces[face] == Surface.PAINT)
    rusty *= np.clip(up / 1.2, 0, 1) * 0.3
    bright = colour.mean(axis=1, keepdims=True)
    rust = _RUST * (0.4 + 1.6 * bright)
    mixed: Shade = colour + (rust - colour) * rusty[:, None]
    return mixed


def _grain_at(u: Shade, v: Shade) -> Shade:
    """Return the grain (n,) at positions counted in tiles."""
    tile = _grain()
    size = len(tile)
    row, column = (np.floor(w * size).astype(np.int32) % size for w in (v, u))
    found: Shade = tile[row, column]
    return found


def _hashed(face: IntArray) -> Shade:
    """Return a number from 0 to 1 for each face, the same every time."""
    mixed = (face.astype(np.uint64) * np.uint64(2654435761)) % np.uint64(2**32)
    return (mixed / np.float64(2**32)).astype(np.float32)
