"""The land as one viewport sees it: found once, lit for every session.

What covers which pixel does not change with the light. So the faces ashore, their distance and
their texture (rows of windows, corrugated walls, leaves, stained quay walls) are worked out once
for a viewport; the light of a session is then a matter of a table by face.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from app.domain.camera import Camera
from app.simulation.light import Light
from app.simulation.mesh import Mesh, Shade, Surface
from app.simulation.noise import cloud_tile, sampled
from app.simulation.raster import Raster, Window, rasterise
from app.simulation.sightlines import sight_lines


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Land in a viewport, at the samples of `raster.window`.

    `texture` (height, width) brightens or darkens, `height_m` is above the mean water level, both
    meaningless where there is no face.
    """

    mesh: Mesh
    raster: Raster
    texture: Shade
    height_m: Shade
    distance_m: Shade

    def above(self, water_level_m: float) -> npt.NDArray[np.bool_]:
        """Where land stands out of the water (height, width)."""
        return self.raster.mask & (self.height_m >= water_level_m)

    def inverse_depth(self, water_level_m: float) -> Shade:
        """Inverse depth of the land above water (height, width), 0 elsewhere."""
        return np.where(self.above(water_level_m), self.raster.inverse_depth, np.float32(0.0))

    def lit(self, light: Light, water_level_m: float) -> tuple[Shade, Shade]:
        """Return colour times coverage (h, w, 3) and coverage (h, w) in whole pixels."""
        table = light.on(self.mesh.normals(), self.mesh.colours)
        shown = self.above(water_level_m)
        colour = table[np.maximum(self.raster.face, 0)] * self.texture[..., None]
        clear = np.exp(-self.distance_m / light.weather.visibility_m)[..., None]
        colour = colour * clear + light.haze * (1 - clear)
        wet = np.clip((self.height_m - water_level_m) / 1.6, 0.45, 1.0)[..., None]
        colour = np.where(self.height_m[..., None] < water_level_m + 1.6, colour * wet, colour)
        colour *= shown[..., None]
        per_px = self.raster.window.samples_per_px
        size = (shown.shape[1] // per_px, shown.shape[0] // per_px)
        coverage = cv2.resize(shown.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        small = cv2.resize(colour, size, interpolation=cv2.INTER_AREA)
        return np.asarray(small), np.asarray(coverage)


def build_backdrop(camera: Camera, mesh: Mesh, samples_per_px: int) -> Backdrop:
    """Work out the land as a camera sees it."""
    inner = camera.intrinsics
    window = Window(
        0, 0, inner.width_px * samples_per_px, inner.height_px * samples_per_px, samples_per_px
    )
    raster = rasterise(camera, mesh, window)
    sight = sight_lines(camera, window)
    along_axis = sight @ camera.R_cam_from_world[2].astype(np.float32)
    depth = np.where(raster.mask, 1 / np.maximum(raster.inverse_depth, 1e-6), np.float32(1.0))
    distance = (depth / along_axis).astype(np.float32)
    place = sight * distance[..., None] + camera.center_in_world.astype(np.float32)
    texture = _texture(mesh, raster, place, distance / float(inner.K[0, 0]) / samples_per_px)
    return Backdrop(mesh, raster, texture, np.ascontiguousarray(place[..., 2]), distance)


def _texture(mesh: Mesh, raster: Raster, place: Shade, footprint_m: Shade) -> Shade:
    """Return the brightness (height, width) of what faces are made of.

    `footprint_m` is a sample's size at the surface: patterns finer than it fade out.
    """
    face = np.maximum(raster.face, 0)
    surface = mesh.surfaces[face]
    normal = mesh.normals()[face].astype(np.float32)
    sideways = place[..., 0] * -normal[..., 1] + place[..., 1] * normal[..., 0]
    up = place[..., 2]
    rng = np.random.default_rng(7)
    grain = cloud_tile(rng, 256, 1.1)
    tile_m = np.where(surface == Surface.FOLIAGE, np.float32(14.0), np.float32(60.0))
    across = sideways + 0.7 * place[..., 0]
    speckle = np.clip(sampled(grain, across / tile_m, (up * 3 + place[..., 1]) / tile_m), -2, 2)
    texture = 1 + 0.05 * speckle
    upright = np.abs(normal[..., 2]) < 0.3

    def pattern(kind: Surface, size_m: float) -> tuple[npt.NDArray[np.bool_], Shade]:
        fade = np.clip(1.6 - 2.2 * footprint_m / size_m, 0, 1).astype(np.float32)
        return (surface == kind) & upright, fade

    where, fade = pattern(Surface.MASONRY, 2.4)
    pane = (np.mod(up, 3.4) > 1.3) & (np.mod(up, 3.4) < 2.8) & (np.mod(sideways, 2.6) > 1.1)
    texture = np.where(where, texture * (1 - (0.2 + 0.42 * (pane - 0.3)) * fade), texture)
    where, fade = pattern(Surface.SHEETING, 1.5)
    ribs = np.sin(sideways * (2 * np.pi / 1.6))
    texture = np.where(where, texture * (1 + 0.1 * ribs * fade), texture)
    where, fade = pattern(Surface.SHEET_PILES, 3.0)
    ribs = np.sin(sideways * (2 * np.pi / 2.8))
    texture = np.where(where, texture * (1 + 0.22 * ribs * fade + 0.1 * speckle), texture)
    texture = np.where(surface == Surface.FOLIAGE, 1 + 0.3 * speckle, texture)
    return np.where(surface == Surface.GROUND, 1 + 0.14 * speckle, texture).astype(np.float32)
