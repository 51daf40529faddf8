"""The sky behind the harbour: a gradient, clouds on a far ceiling, the glow about the sun."""

import numpy as np

from app.simulation.light import Light
from app.simulation.mesh import Shade
from app.simulation.noise import sampled

_CEILING_M = 1800.0


def sky_colour(light: Light, elevation_sine: Shade) -> Shade:
    """Return the clear gradient (..., 3) for directions whose sine of elevation is given."""
    up = np.clip(elevation_sine, 0, 1)[..., None]
    share = 1 - np.exp(-up / np.float32(0.13))
    gradient: Shade = light.horizon * (1 - share) + light.zenith * share
    return gradient


def paint_sky(light: Light, sight: Shade, clouds: Shade, drift: tuple[float, float]) -> Shade:
    """Return linear colours (h, w, 3) along unit directions (h, w, 3) at or above the horizon.

    `clouds` is a repeating texture of mean 0 and deviation 1; `drift` moves it, in tiles.
    """
    up = np.maximum(sight[..., 2], np.float32(0.003))
    reach = _CEILING_M / up
    scale = np.float32(1 / 16000.0)
    u, v = sight[..., 0] * reach * scale + drift[0], sight[..., 1] * reach * scale + drift[1]
    texture = 0.7 * sampled(clouds, u, v) + 0.3 * sampled(clouds, u * 3.7, v * 3.7)
    cover = light.weather.cloud_cover
    threshold = 1.5 - 3.0 * cover
    density = np.clip((texture - threshold) * 0.9 + 0.25, 0, 1)[..., None]
    density *= np.clip(up * 22, 0.25, 1)[..., None]
    base = sky_colour(light, sight[..., 2])
    bright = light.sun * 0.45 + light.horizon * 0.75
    shade = light.zenith * 0.25 + light.horizon * 0.55
    relief = np.clip(0.55 - 0.35 * texture, 0, 1)[..., None]
    cloud = bright * relief + shade * (1 - relief)
    towards = np.clip(sight @ light.to_sun_in_enu.astype(np.float32), 0, 1)[..., None]
    glow = (towards**24 * 0.5 + towards**300 * 2.0) * light.sun
    sky = base * (1 - density * 0.85) + cloud * density * 0.85 + glow * (1 - 0.6 * density)
    far = np.exp(-np.clip(sight[..., 2:], 0, None) / np.float32(0.035))
    painted: Shade = sky * (1 - 0.8 * far) + light.haze * 0.8 * far
    return painted
