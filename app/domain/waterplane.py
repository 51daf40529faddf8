"""What AIS says a vessel covers of the water: the water-level plane segment.

The paper (Defining water-level plane segment) puts a right-handed vessel frame at the antenna
(x_v forward along the heading, y_v to port, z_v up along the ellipsoid's normal), moves the antenna
straight along x_v for the age of the report (dead reckoning) and spans a rectangle of the reported
dimensions A (to bow), B (to stern), C (to port), D (to starboard) around it. All of it happens in
the world frame with the axes of the reported antenna position, as in the published data.
"""

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
    """Place a vessel on the water at `water_level_m` (ellipsoidal height, metres).

    Paper, equations c1 to c4 and the dead reckoning vector dr. Raises ValueError for a position
    that is not on earth (AIS: latitude 91, longitude 181 mean "not available").
    """
    antenna = frame.position(state.lat_deg, state.lon_deg, water_level_m)
    enu_axes = frame.axes(state.lat_deg, state.lon_deg)
    axes = vessel_axes(enu_axes, state.heading_deg)
    forward, port, _ = axes
    offsets = np.array(
        [
            state.to_bow_m * forward + state.to_port_m * port,
            state.to_bow_m * forward - state.to_starboard_m * port,
            -state.to_stern_m * forward - state.to_starboard_m * port,
            -state.to_stern_m * forward + state.to_port_m * port,
        ]
    )
    travelled = forward * (state.speed_kn * M_PER_S_PER_KN * state.age_s)
    return WaterPlaneSegment(
        reported_corners_in_world=antenna + offsets,
        corners_in_world=antenna + travelled + offsets,
        antenna_in_world=antenna + travelled,
        vessel_axes_in_world=axes,
        enu_axes_in_world=enu_axes,
    )
