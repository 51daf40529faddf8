"""Shapes of ships."""

import numpy as np
import pytest

from app.simulation.ship_plans import Fleet
from app.simulation.ships import AIS_SHIP_TYPE, Ship, ShipType, build_ship


@pytest.fixture(params=[(t, f) for t in ShipType for f in Fleet], ids=lambda p: f"{p[0]}-{p[1]}")
def ship(request: pytest.FixtureRequest) -> Ship:
    """One ship of each type and fleet."""
    ship_type, fleet = request.param
    return build_ship(ship_type, np.random.default_rng(3), fleet)


def test_a_ship_is_as_long_and_wide_as_it_says(ship: Ship) -> None:
    """The mesh fills its box exactly: whole metres, centred, from the waterline to the top."""
    low, high = ship.mesh.vertices.min(axis=0), ship.mesh.vertices.max(axis=0)
    assert low == pytest.approx([-ship.length_m / 2, -ship.width_m / 2, 0.0], abs=1e-9)
    assert high == pytest.approx([ship.length_m / 2, ship.width_m / 2, ship.height_m], abs=1e-9)
    assert ship.length_m == pytest.approx(round(ship.length_m), abs=1e-9)
    assert ship.width_m == pytest.approx(round(ship.width_m), abs=1e-9)


def test_a_hull_is_no_box(ship: Ship) -> None:
    """The bow is narrower than the hull amidships."""
    vertices = ship.mesh.vertices
    reach = vertices[:, 0].max() - 0.01 * ship.length_m
    at_bow = np.abs(vertices[vertices[:, 0] > reach, 1]).max()
    assert at_bow < 0.85 * ship.width_m / 2


def test_faces_are_planar_and_have_area(ship: Ship) -> None:
    """No face is twisted by more than a few centimetres: flat shading and depth rely on it."""
    mesh = ship.mesh
    corners = mesh.vertices[mesh.faces]
    off = np.abs(((corners - corners.mean(axis=1, keepdims=True)) * mesh.normals()[:, None]).sum(2))
    assert off.max() < 0.6
    assert np.median(off) < 0.01


def test_the_same_seed_builds_the_same_ship() -> None:
    """Ships are a function of type, fleet and generator state."""
    one, two = (build_ship(ShipType.FERRY, np.random.default_rng(9)) for _ in range(2))
    assert np.array_equal(one.mesh.vertices, two.mesh.vertices)
    assert np.array_equal(one.mesh.colours, two.mesh.colours)


def test_the_fleets_differ() -> None:
    """From the same draws the judging fleet has other hulls than the training fleet."""
    for ship_type in ShipType:
        one, two = (build_ship(ship_type, np.random.default_rng(9), fleet) for fleet in Fleet)
        same = one.mesh.vertices.shape == two.mesh.vertices.shape
        assert not (same and np.array_equal(one.mesh.vertices, two.mesh.vertices)), ship_type


def test_a_convoy_has_parts_that_fill_its_length() -> None:
    """Barges and pusher lie end to end."""
    convoy = build_ship(ShipType.CONVOY, np.random.default_rng(1))
    assert len(convoy.parts) >= 2
    assert sum(part.length_m for part in convoy.parts) == pytest.approx(convoy.length_m)


def test_every_type_has_an_ais_ship_type() -> None:
    """Type 5 messages need a number for each kind of ship."""
    assert set(AIS_SHIP_TYPE) == set(ShipType)
