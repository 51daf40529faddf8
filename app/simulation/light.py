"""Sun, sky and weather: the light in which an image is taken.

The sun stands where the almanac puts it for the place and the minute (to a degree or so, enough
for shadows); its colour reddens as it sinks. Weather says how much of it gets through the clouds,
how far one can see and how rough the water is. Colours are linear light, blue first.
"""

from dataclasses import dataclass
from datetime import datetime
from math import asin, atan2, cos, degrees, pi, radians, sin

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.geodesy import Geodetic
from app.simulation.mesh import Shade


@dataclass(frozen=True, slots=True)
class Weather:
    """Weather of one session.

    `cloud_cover` 0 clear to 1 overcast; `visibility_m`: distance at which contrast falls to 1/e;
    `wind_m_s` roughens the water; `wind_to_deg` is where it blows to, clockwise from north.
    """

    name: str
    cloud_cover: float
    visibility_m: float
    wind_m_s: float
    wind_to_deg: float = 70.0


WEATHERS = (
    Weather("broken clouds", 0.55, 9000.0, 5.0),
    Weather("overcast", 0.95, 9000.0, 4.0),
    Weather("fair", 0.25, 14000.0, 3.0),
    Weather("haze", 0.6, 2900.0, 2.5),
    Weather("drizzle", 1.0, 2600.0, 7.0),
    Weather("fresh breeze", 0.4, 12000.0, 8.5),
)


@dataclass(frozen=True, eq=False)
class Light:
    """Light of one moment: unit direction to the sun (3,) in ENU, and linear colours (3,)."""

    to_sun_in_enu: FloatArray
    sun: Shade
    zenith: Shade
    horizon: Shade
    haze: Shade
    weather: Weather

    def on(self, normals: FloatArray, colours: Shade) -> Shade:
        """Return the colours (n, 3) of matt surfaces with outward normals (n, 3) in ENU."""
        direct, around = self.parts_on(normals, colours)
        return direct + around

    def parts_on(self, normals: FloatArray, colours: Shade) -> tuple[Shade, Shade]:
        """Return what sun and sky each add to the colours (n, 3) of matt surfaces."""
        direct = np.clip(normals @ self.to_sun_in_enu, 0, None)[:, None].astype(np.float32)
        up = ((1 + normals[:, 2]) / 2)[:, None].astype(np.float32)
        around = 0.62 * (self.zenith * 0.6 + self.horizon * 0.4) * (0.35 + 0.65 * up)
        return colours * direct * self.sun, colours * (around + 0.08 * self.horizon * (1 - up))

    @property
    def casts_shadows(self) -> bool:
        """Whether the sun is strong enough beside the sky to draw shadows."""
        return bool(self.sun.mean() > 0.2 * self.zenith.mean())


def sun_position(place: Geodetic, moment: datetime) -> tuple[float, float]:
    """Azimuth (clockwise from north) and elevation of the sun, degrees, to about one degree.

    Source: the low-precision solar coordinates of the Astronomical Almanac.
    """
    days = moment.timestamp() / 86400.0 + 2440587.5 - 2451545.0
    mean_anomaly = radians((357.528 + 0.9856003 * days) % 360)
    mean_longitude = (280.460 + 0.9856474 * days) % 360
    longitude = radians(mean_longitude + 1.915 * sin(mean_anomaly) + 0.020 * sin(2 * mean_anomaly))
    obliquity = radians(23.439 - 4e-7 * days)
    declination = asin(sin(obliquity) * sin(longitude))
    right_ascension = atan2(cos(obliquity) * sin(longitude), cos(longitude))
    sidereal = radians((280.46062 + 360.98564737 * days + place.lon_deg) % 360)
    hour = (sidereal - right_ascension + pi) % (2 * pi) - pi
    lat = radians(place.lat_deg)
    elevation = asin(sin(lat) * sin(declination) + cos(lat) * cos(declination) * cos(hour))
    azimuth = atan2(
        -sin(hour), cos(lat) * sin(declination) / cos(declination) - sin(lat) * cos(hour)
    )
    return degrees(azimuth) % 360, degrees(elevation)


def light_at(place: Geodetic, moment: datetime, weather: Weather) -> Light:
    """Light at a place and moment; the sun is never taken to stand below 4 degrees."""
    azimuth_deg, elevation_deg = sun_position(place, moment)
    azimuth, elevation = radians(azimuth_deg), radians(max(4.0, elevation_deg))
    towards = np.array(
        [sin(azimuth) * cos(elevation), cos(azimuth) * cos(elevation), sin(elevation)]
    )
    warm = float(np.exp(-sin(elevation) / 0.22))  # 0 high sun, towards 1 at the horizon
    height = 0.35 + 0.65 * min(1.0, sin(elevation) / 0.6)
    cover = weather.cloud_cover
    gets_through = (1 - cover) ** 0.7 * (1 - 0.25 * cover)
    sun = np.array([0.86 - 0.55 * warm, 0.94 - 0.3 * warm, 1.0]) * 1.55 * gets_through * height
    blue = np.array([0.60, 0.30, 0.13]) * (1 - 0.4 * warm)
    pale = np.array([0.86, 0.80, 0.74]) * (1 - warm) + np.array([0.50, 0.62, 0.80]) * warm
    grey = np.array([0.60, 0.58, 0.56])
    brightness = height * (1 - 0.25 * max(0.0, cover - 0.8) / 0.2)
    zenith = (blue * (1 - cover) + grey * cover) * brightness
    horizon = (pale * (1 - cover) + grey * 1.25 * cover) * brightness
    haze = horizon * 0.95
    as_float = [np.asarray(c, dtype=np.float32) for c in (sun, zenith, horizon, haze)]
    return Light(towards, as_float[0], as_float[1], as_float[2], as_float[3], weather)
