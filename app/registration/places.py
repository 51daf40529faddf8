"""Where landmarks may be: near their site, and when two places are the same.

A landmark with latitude and longitude exchanged lies thousands of kilometres away; the solver would
only say that nothing agrees.
"""

from app.domain.local_metres import offset_m
from app.tables.registration import Landmark
from app.tables.sites import Site

FARTHEST_KM = 100.0
SAME_DEG = 1e-9  # a tenth of a millimetre
SAME_M = 1e-4

Place = tuple[float, float, float]  # latitude and longitude (deg), ellipsoidal height (m)


def is_there(landmark: Landmark, place: Place) -> bool:
    """Whether a landmark is at a place already."""
    return (
        abs(landmark.lat_deg - place[0]) <= SAME_DEG
        and abs(landmark.lon_deg - place[1]) <= SAME_DEG
        and abs(landmark.height_m - place[2]) <= SAME_M
    )


def require_near(site: Site, place: Place) -> None:
    """Refuse a place that no camera of the site can see. Raises ValueError with the fix."""
    lat_deg, lon_deg, _ = place
    away_km = _away_km(site, lat_deg, lon_deg)
    if away_km <= FARTHEST_KM:
        return
    exchanged = abs(lon_deg) <= 90 and _away_km(site, lon_deg, lat_deg) <= FARTHEST_KM
    fix = "latitude and longitude are exchanged" if exchanged else "check the digits and letters"
    raise ValueError(
        f"(lat_deg, lon_deg) = ({lat_deg:.5f}, {lon_deg:.5f}) lies {away_km:,.0f} km from the "
        f"site; {fix}"
    )


def _away_km(site: Site, lat_deg: float, lon_deg: float) -> float:
    east_m, north_m = offset_m(site.origin_lat_deg, site.origin_lon_deg, lat_deg, lon_deg)
    return float((east_m**2 + north_m**2) ** 0.5) / 1000
