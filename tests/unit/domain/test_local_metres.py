"""Small displacements on the ellipsoid, against PROJ's geodesics."""

from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from app.domain.local_metres import moved, offset_m

WGS84 = Geod(ellps="WGS84")
latitudes = st.floats(-75, 75)
longitudes = st.floats(-180, 180)
metres = st.floats(-3000, 3000)


@given(latitudes, longitudes, metres, metres)
def test_a_displacement_and_back(lat: float, lon: float, east_m: float, north_m: float) -> None:
    """The offset to a moved place is the displacement, across the date line too."""
    assert offset_m(lat, lon, *moved(lat, lon, east_m, north_m)) == pytest.approx(
        (east_m, north_m), abs=1e-6
    )


@given(latitudes, longitudes, metres, metres)
def test_distances_agree_with_geodesics(
    lat: float, lon: float, east_m: float, north_m: float
) -> None:
    """Within 4 km the place is a geodesic's to 0.2 % of the way, the error of a flat earth."""
    to_lat, to_lon = moved(lat, lon, east_m, north_m)
    _, _, distance_m = WGS84.inv(lon, lat, to_lon, to_lat)
    assert distance_m == pytest.approx(hypot(east_m, north_m), rel=2e-3, abs=1e-3)
