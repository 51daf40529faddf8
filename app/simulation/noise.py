"""Seeded textures that repeat without a seam: cloud, grain and waves.

Each texture is random numbers shaped in the frequency domain, so its edges fit and its detail is
known: water needs separate bands of wave length, because a band shorter than a pixel's footprint
must be left out and not turn into flicker.
"""

import cv2
import numpy as np

from app.simulation.mesh import Shade


def cloud_tile(rng: np.random.Generator, size: int = 512, falloff: float = 1.7) -> Shade:
    """Return a repeating texture (size, size) with amplitudes falling as 1 / f^falloff.

    Mean 0, standard deviation 1.
    """
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.rfftfreq(size), indexing="ij"))
    frequency[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.standard_normal((size, size))) * frequency**-falloff
    tile = np.fft.irfft2(spectrum, s=(size, size))
    texture: Shade = ((tile - tile.mean()) / tile.std()).astype(np.float32)
    return texture


def wave_slopes(
    rng: np.random.Generator, waves_per_tile: float, size: int = 256, spread: float = 1.6
) -> Shade:
    """Return slopes (size, size, 2) of a repeating band of waves running mostly along +x.

    The waves have about `waves_per_tile` crests across the tile; `spread` above 0 narrows their
    directions about x. Each slope has the standard deviation that makes the larger one 1.
    """
    fy, fx = np.meshgrid(np.fft.fftfreq(size) * size, np.fft.rfftfreq(size) * size, indexing="ij")
    radius = np.hypot(fx, fy)
    radius[0, 0] = 1.0
    band = np.exp(-((np.log(radius / waves_per_tile) / 0.45) ** 2))
    band *= (np.abs(fx) / radius) ** spread + 0.12
    height = np.fft.rfft2(rng.standard_normal((size, size))) * band
    slopes = [np.fft.irfft2(height * 1j * f, s=(size, size)) for f in (fx, fy)]
    tile = np.stack(slopes, axis=-1)
    slope: Shade = (tile / tile.std(axis=(0, 1)).max()).astype(np.float32)
    return slope


def sampled(tile: Shade, u: Shade, v: Shade) -> Shade:
    """Return a tile's values at positions u, v (rows, columns), counted in tiles, repeating."""
    size = tile.shape[0]
    values = cv2.remap(
        tile,
        ((u - np.floor(u)) * size).astype(np.float32),
        ((v - np.floor(v)) * size).astype(np.float32),
        interpolation=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP,
    )
    return np.asarray(values, dtype=np.float32)
