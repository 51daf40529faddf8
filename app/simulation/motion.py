"""How vessels move: along a smooth route, at a constant speed, or not at all.

A route is a line on the water with rounded corners. A vessel's place follows from the time alone,
so truth at any instant needs no stepping. The heading follows the route with a constant drift
angle, as wind and current make ships crab.
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, radians, sin

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

_STEP_M = 2.0


@dataclass(frozen=True, eq=False)
class Route:
    """A smooth line: points (n, 2) in ENU metres every `_STEP_M`, and unwrapped directions (n,).

    Directions are azimuths, radians clockwise from north.
    """

    points_m: FloatArray
    azimuths_rad: FloatArray

    @staticmethod
    def through(corners: npt.ArrayLike, rounding_m: float) -> "Route":
        """Run straight from corner to corner (n, 2), rounded over about `rounding_m`."""
        bends = np.asarray(corners, dtype=np.float64)
        legs = np.hypot(*np.diff(bends, axis=0).T)
        ends = np.concatenate([[0.0], np.cumsum(legs)])
        along = np.arange(0.0, ends[-1], _STEP_M)
        line = np.column_stack([np.interp(along, ends, bends[:, k]) for k in range(2)])
        # Two passes of a moving mean turn a corner into a curve with a steady onset.
        half = max(1, int(rounding_m / _STEP_M / 2))
        for _ in range(2):
            padded = np.vstack([
                line[0] + (line[1] - line[0]) * np.arange(-half, 0)[:, None],
                line,
                line[-1] + (line[-1] - line[-2]) * np.arange(1, half + 1)[:, None],
            ])  # fmt: skip
            total = np.cumsum(np.vstack([np.zeros(2), padded]), axis=0)
            width = 2 * half + 1
            line = (total[width:] - total[:-width]) / width
        step = np.gradient(line, axis=0)
        return Route(line, np.unwrap(np.arctan2(step[:, 0], step[:, 1])))

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return float(self._ends()[-1])

    def _ends(self) -> FloatArray:
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points_m, axis=0).T))])

    def at(self, along_m: float) -> tuple[float, float, float]:
        """East and north in metres and azimuth in radians; beyond its ends it runs straight on."""
        ends = self._ends()
        inside = min(max(along_m, 0.0), float(ends[-1]))
        east, north = (float(np.interp(inside, ends, self.points_m[:, k])) for k in range(2))
        azimuth = float(np.interp(inside, ends, self.azimuths_rad))
        beyond = along_m - inside
        return east + beyond * sin(azimuth), north + beyond * cos(azimuth), azimuth


@dataclass(frozen=True, slots=True)
class Motion:
    """State of the middle of a hull: ENU metres, degrees clockwise from north, m/s, deg/min."""

    east_m: float
    north_m: float
    heading_deg: float
    course_deg: float
    speed_m_s: float
    turn_deg_min: float


@dataclass(frozen=True, eq=False)
class Passage:
    """A vessel's way: at `along_m` of its route at time `time_s`, going `speed_m_s`.

    `drift_deg` is heading minus course. Speed 0 is a moored vessel.
    """

    route: Route
    speed_m_s: float
    time_s: float
    along_m: float
    drift_deg: float = 0.0

    def at(self, time_s: float) -> Motion:
        """Where the vessel is and how it moves."""
        along = self.along_m + self.speed_m_s * (time_s - self.time_s)
        east, north, azimuth = self.route.at(along)
        earlier, later = (self.route.at(along + d)[2] for d in (-5.0, 5.0))
        turn = (later - earlier) / 10.0 * self.speed_m_s
        course = degrees(azimuth) % 360
        heading = (course + self.drift_deg) % 360
        return Motion(east, north, heading, course, self.speed_m_s, degrees(turn) * 60)

    def turned_deg(self, time_s: float, over_s: float) -> float:
        """How far the heading is off its mean over the last `over_s` seconds."""
        times = time_s - np.linspace(0.0, over_s, 7)
        azimuths = [
            self.route.at(self.along_m + self.speed_m_s * (t - self.time_s))[2] for t in times
        ]
        off = azimuths[0] - float(np.mean(azimuths))
        return abs(degrees(atan2(sin(off), cos(off))))


def heading_axes(heading_deg: float, axes: FloatArray) -> FloatArray:
    """Rotation (3, 3) from the vessel frame (x forward, y port, z up) to the world frame.

    `axes` are the rows east, north and up at the vessel's place.
    """
    a = radians(heading_deg)
    forward = sin(a) * axes[0] + cos(a) * axes[1]
    return np.column_stack([forward, np.cross(axes[2], forward), axes[2]])
