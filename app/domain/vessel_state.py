"""What AIS says of one vessel at the moment of one image.

A vessel state is the meeting point of the two halves of the method: tracks make it from messages,
fusion turns it into a water-level plane segment. It keeps the reported antenna position apart from
the dead reckoning still to be applied, because the paper moves the vessel inside the camera's world
frame and because a reviewer wants to see both places.
"""

from dataclasses import dataclass, field
from enum import StrEnum


class HeadingSource(StrEnum):
    """Where a heading came from; recorded so that a pose can be judged by it."""

    REPORTED = "reported"  # the true heading field of a position report
    COURSE = "course"  # course over ground of a vessel moving fast enough
    HELD = "held"  # the last heading of a vessel that is nearly still


@dataclass(frozen=True, slots=True)
class VesselState:
    """AIS state of a vessel, ready to be placed on the water.

    `lat_deg`, `lon_deg` (WGS84) are the antenna position of the report. `speed_kn` for `age_s`
    seconds along `heading_deg` (paper, dead reckoning) leads to the image time; a state already
    interpolated to the image time has `age_s` 0. The four distances are the AIS reference point
    A, B, C, D (ITU-R M.1371, message 5) in metres. The sigmas are one deviation of the place at the
    image time, east and north each, and of the heading.
    """

    identifier: str
    lat_deg: float
    lon_deg: float
    heading_deg: float
    speed_kn: float
    age_s: float
    to_bow_m: float
    to_stern_m: float
    to_port_m: float
    to_starboard_m: float
    heading_source: HeadingSource = HeadingSource.REPORTED
    report_ids: tuple[int, ...] = field(default=())
    position_sigma_m: float = 5.0
    heading_sigma_deg: float = 2.0

    @property
    def length_m(self) -> float:
        """Length over all, A + B."""
        return self.to_bow_m + self.to_stern_m

    @property
    def width_m(self) -> float:
        """Beam, C + D."""
        return self.to_port_m + self.to_starboard_m
