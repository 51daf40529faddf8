"""World frames agree with each other, with PROJ and with the published camera."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.geodesy import EcefFrame, EnuFrame, Geodetic

latitudes = st.floats(-89, 89)
longitudes = st.floats(-180, 180)
heights = st.floats(-100, 9000)


def test_the_published_camera_centre_is_reproduced(shared_dir: Path) -> None:
    """Degrees and geocentric metres of the published camera name the same place."""
    camera = json.loads((shared_dir / "real/bonk/camera.json").read_text())
    place = (camera["center_lat_deg"], camera["center_lon_deg"], camera["center_height_m"])
    center = EcefFrame().position(*place)
    np.testing.assert_allclose(center, camera["center_ecef_m"], atol=1e-6)
    axes = EcefFrame().axes(*place[:2])
    R_cam_from_enu = np.array(camera["R_cam_from_ecef"]) @ axes.T
    np.testing.assert_allclose(R_cam_from_enu, camera["R_cam_from_local_enu"], atol=1e-9)


@given(latitudes, longitudes, heights)
def test_a_place_survives_the_way_there_and_back(lat: float, lon: float, height: float) -> None:
    """Geodetic to metres and back returns the place in both frames."""
    for frame in (EcefFrame(), EnuFrame(Geodetic(53.5, 10.0, 3.0))):
        point = frame.position(lat, lon, height)
        place = frame.geodetic(point)
        again = frame.position(place.lat_deg, place.lon_deg, place.height_m)
        np.testing.assert_allclose(again, point, atol=1e-6)
        assert place.lat_deg == pytest.approx(lat, abs=1e-9)


@given(st.lists(st.tuples(latitudes, longitudes), min_size=1, max_size=4), heights)
def test_many_places_are_what_each_is_alone(
    places: list[tuple[float, float]], height: float
) -> None:
    """Positions and axes of many places at once are PROJ's of one."""
    lat, lon = np.array(places).T
    for frame in (EcefFrame(), EnuFrame(Geodetic(53.5, 10.0, 3.0))):
        positions, axes = frame.places(lat, lon, height)
        alone = [frame.position(*place, height) for place in places]
        np.testing.assert_allclose(positions, alone, atol=1e-6)
        np.testing.assert_allclose(axes, [frame.axes(*place) for place in places], atol=1e-12)


@given(latitudes, longitudes)
def test_axes_point_east_north_and_up(lat: float, lon: float) -> None:
    """The axes are right-handed and follow small steps of longitude, latitude and height."""
    frame = EnuFrame(Geodetic(53.5, 10.0, 0.0))
    axes = frame.axes(lat, lon)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    here = frame.position(lat, lon, 0)
    np.testing.assert_allclose(frame.position(lat, lon, 100) - here, 100 * axes[2], atol=1e-6)
    north = frame.position(lat + 1e-5, lon, 0) - here
    assert north @ axes[1] == pytest.approx(np.linalg.norm(north), rel=1e-6)
    step = 1e-5 if lon < 179 else -1e-5
    east = (frame.position(lat, lon + step, 0) - here) / np.sign(step)
    assert east @ axes[0] == pytest.approx(np.linalg.norm(east), rel=1e-6)


@given(latitudes, longitudes, latitudes, longitudes)
def test_both_frames_keep_distances(lat1: float, lon1: float, lat2: float, lon2: float) -> None:
    """ENU is a rigid copy of ECEF: every distance is the same."""
    ecef, enu = EcefFrame(), EnuFrame(Geodetic(lat1, lon1, 20.0))
    gap = np.linalg.norm(ecef.position(lat1, lon1, 5) - ecef.position(lat2, lon2, 5))
    other = np.linalg.norm(enu.position(lat1, lon1, 5) - enu.position(lat2, lon2, 5))
    assert other == pytest.approx(gap, abs=1e-6)


@pytest.mark.parametrize(
    ("lat", "lon", "height", "field"),
    [(91.0, 0.0, 0.0, "lat_deg"), (0.0, 181.0, 0.0, "lon_deg"), (0.0, 0.0, np.nan, "height_m")],
)
def test_a_place_off_the_earth_is_refused(
    lat: float, lon: float, height: float, field: str
) -> None:
    """AIS's "not available" (91, 181) and missing heights are refused by the field's name."""
    with pytest.raises(ValueError, match=field):
        EcefFrame().position(lat, lon, height)
