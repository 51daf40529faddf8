"""The ways of all vessels around some images, for asking what time their clock should have said."""

from collections import defaultdict
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np
from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.service import reports_between
from app.clocks.repository import DetectedImage
from app.domain.ais import PositionReport, StaticReport
from app.domain.clock_offset import OffsetSettings
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import EnuFrame
from app.domain.vessel_path import LONGEST_GAP_S, VesselPath, vessel_path
from app.tables.sites import Site

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def boxes_of(one: DetectedImage, fusion: FusionSettings) -> list[Detection]:
    """Return the boxes on an image that fusion would use."""
    return [box for box in one.detections if box.score >= fusion.score_threshold]


def paths_around(
    session: Session,
    site: Site,
    frame: EnuFrame,
    seen: Sequence[DetectedImage],
    settings: OffsetSettings,
    fusion: FusionSettings,
    shift_s: float = 0.0,
) -> list[VesselPath]:
    """Return the vessels' ways around all images, `shift_s` later, as far as the search goes.

    Images stand in the order of their times; the ways' times are seconds since 1970.
    """
    if not seen:
        return []
    margin = timedelta(seconds=settings.search_s + LONGEST_GAP_S)
    origin = frame.geodetic(np.zeros(3))
    area = Area.around(origin.lat_deg, origin.lon_deg, 2 * fusion.maximum_range_m)
    positions: dict[int, list[PositionReport]] = defaultdict(list)
    statics: dict[int, list[StaticReport]] = defaultdict(list)
    shift = timedelta(seconds=shift_s)
    begin = seen[0].image.captured_at + shift - margin
    for here, following in zip(seen, [*seen[1:], None], strict=True):
        end = here.image.captured_at + shift + margin
        if following is not None and following.image.captured_at + shift - margin <= end:
            continue
        heard = reports_between(session, site.id, begin, end, area)
        for report in heard.positions:
            positions[report.mmsi].append(report)
        for mmsi, said in heard.statics.items():
            statics[mmsi] += said
        if following is not None:
            begin = following.image.captured_at + shift - margin
    paths = (
        vessel_path(reports, statics[mmsi], frame, site.water_level_m, EPOCH)
        for mmsi, reports in positions.items()
    )
    return [path for path in paths if path is not None]
