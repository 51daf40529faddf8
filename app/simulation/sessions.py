"""When images are taken: sessions at several hours of the day, each with its weather and traffic.

A camera with a motion trigger takes images when something passes. So each session is cut into
slots, and in each slot one moment is drawn from those at which a moving vessel is in view.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from app.domain.camera import Camera
from app.simulation.light import WEATHERS, Weather
from app.simulation.scenery import harbour_axes
from app.simulation.settings import HarbourSettings
from app.simulation.traffic import make_vessels
from app.simulation.vessels import Vessel

_HOURS = (0.0, 5.4, 10.6)  # after the start, each day
_SECONDS_PER_IMAGE = 50.0
_TIDE_S = 12.42 * 3600
_FIRST_MMSI = 211_200_000  # 211: Germany; 1,000 for each session


@dataclass(frozen=True, eq=False)
class Session:
    """Some minutes in which images are taken.

    `span_s` are seconds after the harbour's start; `viewport` counts from 0; `water_level_m` is the
    tide in its middle.
    """

    number: int
    span_s: tuple[float, float]
    water_level_m: float
    viewport: int
    weather: Weather
    vessels: tuple[Vessel, ...]


def make_sessions(
    seed: int, settings: HarbourSettings, azimuth_deg: float, image_count: int
) -> tuple[Session, ...]:
    """Draw the sessions; from half of them on the camera is turned to its second viewport."""
    spans = _spans(settings, image_count)
    order = np.random.default_rng([seed, 5]).permutation(len(WEATHERS))
    half = (len(spans) + 1) // 2
    return tuple(
        Session(
            number,
            span_s,
            tide_m(seed, settings, sum(span_s) / 2),
            int(number >= half),
            WEATHERS[int(order[number % len(WEATHERS)])],
            make_vessels(
                np.random.default_rng([seed, 4, number]),
                settings.traffic,
                settings.fleet,
                harbour_axes(azimuth_deg),
                span_s,
                f"s{number + 1}",
                _FIRST_MMSI + 1000 * number,
            ),
        )
        for number, span_s in enumerate(spans)
    )


def _spans(settings: HarbourSettings, image_count: int) -> list[tuple[float, float]]:
    """Share the images out to sessions of some minutes, three a day."""
    count = -(-image_count // settings.images_per_session)
    spans = []
    for number in range(count):
        day, hour = divmod(number, len(_HOURS))
        first = day * 86400.0 + _HOURS[hour] * 3600.0
        here = image_count // count + (number < image_count % count)
        spans.append((first, first + here * _SECONDS_PER_IMAGE))
    return spans


def capture_times_s(rng: np.random.Generator, session: Session, camera: Camera) -> Iterator[float]:
    """Yield the moments of a session's images, seconds after the start, rising."""
    first, last = session.span_s
    for slot in range(round((last - first) / _SECONDS_PER_IMAGE)):
        begins = first + slot * _SECONDS_PER_IMAGE
        times = begins + np.arange(4.0, _SECONDS_PER_IMAGE, 3.0) + float(rng.uniform(-1, 1))
        busy = [t for t in times if _in_view(camera, session, float(t))]
        yield round(float(rng.choice(busy or times)), 2)


def _in_view(camera: Camera, session: Session, time_s: float) -> bool:
    """Whether the middle of a moving vessel is in the image."""
    motions = [v.passage.at(time_s) for v in session.vessels if not v.moored]
    if not motions:
        return False
    pixels = camera.project(np.array([(m.east_m, m.north_m, 0.0) for m in motions]))
    inner = camera.intrinsics
    inside = (pixels >= 0) & (pixels < (inner.width_px, inner.height_px))
    return bool(inside.all(axis=1).any())


def tide_m(seed: int, settings: HarbourSettings, time_s: float) -> float:
    """Water level above its mean, metres: one semi-diurnal wave."""
    phase = float(np.random.default_rng([seed, 7]).uniform(0, 2 * np.pi))
    return settings.tide_amplitude_m * float(np.sin(2 * np.pi * time_s / _TIDE_S + phase))
