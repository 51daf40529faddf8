"""Water: waves in bands of length, each left out where a pixel is coarser than it.

From a high quay most of what water shows is the sky, mirrored in slopes. Waves tilted towards the
camera mirror higher and darker sky and let the brown of the river through; waves tilted away
mirror the pale horizon. Bands too short to be seen singly turn into roughness, which lifts the
mean mirrored direction and spreads the sun's glitter.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sin, sqrt

import numpy as np

from app.domain.arrays import FloatArray
from app.simulation.light import Light
from app.simulation.mesh import Shade
from app.simulation.noise import cloud_tile, sampled, wave_slopes
from app.simulation.sky import sky_colour

_BANDS_M = (0.45, 1.2, 3.0, 7.5, 18.0, 45.0)
_SHARES = (0.62, 0.56, 0.42, 0.26, 0.12, 0.06)
_CRESTS = 27.0


@dataclass(frozen=True, eq=False)
class WaterTextures:
    """Repeating textures of one harbour: slopes by band, foam and gusts."""

    bands: tuple[Shade, ...]
    lace: Shade
    gusts: Shade

    @staticmethod
    def make(rng: np.random.Generator) -> "WaterTextures":
        """Draw the textures."""
        bands = tuple(wave_slopes(rng, _CRESTS) for _ in _BANDS_M)
        return WaterTextures(bands, cloud_tile(rng, 512, 0.75), cloud_tile(rng, 256, 1.6))


@dataclass(frozen=True, eq=False)
class WaterView:
    """Where pixels meet the water: points x, y (h, w) in ENU, distance, and footprint in metres.

    `sight` (h, w, 3) are unit directions; `footprint_m` is a pixel's size along the line of sight.
    """

    x_m: Shade
    y_m: Shade
    sight: Shade
    distance_m: Shade
    footprint_m: Shade

    @staticmethod
    def of(sight: Shade, center_in_enu: FloatArray, level_m: float, focal_px: float) -> "WaterView":
        """Meet the plane at `level_m`; rows must look downwards."""
        height = np.float32(center_in_enu[2] - level_m)
        distance = height / np.maximum(-sight[..., 2], np.float32(2e-3))
        x = sight[..., 0] * distance + np.float32(center_in_enu[0])
        y = sight[..., 1] * distance + np.float32(center_in_enu[1])
        return WaterView(
            x, y, sight, distance, distance * distance / (height * np.float32(focal_px))
        )


def paint_water(
    view: WaterView,
    light: Light,
    textures: WaterTextures,
    time_s: float,
    extra_slope: Shade | None,
    foam: Shade | None,
    shore: tuple[Shade, Shade],
) -> Shade:
    """Return linear colours (h, w, 3).

    `shore` is the mirror image of the land: colour times coverage (h, w, 3), coverage (h, w).
    """
    slope_x, slope_y, rough = _slopes(view, light, textures, time_s)
    if extra_slope is not None:
        slope_y = slope_y + extra_slope
    sight = view.sight
    length = 1 / np.sqrt(1 + slope_x**2 + slope_y**2)
    facing = (sight[..., 2] - sight[..., 0] * slope_x - sight[..., 1] * slope_y) * length
    mirrored_up = sight[..., 2] - 2 * facing * length
    cosine = np.clip(np.sqrt(np.maximum(-facing, 0) ** 2 + (1.1 * rough) ** 2), 0, 1)
    fresnel = (0.02 + 0.98 * (1 - cosine) ** 5)[..., None]
    lifted = np.clip(np.abs(mirrored_up) + 1.3 * rough, 0.01, 1)
    mirrored = sky_colour(light, lifted)
    mirrored = mirrored * (1 - shore[1][..., None]) + shore[0]
    body = _body_colour(light)
    colour = mirrored * fresnel + body * (1 - fresnel)
    colour += (
        _glitter(view, light, (slope_x, slope_y, length, facing), rough)[..., None] * light.sun
    )
    if foam is not None:
        white = light.sun * 0.45 + light.horizon * 0.62
        colour += foam[..., None] * (white - colour) * np.float32(0.9)
    clear = np.exp(-view.distance_m / light.weather.visibility_m)[..., None]
    painted: Shade = colour * clear + light.haze * (1 - clear)
    return painted


def _slopes(
    view: WaterView, light: Light, textures: WaterTextures, time_s: float
) -> tuple[Shade, Shade, Shade]:
    """Return slopes along ENU x and y, and the deviation of those too fine to be seen."""
    wind = light.weather.wind_m_s
    strength = 0.5 * sqrt(0.003 + 0.00512 * wind)
    to = radians(light.weather.wind_to_deg)
    along, across = (sin(to), cos(to)), (cos(to), -sin(to))
    down = view.x_m * along[0] + view.y_m * along[1]
    side = view.x_m * across[0] + view.y_m * across[1]
    gusts = 1 + 0.22 * sampled(textures.gusts, down / 900, side / 420)
    slope_d = np.zeros_like(view.x_m)
    slope_s = np.zeros_like(view.x_m)
    hidden = np.zeros_like(view.x_m)
    for wave_m, share, tile in zip(_BANDS_M, _SHARES, textures.bands, strict=True):
        shown = np.clip(1.5 - 0.55 * view.footprint_m / wave_m, 0, 1)
        amplitude = strength * share * shown * gusts
        size = wave_m * _CRESTS
        travel = (time_s * sqrt(9.81 * wave_m / (2 * pi)) / size) % 1.0
        slopes = sampled(tile, down / size - travel, side / size + 0.37 * wave_m)
        slope_d += amplitude * slopes[..., 0]
        slope_s += amplitude * slopes[..., 1]
        hidden += (strength * share) ** 2 * (1 - shown**2)
    slope_x = slope_d * along[0] + slope_s * across[0]
    slope_y = slope_d * along[1] + slope_s * across[1]
    return slope_x, slope_y, np.sqrt(hidden)


def _body_colour(light: Light) -> Shade:
    """Colour of silty river water lit from above."""
    silt = np.array([0.105, 0.130, 0.125], dtype=np.float32)
    high = max(0.0, float(light.to_sun_in_enu[2]))
    body: Shade = silt * (light.sun * high + light.zenith * 0.9 + 0.1)
    return body


def _glitter(
    view: WaterView,
    light: Light,
    facet: tuple[Shade, Shade, Shade, Shade],
    rough: Shade,
) -> Shade:
    """Return the sun mirrored in the waves (h, w)."""
    slope_x, slope_y, length, facing = facet
    sun = light.to_sun_in_enu.astype(np.float32)
    sun_on_facet = (sun[2] - sun[0] * slope_x - sun[1] * slope_y) * length
    towards = view.sight @ sun - 2 * facing * sun_on_facet
    spread = 0.0016 + 1.6 * rough**2
    peak = 0.9 * (0.0016 / spread) ** np.float32(0.35)
    shine: Shade = np.exp(np.maximum(-(1 - towards) / spread, -60)) * peak
    return shine
