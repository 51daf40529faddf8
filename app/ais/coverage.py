"""Which images of a day have AIS around them: vessels near and in view, and the silences.

An image is covered by what was heard within a few minutes of it, within reach of its site: enough
to tell where a vessel was. One pass over the day's positions does for all its images.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

import numpy as np
import numpy.typing as npt
from sqlalchemy.orm import Session

from app.ais import coverage_repository
from app.ais.area import Area
from app.ais.fields_of_view import SeenFrom, seen_from
from app.ais.report_repository import Readable
from app.ais.thinning import METRES_PER_DEG
from app.db import now
from app.domain.arrays import FloatArray
from app.identities import service as identities
from app.tables.sites import Site

REACH_M = 5_000.0
AROUND_S = 180.0
MOST_IMAGES = 5_000
DAYS_SHOWN = 62
_DAY = timedelta(days=1)


@dataclass(frozen=True, slots=True)
class ImageCoverage:
    """An image: vessels heard near, those in view (None: not registered), age of the nearest.

    `withheld` are those heard only by receivers whose clock is suspect; they count nowhere else.
    """

    image_id: int
    captured_at: datetime
    camera: str
    near: int
    in_view: int | None
    nearest_s: float | None
    withheld: int


@dataclass(frozen=True, slots=True)
class SourceCoverage:
    """A recording or feed on a day: how much it brought, and its longest silence in between."""

    name: str
    positions: int
    first_at: datetime
    last_at: datetime
    longest_silence_s: float
    silent_since: datetime | None


@dataclass(frozen=True, slots=True)
class DayCoverage:
    """A day's images and sources."""

    day: date
    images: list[ImageCoverage]
    sources: list[SourceCoverage]

    @property
    def covered(self) -> int:
        """How many images have AIS near."""
        return sum(image.near > 0 for image in self.images)


@dataclass(frozen=True, slots=True)
class _Heard:
    """A day's positions as columns, in the order of time."""

    time_s: FloatArray
    mmsi: npt.NDArray[np.int64]
    lat_deg: FloatArray
    lon_deg: FloatArray
    source: npt.NDArray[np.int64]
    is_suspect: npt.NDArray[np.bool_]


def days(session: Session, site_id: int, readable: Readable) -> list[tuple[date, int, bool]]:
    """Return the last days with images, newest first: how many, and whether AIS was heard.

    An image just after midnight may have what was heard just before it.
    """
    found = []
    for text, count in coverage_repository.image_days(session, site_id, DAYS_SHOWN):
        day = date.fromisoformat(text)
        start, around = _midnight(day), timedelta(seconds=AROUND_S)
        heard = coverage_repository.is_anything_heard(
            session, readable, start - around, start + _DAY + around
        )
        found.append((day, count, heard))
    return found


def last_day(session: Session, site_id: int) -> date:
    """Return the last day with images; today where there is none."""
    found = coverage_repository.image_days(session, site_id, 1)
    return date.fromisoformat(found[0][0]) if found else now().date()


def of_day(session: Session, site: Site, readable: Readable, day: date) -> DayCoverage:
    """Return the coverage of a day (UTC)."""
    start = _midnight(day)
    pictured = coverage_repository.images(session, site.id, start, start + _DAY, MOST_IMAGES)
    around = timedelta(seconds=AROUND_S)
    area = Area.around(site.origin_lat_deg, site.origin_lon_deg, REACH_M)
    rows = list(
        coverage_repository.heard(session, readable, start - around, start + _DAY + around, area)
    )
    # Feeds count below zero: they and files have ids of their own.
    heard = _Heard(
        np.array([round(row[0], 2) for row in rows], dtype=np.float64),
        np.array([row[1] for row in rows], dtype=np.int64),
        np.array([row[2] for row in rows], dtype=np.float64),
        np.array([row[3] for row in rows], dtype=np.float64),
        np.array([row[4] or -(row[5] or 0) for row in rows], dtype=np.int64),
        np.array([bool(row[6]) for row in rows], dtype=np.bool_),
    )
    views = {seen.viewport.id: seen for seen in seen_from(session, site)}
    return DayCoverage(
        day=day,
        images=[
            _covered(image_id, moment, camera, views.get(viewport_id or 0), site, heard)
            for image_id, moment, camera, viewport_id in pictured
        ],
        sources=_sources(session, heard),
    )


def _midnight(day: date) -> datetime:
    return datetime(day.year, day.month, day.day, tzinfo=UTC)


def _covered(
    image_id: int, moment: datetime, camera: str, view: SeenFrom | None, site: Site, heard: _Heard
) -> ImageCoverage:
    at_s = moment.timestamp()
    first, last = np.searchsorted(heard.time_s, [at_s - AROUND_S, at_s + AROUND_S])
    around = np.arange(first, last)
    usable = around[~heard.is_suspect[first:last]]
    ages_s = np.abs(heard.time_s[usable] - at_s)
    nearest_first = np.argsort(ages_s, kind="stable")
    vessels, chosen = np.unique(heard.mmsi[usable][nearest_first], return_index=True)
    rows = usable[nearest_first[chosen]]
    return ImageCoverage(
        image_id=image_id,
        captured_at=moment,
        camera=camera,
        near=len(rows),
        in_view=None if view is None else _in_view(view, site, heard, rows),
        nearest_s=float(ages_s.min()) if len(ages_s) else None,
        withheld=len(np.setdiff1d(heard.mmsi[around], vessels)),
    )


def _in_view(view: SeenFrom, site: Site, heard: _Heard, rows: npt.NDArray[np.int64]) -> int:
    """Count the places on the water that the camera's picture holds."""
    if not len(rows):
        return 0
    across = math.cos(math.radians(site.origin_lat_deg))
    east_m = (heard.lon_deg[rows] - site.origin_lon_deg) * METRES_PER_DEG * across
    north_m = (heard.lat_deg[rows] - site.origin_lat_deg) * METRES_PER_DEG
    up_m = np.full(len(rows), site.water_level_m - site.origin_height_m)
    pixels = view.camera.project(np.column_stack([east_m, north_m, up_m]))
    lens = view.camera.intrinsics
    inside = (pixels >= -0.5) & (pixels <= np.array([lens.width_px, lens.height_px]) - 0.5)
    return int(inside.all(axis=1).sum())


def _sources(session: Session, heard: _Heard) -> list[SourceCoverage]:
    numbers: Sequence[int] = np.unique(heard.source).tolist()
    feed_ids = [-number for number in numbers if number < 0]
    names = {
        file.id: identities.at_site(session, file.site_id).name(file.file_name)
        or f"Recording {file.id}"
        for file in coverage_repository.files(session, [number for number in numbers if number > 0])
    } | {-feed.id: f"Feed {feed.name}" for feed in coverage_repository.feeds(session, feed_ids)}
    found = []
    for number in numbers:
        times_s = heard.time_s[heard.source == number]
        steps_s = np.diff(times_s)
        at = int(np.argmax(steps_s)) if len(steps_s) else None
        found.append(
            SourceCoverage(
                name=names.get(number, "Elsewhere"),
                positions=len(times_s),
                first_at=datetime.fromtimestamp(float(times_s[0]), UTC),
                last_at=datetime.fromtimestamp(float(times_s[-1]), UTC),
                longest_silence_s=0.0 if at is None else float(steps_s[at]),
                silent_since=None
                if at is None
                else datetime.fromtimestamp(float(times_s[at]), UTC),
            )
        )
    return found
