"""Routes and passages."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.geodesy import EcefFrame
from app.simulation.motion import Passage, Route, heading_axes

ROUTE = Route.through([(0.0, 0.0), (800.0, 0.0), (800.0, 900.0)], 90.0)


def test_a_route_rounds_its_corners_and_keeps_its_ends() -> None:
    """It starts east, ends north, and never jumps in direction."""
    assert ROUTE.at(0.0)[2] == pytest.approx(np.pi / 2, abs=0.01)
    assert ROUTE.at(ROUTE.length_m)[2] == pytest.approx(0.0, abs=0.01)
    turns = np.abs(np.diff([ROUTE.at(s)[2] for s in np.arange(0, ROUTE.length_m, 2.0)]))
    assert turns.max() < 0.08


@given(st.floats(300.0, 1200.0))
def test_heading_points_where_the_vessel_goes(along_m: float) -> None:
    """Course and speed are those of the change in place."""
    passage = Passage(ROUTE, 4.0, 0.0, along_m)
    before, now, after = (passage.at(t) for t in (-0.5, 0.0, 0.5))
    velocity = np.array([after.east_m - before.east_m, after.north_m - before.north_m])
    assert np.hypot(*velocity) == pytest.approx(now.speed_m_s, rel=0.01)
    course = np.degrees(np.arctan2(*velocity)) % 360
    assert (course - now.course_deg + 180) % 360 - 180 == pytest.approx(0.0, abs=1.0)


def test_a_vessel_comes_to_rest_at_the_end_of_its_route() -> None:
    """It slows down smoothly and never passes the end."""
    passage = Passage(ROUTE, 5.0, 0.0, 0.0)
    speeds = [passage.at(t).speed_m_s for t in range(0, 3600, 5)]
    assert max(speeds) == pytest.approx(5.0)
    assert speeds[-1] < 0.01
    assert passage.at(3600).north_m < 901
    assert np.abs(np.diff(speeds)).max() < 1.0


def test_rate_of_turn_has_the_sign_of_ais() -> None:
    """Turning left (east to north) is negative."""
    halfway = min((s for s in range(600, 1000)), key=lambda s: abs(ROUTE.at(s)[2] - np.pi / 4))
    assert Passage(ROUTE, 4.0, 0.0, float(halfway)).at(0.0).turn_deg_min < -30


@pytest.mark.parametrize(("heading", "forward"), [(0, (0, 1, 0)), (90, (1, 0, 0))])
def test_vessel_axes_are_forward_port_up(heading: float, forward: tuple[int, ...]) -> None:
    """Heading north points x north and y west; heading east points x east and y north."""
    axes = heading_axes(heading, np.eye(3))
    assert axes[:, 0] == pytest.approx(forward, abs=1e-12)
    assert axes[:, 2] == pytest.approx([0, 0, 1])
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_axes_give_the_rotation_of_a_published_label(shared_dir: Path) -> None:
    """A real vessel's heading and place give the rotation that its data set published."""
    folder = shared_dir / "real" / "bonk"
    camera = json.loads((folder / "camera.json").read_text())
    label = json.loads((folder / "label" / "00139255c1d7dd9c.json").read_text())
    vessel, published = label["vessels"][0], label["objects"][0]["position"]
    axes = heading_axes(vessel["heading"], EcefFrame().axes(vessel["lat"], vessel["long"]))
    expected, _ = cv2.Rodrigues(np.array(published["eulerAngles"]))
    assert np.array(camera["R_cam_from_ecef"]) @ axes == pytest.approx(expected, abs=1e-6)
