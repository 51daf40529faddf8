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

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.geodesy import WorldFrame
from app.domain.vessel_state import VesselState

M_PER_S_PER_KN = 1852 / 3600


@dataclass(frozen=True, eq=False)
class WaterPlaneSegment:
    """Four corners on the water (4, 3): bow-port, bow-starboard, stern-starboard, stern-port.

    `reported_corners_in_world` stand where the report was sent, `corners_in_world` where dead
    reckoning leads (metres). `vessel_axes_in_world` has the rows x_v, y_v, z_v and
    `enu_axes_in_world` the rows E, N, U at the reported antenna.
    """

    reported_corners_in_world: FloatArray
    corners_in_world: FloatArray
    antenna_in_world: FloatArray
    vessel_axes_in_world: FloatArray
    enu_axes_in_world: FloatArray


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
    """Place a vessel on the water; see `water_plane_segments`."""
    return water_plane_segments(frame, water_level_m, [state])[0]


def water_plane_segments(
    frame: WorldFrame, water_level_m: float, states: Sequence[VesselState]
) -> list[WaterPlaneSegment]:
    """Place vessels on the water at `water_level_m` (ellipsoidal height, metres).

    Paper, equations c1 to c4 and the dead reckoning vector dr. Raises ValueError for a position
    that is not on earth (AIS: latitude 91, longitude 181 mean "not available").
    """
    if not states:
        return []
    numbers = np.array(
        [
            (
                *(state.lat_deg, state.lon_deg, state.heading_deg, state.speed_kn * state.age_s),
                *(state.to_bow_m, state.to_stern_m, state.to_port_m, state.to_starboard_m),
            )
            for state in states
        ]
    )
    lat_deg, lon_deg, heading_deg, knot_s = numbers[:, :4].T
    if not ((np.abs(lat_deg) <= 90) & (np.abs(lon_deg) <= 180)).all():
        raise ValueError("lat_deg must lie between -90 and 90 and lon_deg between -180 and 180")
    antennas, enu_axes = frame.places(lat_deg, lon_deg, water_level_m)
    sin, cos = np.sin(np.radians(heading_deg))[:, None], np.cos(np.radians(heading_deg))[:, None]
    east, north, up = enu_axes[:, 0], enu_axes[:, 1], enu_axes[:, 2]
    forward, port = sin * east + cos * north, sin * north - cos * east
    axes = np.stack([forward, port, up], axis=1)
    bow, stern, left, right = numbers[:, 4:].T
    along = np.stack([bow, bow, -stern, -stern], axis=1)
    aside = np.stack([left, -right, -right, left], axis=1)
    reported = (
        antennas[:, None] + along[..., None] * forward[:, None] + aside[..., None] * (port[:, None])
    )
    travelled = forward * (knot_s * M_PER_S_PER_KN)[:, None]
    return [
        WaterPlaneSegment(*rows)
        for rows in zip(
            *(reported, reported + travelled[:, None], antennas + travelled, axes, enu_axes),
            strict=True,
        )
    ]
