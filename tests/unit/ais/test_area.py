"""Areas: the box around a place holds all that is near, wherever on the globe."""

import math

from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from app.ais.area import Area

WGS84 = Geod(ellps="WGS84")


@given(
    st.floats(-89.0, 89.0),
    st.floats(-180.0, 180.0),
    st.floats(0.0, 360.0),
    st.floats(1.0, 50_000.0),
)
def test_all_within_the_radius_is_in_the_box(
    lat_deg: float, lon_deg: float, azimuth_deg: float, radius_m: float
) -> None:
    """A point at any bearing just within the radius lies in the box, also across 180 degrees."""
    area = Area.around(lat_deg, lon_deg, radius_m)
    lon, lat, _ = WGS84.fwd(lon_deg, lat_deg, azimuth_deg, 0.99 * radius_m)
    assert area.south_deg <= lat <= area.north_deg
    if area.crosses_antimeridian:
        assert lon >= area.west_deg or lon <= area.east_deg
    else:
        assert area.west_deg <= lon <= area.east_deg or math.isclose(abs(lon), 180.0)


def test_near_a_pole_all_longitudes_are_near() -> None:
    """A box that holds a pole spans the whole circle and never leaves the globe."""
    assert Area.around(89.99, 30.0, 5_000.0) == Area(
        -180.0, Area.around(89.99, 30.0, 5_000.0).south_deg, 180.0, 90.0
    )
