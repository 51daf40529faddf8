"""How vessels move: along a smooth route, at a constant speed, or not at all.

A route is a line on the water with rounded corners. A vessel's place follows from the time alone,
so truth at any instant needs no stepping. The heading follows the route with a constant drift
angle, as wind and current make ships crab.
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, exp, radians, sin

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

_STEP_M = 2.0
_STOPPING_M = 150.0


@dataclass(frozen=True, eq=False)
class Route:
    """A smooth line: points (n, 2) in ENU metres, and at each the way covered and the direction.

    Directions are azimuths, radians clockwise from north, without jumps.
    """

    points_m: FloatArray
    covered_m: FloatArray
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
        covered = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        return Route(line, covered, np.unwrap(np.arctan2(step[:, 0], step[:, 1])))

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return float(self.covered_m[-1])

    def at(self, along_m: float) -> tuple[float, float, float]:
        """East and north in metres and azimuth in radians; beyond its ends it runs straight on."""
        inside = min(max(along_m, 0.0), self.length_m)
        after = int(np.searchsorted(self.covered_m, inside, side="right"))
        i = min(max(after, 1), len(self.covered_m) - 1)
        low, high = self.covered_m[i - 1], self.covered_m[i]
        share = float((inside - low) / (high - low))
        east, north = self.points_m[i - 1] + share * (self.points_m[i] - self.points_m[i - 1])
        turned = self.azimuths_rad[i] - self.azimuths_rad[i - 1]
        azimuth = float(self.azimuths_rad[i - 1] + share * turned)
        beyond = along_m - inside
        return float(east) + beyond * sin(azimuth), float(north) + beyond * cos(azimuth), azimuth


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

    Near the ends of the route it gathers way and comes to rest. `drift_deg` is heading minus
    course. Speed 0 is a moored vessel.
    """

    route: Route
    speed_m_s: float
    time_s: float
    along_m: float
    drift_deg: float = 0.0

    def _covered(self, time_s: float) -> tuple[float, float]:
        """Metres along the route, and speed."""
        along = self.along_m + self.speed_m_s * (time_s - self.time_s)
        end = self.route.length_m
        if self.speed_m_s == 0:
            return along, 0.0
        if along > end - _STOPPING_M:
            left = exp(-(along - end + _STOPPING_M) / _STOPPING_M)
            return end - _STOPPING_M * left, self.speed_m_s * left
        if along < _STOPPING_M:
            gone = exp((along - _STOPPING_M) / _STOPPING_M)
            return _STOPPING_M * gone, self.speed_m_s * gone
        return along, self.speed_m_s

    def at(self, time_s: float) -> Motion:
        """Where the vessel is and how it moves."""
        along, speed = self._covered(time_s)
        east, north, azimuth = self.route.at(along)
        earlier, later = (self.route.at(along + d)[2] for d in (-5.0, 5.0))
        turn = (later - earlier) / 10.0 * speed
        course = degrees(azimuth) % 360
        heading = (course + self.drift_deg) % 360
        return Motion(east, north, heading, course, speed, degrees(turn) * 60)

    def turned_deg(self, time_s: float, over_s: float) -> float:
        """How far the heading is off its mean over the last `over_s` seconds."""
        times = time_s - np.linspace(0.0, over_s, 7)
        azimuths = [self.route.at(self._covered(float(t))[0])[2] for t in times]
        off = azimuths[0] - float(np.mean(azimuths))
        return abs(degrees(atan2(sin(off), cos(off))))


def heading_axes(heading_deg: float, axes: FloatArray) -> FloatArray:
    """Rotation (3, 3) from the vessel frame (x forward, y port, z up) to the world frame.

    `axes` are the rows east, north and up at the vessel's place.
    """
    a = radians(heading_deg)
    forward = sin(a) * axes[0] + cos(a) * axes[1]
    return np.column_stack([forward, np.cross(axes[2], forward), axes[2]])
