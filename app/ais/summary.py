"""What a recording says of each vessel, gathered while it is decoded."""

from dataclasses import dataclass
from datetime import datetime

from app.domain.ais import PositionReport, StaticReport


@dataclass(slots=True)
class VesselSummary:
    """A vessel as last heard of in one recording; None where it did not say."""

    first_seen_at: datetime
    last_seen_at: datetime
    said_at: datetime | None = None
    name: str | None = None
    callsign: str | None = None
    imo: int | None = None
    ship_type: int | None = None
    length_m: float | None = None
    width_m: float | None = None

    def add(self, static: StaticReport) -> None:
        """Take over what a static report says; an older one only fills gaps."""
        is_newer = self.said_at is None or static.received_at >= self.said_at
        for name, value in (
            ("name", static.name),
            ("callsign", static.callsign),
            ("imo", static.imo),
            ("ship_type", static.ship_type),
            ("length_m", _sum(static.to_bow_m, static.to_stern_m)),
            ("width_m", _sum(static.to_port_m, static.to_starboard_m)),
        ):
            if value is not None and (is_newer or getattr(self, name) is None):
                setattr(self, name, value)
        if is_newer:
            self.said_at = static.received_at


class RecordingSummary:
    """The vessels of a recording by MMSI, and when its first and last report were."""

    def __init__(self) -> None:
        self.vessels: dict[int, VesselSummary] = {}

    def add(self, report: PositionReport | StaticReport) -> None:
        """Count a report."""
        moment = report.received_at if isinstance(report, StaticReport) else report.fix_time
        vessel = self.vessels.get(report.mmsi)
        if vessel is None:
            vessel = self.vessels[report.mmsi] = VesselSummary(moment, moment)
        elif moment > vessel.last_seen_at:
            vessel.last_seen_at = moment
        elif moment < vessel.first_seen_at:
            vessel.first_seen_at = moment
        if isinstance(report, StaticReport):
            vessel.add(report)

    @property
    def first(self) -> datetime | None:
        """The moment of the first report."""
        return min((vessel.first_seen_at for vessel in self.vessels.values()), default=None)

    @property
    def last(self) -> datetime | None:
        """The moment of the last report."""
        return max((vessel.last_seen_at for vessel in self.vessels.values()), default=None)


def _sum(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else one + other
