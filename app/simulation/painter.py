"""One image of the harbour: sky, water, land and ships laid over one another.

The painter works in linear light and hands out what a camera would: a soft lens, a little sensor
noise, gamma and eight bits. What does not change within a session (land, sky, lines of sight) is
kept between images.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.camera import Camera
from app.simulation.backdrop import Backdrop, build_backdrop
from app.simulation.fleet_view import HullView, paint_hull
from app.simulation.light import Light
from app.simulation.mesh import Mesh, Shade
from app.simulation.mirror import mirror_of_land, paint_reflection
from app.simulation.noise import cloud_tile, sampled
from app.simulation.raster import Window
from app.simulation.sightlines import sight_lines
from app.simulation.skin import hull_colours
from app.simulation.sky import paint_sky
from app.simulation.wakes import Wake
from app.simulation.water import WaterTextures, WaterView, paint_water

_LARGEST_FINE_WIDTH_PX = 1600  # beyond, one sample a pixel is fine enough


@dataclass(frozen=True, eq=False)
class ViewportScene:
    """What one viewport sees of the land, and where its pixels look."""

    camera: Camera
    backdrop: Backdrop
    sight: Shade
    horizon_row: int

    @staticmethod
    def of(camera: Camera, land: Mesh) -> "ViewportScene":
        """Work out a viewport's view; takes about a second."""
        inner = camera.intrinsics
        sight = sight_lines(camera, Window(0, 0, inner.width_px, inner.height_px, 1))
        below = np.flatnonzero((sight[..., 2] < 0).any(axis=1))
        return ViewportScene(
            camera,
            build_backdrop(camera, land, samples_per_px(inner.width_px)),
            sight,
            int(below[0]) if len(below) else inner.height_px,
        )


def samples_per_px(width_px: int) -> int:
    """Return the samples along each axis of a pixel at an image width."""
    return 2 if width_px <= _LARGEST_FINE_WIDTH_PX else 1


@dataclass(frozen=True, eq=False)
class PlacedHull:
    """A hull where it is: mesh in ENU, distance, its ship's axes, and its wake when under way.

    `R_enu_from_vessel` (3, 3) and `middle_in_enu_m` (3,) place the ship on the water.
    """

    mesh: Mesh
    distance_m: float
    R_enu_from_vessel: FloatArray
    middle_in_enu_m: FloatArray
    wake: Wake | None


@dataclass(frozen=True, eq=False)
class _Still:
    """What images of a session share: sky, land times its coverage, coverage, the land mirrored."""

    scene: ViewportScene
    light: Light
    sky: Shade
    land: Shade
    cover: Shade
    shore: tuple[Shade, Shade]


