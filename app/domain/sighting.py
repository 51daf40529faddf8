"""What goes between the stages of fusion: an image, a vessel found on it, the box made of it."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.domain.arrays import FloatArray
from app.domain.borders import CutEdges
from app.domain.candidates import Candidate
from app.domain.detection import Detection
from app.domain.likelihood import Odds
from app.domain.matching import Cost
from app.domain.matching_baselines import GroundCost
from app.domain.vessel_state import VesselState


@dataclass(frozen=True, slots=True)
class SeenImage:
    """One image of a viewport: its detections, the vessel states at its time, and the water.

    `water_level_m` is the ellipsoidal height of the water as it is known beforehand; `at_s` is the
    image's time in seconds from any moment that all images of a series share.
    """

    detections: Sequence[Detection]
    states: Sequence[VesselState]
    water_level_m: float
    at_s: float = 0.0


@dataclass(frozen=True, eq=False)
class Sighting:
    """A vessel and the detection it belongs to, on an image whose given water level is known.

    `cut` says which edges of the detection are the image's border.
    """

    candidate: Candidate
    detection_index: int
    detection: Detection
    cut: CutEdges
    cost: Cost | Odds | GroundCost
    water_level_m: float


@dataclass(frozen=True, eq=False)
class VesselBox:
    """The box of a sighting as an estimator made it.

    `vessel_axes_in_world` (3, 3) has forward, port and up as rows; `bottom_in_world` (4, 3) are the
    corners at the water, whose ellipsoidal height is `water_level_m`; the top is
    `top_from_bottom_m` (3,) away from it. `position_covariance_in_enu_m2` (3, 3) is that of the
    box's centroid, east, north, up; it and the sigmas are None where they are not estimated.
    `doubts` are flags of its geometry.
    """

    vessel_axes_in_world: FloatArray
    heading_deg: float
    bottom_in_world: FloatArray
    top_from_bottom_m: FloatArray
    height_m: float
    water_level_m: float
    position_covariance_in_enu_m2: FloatArray | None = None
    heading_sigma_deg: float | None = None
    height_sigma_m: float | None = None
    doubts: tuple[str, ...] = ()
