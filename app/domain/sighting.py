"""What goes between the stages of fusion: an image, a vessel found on it, the box made of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

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


class Sighting(NamedTuple):
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
class BoxSigmas:
    """How sure n boxes are: covariances (n, 3, 3) of their centroids, east, north, up, in m^2.

    `heading_deg` and `height_m` (n,) are one sigma each.
    """

    position_covariance_in_enu_m2: FloatArray
    heading_deg: FloatArray
    height_m: FloatArray


@dataclass(frozen=True, eq=False)
class VesselBoxes:
    """The boxes of n sightings as an estimator made them.

    `vessel_axes_in_world` (n, 3, 3) has forward, port and up as rows; `bottom_in_world` (n, 4, 3)
    are the corners at the water, whose ellipsoidal height is `water_level_m` (n,); the top is
    `top_from_bottom_m` (n, 3) away from it. `sigmas` are None where they are not estimated.
    `doubts` are flags of each box's geometry.
    """

    vessel_axes_in_world: FloatArray
    heading_deg: FloatArray
    bottom_in_world: FloatArray
    top_from_bottom_m: FloatArray
    height_m: FloatArray
    water_level_m: FloatArray
    sigmas: BoxSigmas | None
    doubts: Sequence[Sequence[str]]
