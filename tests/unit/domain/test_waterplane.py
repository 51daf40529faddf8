"""Plane segments stand where AIS says, whichever way the vessel heads."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.geodesy import EcefFrame, EnuFrame, Geodetic
from app.domain.vessel_state import VesselState
from app.domain.waterplane import vessel_axes, water_plane_segment

State = Callable[..., VesselState]


@given(st.floats(-720, 720))
def test_vessel_axes_are_right_handed(heading: float) -> None:
    """Forward, port and up form a right-handed frame for any heading."""
    axes = vessel_axes(np.eye(3), heading)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    np.testing.assert_allclose(axes[2], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("heading", "forward", "port"),
    [(0, [0, 1, 0], [-1, 0, 0]), (90, [1, 0, 0], [0, 1, 0]), (180, [0, -1, 0], [1, 0, 0])],
)
def test_headings_turn_clockwise_from_north(
    heading: float, forward: list[float], port: list[float]
) -> None:
    """Heading 0 is north with port to the west, 90 is east."""
    axes = vessel_axes(np.eye(3), heading)
    np.testing.assert_allclose(axes[:2], [forward, port], atol=1e-12)


def test_corners_go_round_from_bow_port(frame: EnuFrame, vessel: State) -> None:
    """A, B, C, D put bow-port, bow-starboard, stern-starboard, stern-port around the antenna."""
    state = vessel(100, 200, to_bow_m=20, to_stern_m=5, to_port_m=3, to_starboard_m=2)
    corners = water_plane_segment(frame, 0, state).corners_in_world
    # Heading east: forward is +x, port is +y.
    expected = [[120, 203], [120, 198], [95, 198], [95, 203]]
    np.testing.assert_allclose(corners[:, :2], expected, atol=1e-2)


def test_dead_reckoning_follows_the_heading(frame: EnuFrame, vessel: State) -> None:
    """Ten knots for 36 s along the heading are 185.2 m; the reported place is kept beside it."""
    segment = water_plane_segment(frame, 0, vessel(0, 300, speed_kn=10, age_s=36))
    moved = segment.corners_in_world - segment.reported_corners_in_world
    np.testing.assert_allclose(moved, np.tile([185.2, 0, 0], (4, 1)), atol=0.01)


@given(
    lat=st.floats(-80, 80),
    lon=st.floats(-180, 180),
    heading=st.floats(0, 360),
    level=st.floats(-50, 50),
)
def test_the_segment_lies_on_the_water_at_the_antenna(
    lat: float, lon: float, heading: float, level: float
) -> None:
    """All corners lie in the plane through the antenna whose normal is the ellipsoid's."""
    state = VesselState("v", lat, lon, heading, 12, 8, 40, 60, 7, 9)
    for frame in (EcefFrame(), EnuFrame(Geodetic(lat, lon, 0))):
        segment = water_plane_segment(frame, level, state)
        foot = frame.position(lat, lon, level)
        heights = (segment.corners_in_world - foot) @ segment.enu_axes_in_world[2]
        np.testing.assert_allclose(heights, 0, atol=1e-6)
        length = np.linalg.norm(segment.corners_in_world[0] - segment.corners_in_world[3])
        assert length == pytest.approx(100, abs=1e-6)


def test_a_position_that_is_not_available_is_refused(frame: EnuFrame, vessel: State) -> None:
    """Latitude 91 names no place."""
    with pytest.raises(ValueError, match="lat_deg"):
        water_plane_segment(frame, 0, vessel(0, 300, lat_deg=91.0))
