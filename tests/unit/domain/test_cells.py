"""Cells of the globe's grid."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from app.domain.cells import cell_of, cells_of, cells_of_box

latitudes = st.floats(-90, 90)
longitudes = st.floats(-180, 180)


@given(latitudes, longitudes, st.floats(0, 0.3), st.floats(0, 0.3), st.data())
def test_what_lies_in_a_box_lies_in_its_cells(
    south_deg: float, west_deg: float, height_deg: float, width_deg: float, data: st.DataObject
) -> None:
    """No place of a box is missed, its edges, the poles and the antimeridian included."""
    north_deg, east_deg = min(south_deg + height_deg, 90.0), west_deg + width_deg
    inside = data.draw(st.floats(west_deg, east_deg))
    crosses = east_deg > 180
    cells = cells_of_box(west_deg, south_deg, east_deg - 360 * crosses, north_deg, 100)
    assert cells is not None
    lon_deg = inside - 360 if inside > 180 else inside
    assert cell_of(data.draw(st.floats(south_deg, north_deg)), lon_deg) in cells


def test_a_box_of_too_many_cells_has_none() -> None:
    """A continent is not looked up cell by cell, and a harbour in a handful of them."""
    assert cells_of_box(-10, 40, 10, 60, 400) is None
    harbour = cells_of_box(9.95, 53.52, 10.01, 53.56, 400)
    assert harbour is not None
    assert len(harbour) == len(set(harbour)) == 4


@given(st.lists(st.tuples(latitudes, longitudes), min_size=1))
def test_many_places_have_the_cells_that_each_has(places: list[tuple[float, float]]) -> None:
    """The cells of a column of places are those of the places one by one."""
    lat_deg, lon_deg = np.array(places).T
    assert cells_of(lat_deg, lon_deg).tolist() == [cell_of(*place) for place in places]
