"""Small displacements on the WGS84 ellipsoid: metres east and north to degrees and back.

Dead reckoning moves a vessel by at most a few kilometres. There the two radii of curvature at
the starting point are exact to centimetres, and cost a hundredth of a map projection.
"""

from math import cos, radians, sin, sqrt

_SEMI_MAJOR_M_PER_DEG = radians(6_378_137.0)
_ECCENTRICITY_2 = 6.694379990141316e-3


def moved(lat_deg: float, lon_deg: float, east_m: float, north_m: float) -> tuple[float, float]:
    """Return latitude and longitude, deg, after a displacement; longitude within [-180, 180)."""
    m_per_deg_east, m_per_deg_north = m_per_deg(lat_deg)
    lon = lon_deg + east_m / m_per_deg_east
    return lat_deg + north_m / m_per_deg_north, (lon + 180) % 360 - 180


def offset_m(
    from_lat_deg: float, from_lon_deg: float, to_lat_deg: float, to_lon_deg: float
) -> tuple[float, float]:
    """Return the metres east and north from one place to another, across the date line too."""
    m_per_deg_east, m_per_deg_north = m_per_deg(from_lat_deg)
    lon_difference = (to_lon_deg - from_lon_deg + 180) % 360 - 180
    return lon_difference * m_per_deg_east, (to_lat_deg - from_lat_deg) * m_per_deg_north


def m_per_deg(lat_deg: float) -> tuple[float, float]:
    """Return the metres per degree of longitude and of latitude."""
    lat = radians(lat_deg)
    sin_lat = sin(lat)
    w_2 = 1 - _ECCENTRICITY_2 * sin_lat * sin_lat
    # Of the ellipsoid's two radii here: across the meridian and along it.
    prime_vertical = _SEMI_MAJOR_M_PER_DEG / sqrt(w_2)
    return prime_vertical * max(cos(lat), 1e-12), prime_vertical * (1 - _ECCENTRICITY_2) / w_2
