"""The land as one viewport sees it: found once, lit for every session.

What covers which pixel does not change with the light. So the faces ashore, their distance and
their texture (rows of windows, corrugated walls, leaves, stained quay walls) are worked out once
for a viewport; the light of a session is then a matter of a table by face.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from app.domain.arrays import Float32Array
from app.domain.camera import Camera
from app.simulation.light import Light
from app.simulation.mesh import Mesh, Shade, Surface
from app.simulation.noise import cloud_tile
from app.simulation.raster import Window, rasterise
from app.simulation.shadows import SunView, openness
from app.simulation.sightlines import sight_lines

_SHADOWS_WITHIN_M = 1300.0
_SHADOW_TEXELS = 2048


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Land in a viewport, at the samples of `window` where `covered` (height, width) is set.

    The arrays `face`, `texture` (brightens or darkens), `open_sky` (0 to 1), `place` (n, 3; its
    height above the mean water level) and `distance_m` list only those n samples, row by row;
    `inverse_depth` too, 1/m along the axis.
    """

    mesh: Mesh
    window: Window
    covered: npt.NDArray[np.bool_]
    face: npt.NDArray[np.int32]
    inverse_depth: Shade
    texture: Shade
    open_sky: Shade
    place: Shade
    distance_m: Shade

    def inverse_depth_above(self, water_level_m: float) -> Float32Array:
        """Inverse depth of the land above water (height, width), 0 elsewhere."""
        depth = np.zeros(self.covered.shape, dtype=np.float32)
        depth[self.covered] = np.where(self.place[:, 2] >= water_level_m, self.inverse_depth, 0.0)
        return depth

    def lit(self, light: Light, water_level_m: float) -> tuple[Shade, Shade]:
        """Return colour times coverage (h, w, 3) and coverage (h, w) in whole pixels."""
        direct, around = light.parts_on(self.mesh.normals(), self.mesh.colours)
        colour = direct[self.face] * self._sunlit(light)[:, None]
        colour += around[self.face] * self.open_sky[:, None]
        colour *= self.texture[:, None]
        clear = np.exp(-self.distance_m / light.weather.visibility_m)[:, None]
        colour = colour * clear + light.haze * (1 - clear)
        above_m = self.place[:, 2] - water_level_m
        # Walls are wet and dark up to where the last waves reached.
        colour *= np.clip(above_m / 1.6, 0.45, 1.0)[:, None]
        colour[above_m < 0] = 0.0
        canvas = np.zeros((*self.covered.shape, 3), dtype=np.float32)
        canvas[self.covered] = colour
        shown = np.zeros(self.covered.shape, dtype=np.float32)
        shown[self.covered] = above_m >= 0
        per_px = self.window.samples_per_px
        size = (self.window.width // per_px, self.window.height // per_px)
        cover = cv2.resize(shown, size, interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.resize(canvas, size, interpolation=cv2.INTER_AREA)), np.asarray(cover)

    def _sunlit(self, light: Light) -> Shade:
        """Return how much of the sun reaches each sample (n,), 0 to 1."""
        if not light.casts_shadows:
            return np.ones(len(self.face), dtype=np.float32)
        # What matters is what fills most of the image: land some hundred metres ahead.
        ahead = self.place[self.distance_m < _SHADOWS_WITHIN_M]
        middle = ahead.mean(axis=0, dtype=np.float64) if len(ahead) else np.zeros(3)
        sun = SunView.of(
            self.mesh, light.to_sun_in_enu, middle, _SHADOWS_WITHIN_M / 2, _SHADOW_TEXELS
        )
        return sun.lit(self.place)


def build_backdrop(camera: Camera, mesh: Mesh, samples_per_px: int) -> Backdrop:
    """Work out the land as a camera sees it."""
    inner = camera.intrinsics
    window = Window(
        0, 0, inner.width_px * samples_per_px, inner.height_px * samples_per_px, samples_per_px
    )
    raster = rasterise(camera, mesh, window)
    covered = raster.mask
    face, inverse_depth = raster.face[covered], raster.inverse_depth[covered]
    sight = sight_lines(camera, window)[covered]
    along_axis = sight @ camera.R_cam_from_world[2].astype(np.float32)
    away = 1 / (inverse_depth * along_axis)
    place = sight * away[:, None] + camera.center_in_world.astype(np.float32)
    footprint = away / np.float32(inner.K[0, 0] * samples_per_px)
    texture = _texture(mesh, face, place, footprint)
    corners = openness(raster.inverse_depth, covered, 4 * samples_per_px, 3.0)[covered]
    return Backdrop(mesh, window, covered, face, inverse_depth, texture, corners, place, away)


def _texture(mesh: Mesh, face: npt.NDArray[np.int32], place: Shade, footprint_m: Shade) -> Shade:
    """Return the brightness (n,) of what faces are made of, at places (n, 3) on them.

    `footprint_m` is a sample's size at the surface: patterns finer than it fade out.
    """
    surface = mesh.surfaces[face]
    normal = mesh.normals().astype(np.float32)[face]
    sideways = place[:, 1] * normal[:, 0] - place[:, 0] * normal[:, 1]
    up = place[:, 2]
    grain = cloud_tile(np.random.default_rng(7), 256, 1.1)
    column = (sideways + np.float32(0.7) * place[:, 0]) * np.float32(256)
    row = (up * 3 + place[:, 1]) * np.float32(256)

    def grain_at(tile_m: float, where: npt.NDArray[np.bool_] | slice = slice(None)) -> Shade:
        rows, columns = (
            (way[where] / np.float32(tile_m)).astype(np.int32) % 256 for way in (row, column)
        )
        fade = np.clip(2 - footprint_m[where] * np.float32(12 / tile_m), 0.3, 1)
        values: Shade = np.clip(grain[rows, columns], -2, 2) * fade
        return values

    speckle = grain_at(60.0)
    texture: Shade = 1 + np.float32(0.05) * speckle
    upright = np.abs(normal[:, 2]) < 0.3

    where = (surface == Surface.MASONRY) & upright
    floor, bay = np.mod(up[where], 3.4), np.mod(sideways[where], 2.6)
    pane = ((floor > 1.3) & (floor < 2.8) & (bay > 1.1)) - np.float32(0.3)
    fade = np.clip(1.6 - 2.2 * footprint_m[where] / 2.4, 0, 1)
    texture[where] *= 1 - (np.float32(0.2) + np.float32(0.42) * pane) * fade

    where = (surface == Surface.SHEETING) & upright
    ribs = np.sin(sideways[where] * np.float32(2 * np.pi / 1.6))
    texture[where] *= 1 + 0.1 * ribs * np.clip(1.6 - 2.2 * footprint_m[where] / 1.5, 0, 1)

    where = (surface == Surface.SHEET_PILES) & upright
    ribs = np.sin(sideways[where] * np.float32(2 * np.pi / 2.8))
    fade = np.clip(1.6 - 2.2 * footprint_m[where] / 3.0, 0, 1)
    texture[where] *= 1 + 0.22 * ribs * fade + 0.1 * speckle[where]

    where = surface == Surface.FOLIAGE
    texture[where] = 1 + 0.26 * grain_at(14.0, where) + 0.24 * grain_at(3.5, where)
    where = surface == Surface.GROUND
    texture[where] = 1 + 0.14 * speckle[where] + 0.06 * grain_at(9.0, where)
    return texture
