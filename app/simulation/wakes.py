"""The trace of a moving hull on the water: foam alongside, a churned lane astern, bow waves.

A wake is described in the ship's own axes: the turbulent lane widens slowly and fades over some
ship lengths, and the bow wave's arms open at about 19 degrees whatever the speed (Kelvin).
"""

from dataclasses import dataclass
from math import radians, tan

import numpy as np

from app.domain.arrays import FloatArray
from app.simulation.mesh import Shade

_KELVIN = tan(radians(17.0))


@dataclass(frozen=True, slots=True)
class Wake:
    """A hull under way: middle (x, y) and unit heading (x, y) in ENU, size in m, speed in m/s."""

    middle_m: tuple[float, float]
    heading: tuple[float, float]
    length_m: float
    width_m: float
    speed_m_s: float

    @property
    def reach_m(self) -> float:
        """How far astern the lane can be seen."""
        return 1.5 * self.length_m + 26.0 * self.speed_m_s

    def outline(self) -> FloatArray:
        """Corners (4, 2) in ENU of the water it disturbs."""
        ahead, side = np.array(self.heading), np.array([-self.heading[1], self.heading[0]])
        bow, end = 0.5 * self.length_m + 4, -0.5 * self.length_m - self.reach_m
        half = 0.5 * self.width_m + 0.55 * self.reach_m * _KELVIN
        corners = [(bow, half), (bow, -half), (end, -half), (end, half)]
        return np.array([np.array(self.middle_m) + a * ahead + s * side for a, s in corners])

    def disturb(self, x_m: Shade, y_m: Shade, lace: Shade) -> tuple[Shade, Shade]:
        """Return foam (0 to 1) and extra slope across the wake at water points x, y (h, w).

        `lace` is a texture of mean 0 and deviation 1 that frays the foam.
        """
        dx, dy = x_m - self.middle_m[0], y_m - self.middle_m[1]
        ahead = dx * self.heading[0] + dy * self.heading[1]
        aside = np.abs(dy * self.heading[0] - dx * self.heading[1])
        half_length, half_width = self.length_m / 2, self.width_m / 2
        heft = float(np.clip(self.length_m / 26.0, 0.4, 1.0))
        vigour = np.float32(min(1.0, self.speed_m_s / 5.0) * heft)
        astern = np.maximum(-ahead - half_length, 0)
        lane = half_width * (0.75 + 0.12 * np.sqrt(astern / max(half_width, 1)))
        fade = np.exp(-astern / (0.45 * self.reach_m))
        churned = (
            np.exp(-((aside / lane) ** 4)) * fade * (ahead < -half_length + 0.06 * self.length_m)
        )
        from_bow = np.maximum(half_length - ahead, 0)
        width = 0.5 + 0.035 * from_bow
        arm = (aside - half_width * np.minimum(1, from_bow / (0.3 * self.length_m)) * 1.02
               - np.maximum(0, from_bow - 0.3 * self.length_m) * _KELVIN)  # fmt: skip
        bow_fade = np.exp(-from_bow / (5 + 4.5 * self.speed_m_s))
        bow = np.exp(-((arm / width) ** 2)) * bow_fade * (ahead < half_length + 0.5)
        alongside = np.exp(-((np.maximum(aside - half_width, 0) / 0.9) ** 2))
        alongside *= (np.abs(ahead) < half_length) * 0.5
        frayed = np.clip(0.6 + 0.5 * lace, 0, 1)
        rim = np.exp(-(((aside - 0.9 * lane) / (0.3 * lane)) ** 2)) * fade * (astern > 0)
        near = np.exp(-astern / (0.6 * self.length_m + 8)) * (astern > 0)
        foam = churned * (0.75 + 1.1 * near) + 0.55 * rim + bow * 2.0 + alongside * 1.3
        foam = np.clip(foam, 0, 1.15) * frayed * (0.1 + 0.9 * vigour)
        swell = (
            np.exp(-((arm / (width * 2.5)) ** 2))
            * np.sin(arm / width)
            * np.exp(-from_bow / (0.4 * self.reach_m))
        )
        return foam.astype(np.float32), (0.16 * vigour * swell).astype(np.float32)
