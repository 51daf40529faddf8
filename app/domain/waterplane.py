"""What AIS says a vessel covers of the water: the water-level plane segment.

The paper (Defining water-level plane segment) puts a right-handed vessel frame at the antenna
(x_v forward along the heading, y_v to port, z_v up along the ellipsoid's normal), moves the antenna
straight along x_v for the age of the report (dead reckoning) and spans a rectangle of the reported
dimensions A (to bow), B (to stern), C (to port), D (to starboard) around it. All of it happens in
the world frame with the axes of the reported antenna position, as in the published data.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from typing import NamedTuple

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState

M_PER_S_PER_KN = 1852 / 3600


@dataclass(frozen=True, eq=False)
class WaterPlane:
    """What n vessels cover of the water, as arrays; `WaterPlaneSegment` tells what of each."""

    reported_corners_in_world: FloatArray
    corners_in_world: FloatArray
    antenna_in_world: FloatArray
    vessel_axes_in_world: FloatArray
    enu_axes_in_world: FloatArray

    @property
    def middles_in_world(self) -> FloatArray:
        """The middles (n, 3) between the corners where dead reckoning leads."""
        return np.asarray(self.corners_in_world.sum(axis=1) / 4)

    @classmethod
    def of(cls, segments: Sequence["WaterPlaneSegment"]) -> "WaterPlane":
        """Put segments together: taken out of their plane at once where all are of one."""
        planes = {id(segment.plane): segment.plane for segment in segments}
        if len(planes) != 1:
            return cls(
                np.array([s.reported_corners_in_world for s in segments]).reshape(-1, 4, 3),
                np.array([s.corners_in_world for s in segments]).reshape(-1, 4, 3),
                np.array([s.antenna_in_world for s in segments]).reshape(-1, 3),
                np.array([s.vessel_axes_in_world for s in segments]).reshape(-1, 3, 3),
                np.array([s.enu_axes_in_world for s in segments]).reshape(-1, 3, 3),
            )
        (plane,) = planes.values()
        rows = np.array([segment.row for segment in segments])
        return cls(
            plane.reported_corners_in_world.take(rows, axis=0),
            plane.corners_in_world.take(rows, axis=0),
            plane.antenna_in_world.take(rows, axis=0),
            plane.vessel_axes_in_world.take(rows, axis=0),
            plane.enu_axes_in_world.take(rows, axis=0),
        )


class WaterPlaneSegment(NamedTuple):
    """Four corners on the water (4, 3): bow-port, bow-starboard, stern-starboard, stern-port.

    `reported_corners_in_world` stand where the report was sent, `corners_in_world` where dead
    reckoning leads (metres). `vessel_axes_in_world` has the rows x_v, y_v, z_v and
    `enu_axes_in_world` the rows E, N, U at the reported antenna. All are those of a `row` of a
    `plane`.
    """

    plane: WaterPlane
    row: int

    @property
    def reported_corners_in_world(self) -> FloatArray:
        """Corners (4, 3) where the report was sent."""
        return np.asarray(self.plane.reported_corners_in_world[self.row])

    @property
    def corners_in_world(self) -> FloatArray:
        """Corners (4, 3) where dead reckoning leads."""
        return np.asarray(self.plane.corners_in_world[self.row])

    @property
    def antenna_in_world(self) -> FloatArray:
        """The antenna (3,) where dead reckoning leads."""
        return np.asarray(self.plane.antenna_in_world[self.row])

    @property
    def vessel_axes_in_world(self) -> FloatArray:
        """Forward, port and up (3, 3)."""
        return np.asarray(self.plane.vessel_axes_in_world[self.row])

    @property
    def enu_axes_in_world(self) -> FloatArray:
        """East, north and up (3, 3) at the reported antenna."""
        return np.asarray(self.plane.enu_axes_in_world[self.row])


def vessel_axes(enu_axes_in_world: FloatArray, heading_deg: float) -> FloatArray:
    """Rows x_v, y_v, z_v (3, 3) in the world frame of a vessel heading clockwise from north."""
    east, north, up = enu_axes_in_world
    heading = radians(heading_deg)
    forward = sin(heading) * east + cos(heading) * north
    port = sin(heading) * north - cos(heading) * east  # up x forward
    return np.array([forward, port, up])


def water_plane_segment(
    frame: WorldFrame, water_level_m: float, state: VesselState
) -> WaterPlaneSegment:
    """Place a vessel on the water; see `water_plane`."""
    return WaterPlaneSegment(water_plane(frame, water_level_m, [state]), 0)


def water_plane(
    frame: WorldFrame, water_level_m: float | FloatArray, states: Sequence[VesselState]
) -> WaterPlane:
    """Place vessels on the water at `water_level_m` (ellipsoidal height, metres; one or n).

    Paper, equations c1 to c4 and the dead reckoning vector dr. Raises ValueError for a position
    that is not on earth (AIS: latitude 91, longitude 181 mean "not available").
    """
    numbers = np.array(
        [
            (
                *(state.lat_deg, state.lon_deg, state.heading_deg, state.speed_kn * state.age_s),
                *(state.to_bow_m, state.to_stern_m, state.to_port_m, state.to_starboard_m),
            )
            for state in states
        ]
    ).reshape(-1, 8)
    lat_deg, lon_deg, heading_deg, knot_s = numbers[:, :4].T
    if not ((np.abs(lat_deg) <= 90) & (np.abs(lon_deg) <= 180)).all():
        raise ValueError("lat_deg must lie between -90 and 90 and lon_deg between -180 and 180")
    antennas, enu_axes = frame.places(lat_deg, lon_deg, water_level_m)
    heading = np.radians(heading_deg)[:, None]
    sin, cos = np.sin(heading), np.cos(heading)
    east, north, up = enu_axes[:, 0], enu_axes[:, 1], enu_axes[:, 2]
    forward, port = sin * east + cos * north, sin * north - cos * east
    bow, stern, left, right = numbers[:, 4:].T
    along = np.array([bow, bow, -stern, -stern]).T
    aside = np.array([left, -right, -right, left]).T
    reported = (
        antennas[:, None] + along[..., None] * forward[:, None] + aside[..., None] * (port[:, None])
    )
    travelled = forward * (knot_s * M_PER_S_PER_KN)[:, None]
    return WaterPlane(
        reported_corners_in_world=reported,
        corners_in_world=reported + travelled[:, None],
        antenna_in_world=antennas + travelled,
        vessel_axes_in_world=np.concatenate([forward, port, up], axis=1).reshape(-1, 3, 3),
        enu_axes_in_world=enu_axes,
    )
