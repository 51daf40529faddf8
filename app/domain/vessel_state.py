"""What AIS says of one vessel at the moment of one image.

A vessel state is the meeting point of the two halves of the method: tracks make it from messages,
fusion turns it into a water-level plane segment. It keeps the reported antenna position apart from
the dead reckoning still to be applied, because the paper moves the vessel inside the camera's world
frame and because a reviewer wants to see both places. It says how sure it is, what it was made
from, and by flags what a person should know before trusting it: AIS is unauthenticated, so its
word is evidence and never the truth.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from math import sqrt


class HeadingSource(StrEnum):
    """Where a heading came from; recorded so that a pose can be judged by it."""

    REPORTED = "reported"  # the true heading field of a position report
    COURSE = "course"  # course over ground of a vessel moving fast enough
    TRACK = "track"  # from place to place, of a vessel too slow for its course to be steady
    HELD = "held"  # the last heading of a vessel that is nearly still


class TrackMethod(StrEnum):
    """How a position is carried to the moment of the image."""

    HEADING_DR = "heading_dr"  # the paper's: along the heading
    COG_DR = "cog_dr"  # along the course over ground
    CTRV_DAMPED = "ctrv_damped"  # along the course, which turns on for a while
    HERMITE = "hermite"  # a cubic between the reports before and after


class StateFlag(StrEnum):
    """What to know of a state; what may be wrong with its reports is `plausibility.Doubt`."""

    HEADING_NOT_REPORTED = "heading_not_reported"  # see the heading's source
    LATER_SIZE = "later_size"  # the size was said only after the image
    ANTENNA_UNKNOWN = "antenna_unknown"  # put amidships
    SIZE_AT_LEAST = "size_at_least"  # a distance is the largest that AIS can say
    NO_SIZE = "no_size"  # all dimensions 0: a place, but no box
    AUXILIARY_CRAFT = "auxiliary_craft"  # MMSI 98...: a tender or workboat of another ship


@dataclass(frozen=True, slots=True)
class VesselState:
    """AIS state of a vessel, ready to be placed on the water.

    `lat_deg`, `lon_deg` (WGS84) are the antenna position of the report. `speed_kn` for `age_s`
    seconds along `heading_deg` (paper, dead reckoning) leads to the image time; a state already
    interpolated to the image time has `age_s` 0. The four distances are the AIS reference point
    A, B, C, D (ITU-R M.1371, message 5) in metres, all 0 where unknown. `report_ids` are the
    stored reports that place and heading were made from, `static_ids` the stored static reports
    that told the size. `position_covariance_m2` is that of the place at the image time: east-east,
    east-north, north-north. One that `is_withheld` is shown and matched with nothing.
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
    position_covariance_m2: tuple[float, float, float] = (25.0, 0.0, 25.0)
    heading_sigma_deg: float = 1.5
    track_method: TrackMethod | None = None
    flags: tuple[str, ...] = ()
    static_ids: tuple[int, ...] = ()
    is_withheld: bool = False

    @property
    def length_m(self) -> float:
        """Length over all, A + B."""
        return self.to_bow_m + self.to_stern_m

    @property
    def width_m(self) -> float:
        """Beam, C + D."""
        return self.to_port_m + self.to_starboard_m

    @property
    def position_sigma_m(self) -> float:
        """One deviation of the place, the same in all directions: the covariance's mean."""
        east, _, north = self.position_covariance_m2
        return sqrt((east + north) / 2)