@dataclass(eq=False)
class Painter:
    """Paints images of one harbour; keeps what a session shares."""

    seed: int
    _textures: WaterTextures = field(init=False)
    _clouds: Shade = field(init=False)
    _session: "_Still | None" = field(default=None, init=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng([self.seed, 11])
        self._textures = WaterTextures.make(rng)
        self._clouds = cloud_tile(rng, 512, 1.75)

    def paint(
        self,
        scene: ViewportScene,
        light: Light,
        levels_m: tuple[float, float],
        time_s: float,
        hulls: Sequence[PlacedHull],
        views: Sequence[HullView],
    ) -> UInt8Array:
        """Return the image (h, w, 3), BGR; `views` are the hulls' pixels in the same order.

        `levels_m` are the water levels of the moment and of the session: the land is lit once for
        all images of a session, and no image may depend on which of them came first.
        """
        water_level_m, session_level_m = levels_m
        still = self._still(scene, light, session_level_m)
        canvas = still.sky.copy()
        row = scene.horizon_row
        water = self._water(scene, light, water_level_m, time_s, hulls, still)
        # A camera that is not quite level sees sky beside water in the same row.
        above = scene.sight[row:, :, 2:] >= 0
        canvas[row:] = np.where(above, canvas[row:], water)
        open_water = still.cover < 0.02
        open_water[:row] = False
        for hull in hulls:
            paint_reflection(canvas, scene.camera, hull.mesh, light, water_level_m, open_water)
        canvas *= 1 - still.cover[..., None]
        canvas += still.land
        for i in sorted(range(len(hulls)), key=lambda i: -hulls[i].distance_m):
            hull, view = hulls[i], views[i]
            if view.visible.any():
                colours = hull_colours(
                    scene.camera, view, light, hull.R_enu_from_vessel, hull.middle_in_enu_m
                )
                paint_hull(canvas, view, colours)
        return _developed(
            canvas, light, np.random.default_rng([self.seed, int(time_s * 10) % 2**31])
        )

    def _still(self, scene: ViewportScene, light: Light, water_level_m: float) -> "_Still":
        """Return what stands still; kept while viewport and light stay the same."""
        kept = self._session
        if kept is None or kept.scene is not scene or kept.light is not light:
            rng = np.random.default_rng([self.seed, 12, len(light.weather.name)])
            drift = (float(rng.random()), float(rng.random()))
            sky = np.zeros_like(scene.sight)
            row = min(scene.horizon_row + len(sky) // 12, len(sky))
            sky[:row] = paint_sky(light, scene.sight[:row], self._clouds, drift)
            land, cover = scene.backdrop.lit(light, water_level_m)
            shore = mirror_of_land(
                scene.camera, scene.backdrop.mesh, light, water_level_m, scene.sight
            )
            kept = _Still(scene, light, sky, land, cover, shore)
            self._session = kept
        return kept

    def _water(
        self,
        scene: ViewportScene,
        light: Light,
        water_level_m: float,
        time_s: float,
        hulls: Sequence[PlacedHull],
        still: "_Still",
    ) -> Shade:
        camera = scene.camera
        view = WaterView.of(
            scene.sight[scene.horizon_row :],
            camera.center_in_world,
            water_level_m,
            float(camera.intrinsics.K[1, 1]),
        )
        foam = np.zeros_like(view.x_m)
        slope = np.zeros_like(view.x_m)
        for hull in hulls:
            if hull.wake is not None:
                self._add_wake(
                    camera, scene.horizon_row, view, hull.wake, water_level_m, foam, slope
                )
        row = scene.horizon_row
        shore = (still.shore[0][row:], still.shore[1][row:])
        return paint_water(view, light, self._textures, time_s, slope, foam, shore)

    def _add_wake(
        self,
        camera: Camera,
        first_row: int,
        view: WaterView,
        wake: Wake,
        water_level_m: float,
        foam: Shade,
        slope: Shade,
    ) -> None:
        outline = np.column_stack([wake.outline(), np.full(4, water_level_m)])
        # An outline that reaches behind the camera is drawn as far as the image goes.
        pixels = camera.project(outline)
        height, width = foam.shape
        if not np.isfinite(pixels).all():
            columns, rows = slice(0, width), slice(0, height)
        else:
            low, high = pixels.min(axis=0) - 2, pixels.max(axis=0) + 3
            columns = slice(*np.clip([low[0], high[0]], 0, width).astype(int))
            rows = slice(*np.clip([low[1] - first_row, high[1] - first_row], 0, height).astype(int))
        x, y = view.x_m[rows, columns], view.y_m[rows, columns]
        if not x.size:
            return
        lace = sampled(self._textures.lace, x / 70, y / 70)
        white, extra = wake.disturb(x, y, lace)
        np.maximum(foam[rows, columns], white, out=foam[rows, columns])
        slope[rows, columns] += extra


def _developed(linear: Shade, light: Light, rng: np.random.Generator) -> UInt8Array:
    """Expose, soften, add sensor noise and gamma: linear light to 8 bits."""
    middle = float(light.horizon.mean()) * 0.55 + float(light.sun.mean()) * 0.25
    linear = linear * np.float32(0.6 / max(0.12, middle))
    # A single sample a pixel leaves steps along edges; a lens would not.
    soft = cv2.GaussianBlur(linear, (0, 0), 0.55 if samples_per_px(linear.shape[1]) > 1 else 0.8)
    shoulder = soft / (1 + np.float32(0.18) * soft) * np.float32(1.12)
    screen = np.sqrt(np.clip(shoulder, 0, 1)) * 255
    grain = rng.standard_normal((256, 256), dtype=np.float32) * np.float32(1.7)
    height, width = screen.shape[:2]
    tiled = np.tile(grain, (height // 256 + 1, width // 256 + 1))[:height, :width]
    developed: UInt8Array = np.clip(screen + tiled[..., None] + 0.5, 0, 255).astype(np.uint8)
    return developed
