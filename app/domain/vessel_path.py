"""A vessel's way over a while, for asking where it was at very many moments at once.

Tracks (see `tracks`) place one vessel at one moment with care. Trying hundreds of clock offsets on
hundreds of images needs the same in bulk and somewhat coarser: reports are joined by straight
lines, and the rectangle that the hull covers of a picture is found for all moments in one go.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.arrays import BoolArray, FloatArray
from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame
from app.domain.plausibility import clock_is_off
from app.domain.vessel_statics import statics_at

LONGEST_GAP_S = 200.0  # between two reports that one movement is drawn through
_LONGEST_REST_S = 1200.0  # moored ships report every 3 min, and not all reports are heard
_AT_REST_M = 30.0
_LEAST_COURSE_KN = 1.0


@dataclass(frozen=True, eq=False)
class VesselPath:
    """Antenna places (n, 3) in the world at rising moments (n,), headings, and hull distances.

    Places lie at ellipsoidal height `level_m`. `hull_m` (4, 2) are the corners forward and to port
    of the antenna: bow-port, bow-starboard, stern-starboard, stern-port. `is_contradicted`: the
    seconds in most of its messages contradict the times at which they were received.
    """

    identifier: str
    times_s: FloatArray
    antenna_in_world: FloatArray
    headings_deg: FloatArray
    hull_m: FloatArray
    level_m: float
    is_contradicted: bool = False

    def rectangles_px(
        self, camera: Camera, water_level_m: FloatArray | float, moments_s: FloatArray
    ) -> FloatArray:
        """Return the enclosing rectangles (n, 4) x1 y1 x2 y2 of the hull's water-level plane.

        `water_level_m` is one or (n,). NaN rows where the vessel is not known at the moment, has
        no projection, or lies beside the picture.
        """
        rectangles = np.full((len(moments_s), 4), np.nan)
        rows = np.flatnonzero(self._is_known(moments_s))
        level_m = np.broadcast_to(water_level_m, moments_s.shape)
        antenna = self._antenna_at(moments_s[rows], level_m[rows])
        is_near = camera.may_show(antenna, float(np.linalg.norm(self.hull_m, axis=1).max()))
        rows, antenna = rows[is_near], antenna[is_near]
        heading = np.radians(np.interp(moments_s[rows], self.times_s, self.headings_deg))
        forward = np.column_stack([np.sin(heading), np.cos(heading)])
        port = np.column_stack([-np.cos(heading), np.sin(heading)])
        corners = np.repeat(antenna[:, None, :], 4, axis=1)
        corners[:, :, :2] += (
            self.hull_m[None, :, :1] * forward[:, None, :]
            + self.hull_m[None, :, 1:] * port[:, None, :]
        )
        pixels = camera.project(corners.reshape(-1, 3)).reshape(-1, 4, 2)
        rectangles[rows] = np.hstack([pixels.min(axis=1), pixels.max(axis=1)])
        return rectangles

    def px_per_m(
        self, camera: Camera, water_level_m: FloatArray | float, moments_s: FloatArray
    ) -> FloatArray:
        """Return how many pixels a metre across the line of sight is where the vessel is, (n,)."""
        level_m = np.broadcast_to(water_level_m, moments_s.shape)
        return camera.px_per_m(self._antenna_at(moments_s, level_m))

    def _antenna_at(self, moments_s: FloatArray, level_m: FloatArray) -> FloatArray:
        antenna = np.column_stack(
            [np.interp(moments_s, self.times_s, axis) for axis in self.antenna_in_world.T]
        )
        antenna[:, 2] += level_m - self.level_m
        return antenna

    def _is_known(self, moments_s: FloatArray) -> BoolArray:
        after = np.searchsorted(self.times_s, moments_s)
        inside = (after > 0) & (after < len(self.times_s))
        known: BoolArray = inside & self._is_bridged[np.clip(after, 1, len(self.times_s) - 1) - 1]
        return known

    @cached_property
    def _is_bridged(self) -> BoolArray:
        """Between which reports (n - 1,) a movement is drawn: none, if the vessel lay still."""
        gap_s = np.diff(self.times_s)
        way_m = np.linalg.norm(np.diff(self.antenna_in_world, axis=0), axis=1)
        bridged: BoolArray = (gap_s <= LONGEST_GAP_S) | (
            (gap_s <= _LONGEST_REST_S) & (way_m <= _AT_REST_M)
        )
        return bridged


def vessel_path(
    reports: Sequence[PositionReport],
    statics: Sequence[StaticReport],
    frame: EnuFrame,
    level_m: float,
    epoch: datetime,
) -> VesselPath | None:
    """Join one vessel's reports; times are seconds after `epoch`.

    Corners are laid out east and north of the site, whose ENU axes are those of any place within
    some kilometres. None for a vessel of unknown size or heading, or heard less than twice.
    """
    by_time = {report.fix_time: report for report in reports}
    ordered = [by_time[moment] for moment in sorted(by_time)]
    headed = [
        (report, heading) for report in ordered if (heading := _heading_deg(report)) is not None
    ]
    if len(headed) < 2:
        return None
    hull = statics_at(statics, headed[0][0].fix_time).hull
    if hull is None:
        return None
    bow, stern, port, starboard = (
        hull.to_bow_m,
        hull.to_stern_m,
        hull.to_port_m,
        hull.to_starboard_m,
    )
    return VesselPath(
        identifier=str(headed[0][0].mmsi),
        times_s=np.array([(report.fix_time - epoch).total_seconds() for report, _ in headed]),
        antenna_in_world=np.array(
            [frame.position(report.lat_deg, report.lon_deg, level_m) for report, _ in headed]
        ),
        headings_deg=np.unwrap([heading for _, heading in headed], period=360.0),
        hull_m=np.array([(bow, port), (bow, -starboard), (-stern, -starboard), (-stern, port)]),
        level_m=level_m,
        is_contradicted=clock_is_off(report.fix_time_source for report in ordered),
    )


def _heading_deg(report: PositionReport) -> float | None:
    if report.heading_deg is not None:
        return report.heading_deg
    moves = report.sog_kn is not None and report.sog_kn >= _LEAST_COURSE_KN
    return report.cog_deg if moves else None
