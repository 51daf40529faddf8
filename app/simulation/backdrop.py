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
from app.simulation.sightlines import sight_lines


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Land in a viewport, at the samples of `window` where `covered` (height, width) is set.

    The arrays `face`, `texture` (brightens or darkens), `height_m` (above the mean water level) and
    `distance_m` list only those n samples, row by row; `inverse_depth` too, 1/m along the axis.
    """

    mesh: Mesh
    window: Window
    covered: npt.NDArray[np.bool_]
    face: npt.NDArray[np.int32]
    inverse_depth: Shade
    texture: Shade
    height_m: Shade
    distance_m: Shade

    def inverse_depth_above(self, water_level_m: float) -> Float32Array:
        """Inverse depth of the land above water (height, width), 0 elsewhere."""
        depth = np.zeros(self.covered.shape, dtype=np.float32)
        depth[self.covered] = np.where(self.height_m >= water_level_m, self.inverse_depth, 0.0)
        return depth

    def lit(self, light: Light, water_level_m: float) -> tuple[Shade, Shade]:
        """Return colour times coverage (h, w, 3) and coverage (h, w) in whole pixels."""
        table = light.on(self.mesh.normals(), self.mesh.colours)
        clear = np.exp(-self.distance_m / light.weather.visibility_m)[:, None]
        colour = table[self.face] * self.texture[:, None]
        colour = colour * clear + light.haze * (1 - clear)
        above_m = self.height_m - water_level_m
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
    height = np.ascontiguousarray(place[:, 2])
    return Backdrop(mesh, window, covered, face, inverse_depth, texture, height, away)


def _texture(mesh: Mesh, face: npt.NDArray[np.int32], place: Shade, footprint_m: Shade) -> Shade:
    """Return the brightness (n,) of what faces are made of, at places (n, 3) on them.

    `footprint_m` is a sample's size at the surface: patterns finer than it fade out.
    """
    surface = mesh.surfaces[face]
    normal = mesh.normals().astype(np.float32)[face]
    sideways = place[:, 1] * normal[:, 0] - place[:, 0] * normal[:, 1]
    up = place[:, 2]
    grain = cloud_tile(np.random.default_rng(7), 256, 1.1)
    tile_m = np.where(surface == Surface.FOLIAGE, np.float32(14.0), np.float32(60.0))
    column = (sideways + np.float32(0.7) * place[:, 0]) / tile_m * 256
    row = (up * 3 + place[:, 1]) / tile_m * 256
    speckle = np.clip(grain[row.astype(np.int32) % 256, column.astype(np.int32) % 256], -2, 2)
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

    for kind, strength in ((Surface.FOLIAGE, 0.3), (Surface.GROUND, 0.14)):
        where = surface == kind
        texture[where] = 1 + np.float32(strength) * speckle[where]
    return texture
