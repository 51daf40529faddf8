"""How far a camera's clock is off, told from the vessels on its photographs.

A clock that is slow makes every moving vessel appear ahead of where AIS says it was: the residuals
along the tracks agree on one time. When the clock is off by more than some seconds the matching
itself fails, so matches cannot be presupposed. The offset is found in two stages. First each offset
of a grid is tried: how well do the vessels, moved along their tracks to the shifted times, explain
all detections of all images? The true offset stands out, because vessels of different speeds and
courses fall into place together. Then the pairs made at the best offset give their own time
residuals, which are joined robustly: images of one vessel share the errors of its antenna, so a
vessel counts as one witness. Moored vessels say nothing and take part in neither stage.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import cut_edges
from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.vessel_path import VesselPath

# How unlike a detection and its vessel's rectangle are, one sigma: shares of the box and image.
_CENTRE_OF_WIDTH = 0.2
_BOTTOM_OF_HEIGHT = 0.03
_LOG_WIDTH = 0.4
_EXPLAINED = 50.0  # a perfect pair is this much likelier than clutter
_PAIR_LIMIT = 9.0  # squared unlikeness up to which a pair is one: three sigma
# Of one vessel's time residuals: what its boxes and its antenna add.
_BOX_CENTRE_OF_WIDTH = 0.06
_BOX_CENTRE_PX = 3.0
_ANTENNA_SIGMA_M = 4.0
_LEAST_SPEED_MPS = 1.0  # slower vessels are no clocks
_HUBER = 1.5
_HARMLESS_S = 2.0
_LEAST_MATCHED_SHARE = 0.25  # for matches to be believed without a search


@dataclass(frozen=True, slots=True)
class TimedImage:
    """What was detected on an image, whose clock said `clock_s` (seconds from any moment)."""

    clock_s: float
    camera: Camera
    water_level_m: float
    detections: Sequence[Detection]


@dataclass(frozen=True, slots=True)
class OffsetSettings:
    """How far to look, how finely, and what it takes to say that a clock is off."""

    search_s: float = 300.0
    step_s: float = 2.0
    least_vessels: int = 3
    least_gain: float = 12.0  # of log likelihood, over every offset elsewhere
    least_offset_s: float = 1.0  # a smaller one is not worth a change

    def __post_init__(self) -> None:
        """Raise ValueError for a search without end or without steps."""
        if not 0 < self.step_s <= self.search_s <= 7200:
            raise ValueError("search_s must lie between step_s and 7200")


@dataclass(frozen=True, slots=True)
class OffsetEstimate:
    """True time = clock + `offset_s`, within [low_s, high_s] at 95 %.

    `score` is the log likelihood of all detections, moored vessels' too, against clutter alone.
    `is_known` says whether the images tell at all, `is_off` whether they say that the clock is
    wrong; `message` is why or why not, in words.
    """

    offset_s: float
    low_s: float
    high_s: float
    image_count: int
    vessel_count: int
    pair_count: int
    detection_count: int
    score: float
    gain: float
    is_known: bool
    is_off: bool
    message: str

    @property
    def is_suspect(self) -> bool:
        """Whether matches made by this clock are not to be shown: it is off by more than 2 s.

        With the whole interval; what is less moves a vessel by less than its own length.
        """
        nearest_s = min(abs(self.low_s), abs(self.high_s))
        return self.is_off and nearest_s >= _HARMLESS_S


@dataclass(frozen=True, slots=True)
class TimedPair:
    """A detection and the vessel it shows at a trial offset: how late it seems to be."""

    vessel: int
    late_s: float
    box_sigma_s: float
    speed_mps: float


def estimate_offset(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], settings: OffsetSettings
) -> OffsetEstimate:
    """Estimate one clock offset from all images of a time in which the clock was not set.

    `paths` stand in the same world frame as the cameras, their times on the same scale as
    `clock_s`.
    """
    images = [usable for image in images if (usable := _without_cut_boxes(image)).detections]
    grid_s = np.arange(-settings.search_s, settings.search_s + 1e-9, settings.step_s)
    score = _scores(images, paths, grid_s)
    best = int(score.argmax()) if images else 0
    start_s = float(grid_s[best])
    fine_s = start_s + np.arange(-settings.step_s, settings.step_s + 1e-9, settings.step_s / 8)
    offset_s = float(fine_s[_scores(images, paths, fine_s).argmax()]) if images else 0.0
    elsewhere = np.abs(grid_s - start_s) > max(10.0, 2 * settings.step_s)
    gain = float(score[best] - score[elsewhere].max()) if elsewhere.any() and images else 0.0
    pairs: list[TimedPair] = []
    sigma_s = float("inf")
    for _ in range(4):
        pairs = [pair for image in images for pair in _pairs(image, paths, offset_s)]
        change_s, sigma_s = _joined(pairs)
        offset_s += change_s
    half_s = 1.96 * sigma_s
    estimate = OffsetEstimate(
        offset_s=offset_s,
        low_s=offset_s - half_s,
        high_s=offset_s + half_s,
        image_count=len(images),
        vessel_count=len({pair.vessel for pair in pairs}),
        pair_count=len(pairs),
        detection_count=sum(len(image.detections) for image in images),
        score=float(score[best]) if images else 0.0,
        gain=gain,
        is_known=False,
        is_off=False,
        message="",
    )
    return _judged(estimate, settings)


def _judged(estimate: OffsetEstimate, settings: OffsetSettings) -> OffsetEstimate:
    """Say whether an estimate is known and off, and why."""
    vessels, offset_s = estimate.vessel_count, estimate.offset_s
    if vessels < settings.least_vessels:
        few = f"only {vessels} moving vessels agree; at least {settings.least_vessels} are needed"
        return replace(estimate, message=few)
    if estimate.gain < settings.least_gain:
        return replace(estimate, message="no offset explains the images clearly better than others")
    known = replace(estimate, is_known=True)
    off = abs(offset_s) >= settings.least_offset_s and not known.low_s <= 0 <= known.high_s
    if not off:
        return replace(known, message="the clock is right as far as the images can tell")
    side = "slow" if offset_s > 0 else "fast"
    return replace(known, is_off=True, message=f"the clock is {abs(offset_s):.1f} s {side}")


def _without_cut_boxes(image: TimedImage) -> TimedImage:
    """Leave out boxes that the image's border cuts: their middle is not the vessel's."""
    inner = image.camera.intrinsics
    whole = [box for box in image.detections if not cut_edges(box, inner, 2.0).sideways]
    return replace(image, detections=whole)


def _scores(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], offsets_s: FloatArray
) -> FloatArray:
    """Log likelihood (n,) of all detections at each offset, against that of clutter alone."""
    total = np.zeros(len(offsets_s))
    for image in images:
        explained = np.full((len(offsets_s), len(image.detections)), np.inf)
        for path in paths:
            rectangles = path.rectangles_px(
                image.camera, image.water_level_m, image.clock_s + offsets_s
            )
            np.minimum(explained, _unlikeness(image, rectangles), out=explained)
        total += np.log1p(_EXPLAINED * np.exp(-explained / 2)).sum(axis=1)
    return total


def _unlikeness(image: TimedImage, rectangles: FloatArray) -> FloatArray:
    """Squared unlikeness (n, detections) of rectangles (n, 4), infinite where there is none."""
    boxes = np.array([(d.x1_px, d.y1_px, d.x2_px, d.y2_px) for d in image.detections])
    inner = image.camera.intrinsics
    width = boxes[:, 2] - boxes[:, 0]
    centre_sigma = _CENTRE_OF_WIDTH * width + 0.005 * inner.width_px
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = (rectangles[:, 0] + rectangles[:, 2])[:, None] / 2 - (boxes[:, 0] + width / 2)
        bottom = rectangles[:, 3, None] - boxes[:, 3]
        wider = np.log(np.maximum(rectangles[:, 2] - rectangles[:, 0], 1e-6)[:, None] / width)
        squared = (
            (centre / centre_sigma) ** 2
            + (bottom / (_BOTTOM_OF_HEIGHT * inner.height_px)) ** 2
            + (wider / _LOG_WIDTH) ** 2
        )
    return np.where(np.isnan(squared), np.inf, squared)


def _pairs(image: TimedImage, paths: Sequence[VesselPath], offset_s: float) -> list[TimedPair]:
    """Pair detections and vessels at an offset, best first; keep those that can tell the time."""
    moments = image.clock_s + offset_s + np.array([-1.0, 0.0, 1.0])
    rectangles = [path.rectangles_px(image.camera, image.water_level_m, moments) for path in paths]
    costs = np.array([_unlikeness(image, there[1:2])[0] for there in rectangles]).reshape(
        len(paths), len(image.detections)
    )
    pairs = []
    while costs.size and costs.min() < _PAIR_LIMIT:
        vessel, detection = (int(index) for index in np.unravel_index(costs.argmin(), costs.shape))
        costs[vessel, :] = costs[:, detection] = np.inf
        pair = _timed(image.detections[detection], rectangles[vessel], vessel, paths[vessel])
        if pair is not None:
            pairs.append(pair)
    return pairs


def _timed(
    box: Detection, rectangles: FloatArray, vessel: int, path: VesselPath
) -> TimedPair | None:
    """Return how much later than assumed a vessel was where its box is; None if it cannot tell."""
    centres = (rectangles[:, 0] + rectangles[:, 2]) / 2
    px_per_s = float(centres[2] - centres[0]) / 2
    return timed_pair(box, float(centres[1]), px_per_s, vessel, path.mean_speed_mps)


def timed_pair(
    box: Detection, centre_px: float, px_per_s: float, vessel: int, speed_mps: float
) -> TimedPair | None:
    """Return how late a vessel is that AIS puts at `centre_px`; None if it cannot tell.

    It moves by `px_per_s` across the picture: too slow, or unknown (NaN), says nothing.
    """
    box_sigma_px = _BOX_CENTRE_OF_WIDTH * (box.x2_px - box.x1_px) + _BOX_CENTRE_PX
    if not np.isfinite(px_per_s) or abs(px_per_s) * 5.0 < box_sigma_px:
        return None
    late_s = ((box.x1_px + box.x2_px) / 2 - centre_px) / px_per_s
    return TimedPair(vessel, late_s, box_sigma_px / abs(px_per_s), speed_mps)


def matches_agree(
    pairs: Sequence[TimedPair], detection_count: int, settings: OffsetSettings
) -> bool:
    """Whether matches alone show that the clock they were made by is right.

    They do where vessels agree so well that no harmful delay is left, and where they are no mere
    chance: by a wrong clock few detections fit any vessel. Costs nothing beside a search.
    """
    if len({pair.vessel for pair in pairs}) < settings.least_vessels:
        return False
    late_s, sigma_s = _joined(pairs)
    share = len(pairs) / max(detection_count, 1)
    return share >= _LEAST_MATCHED_SHARE and abs(late_s) + 1.96 * sigma_s <= _HARMLESS_S


def _joined(pairs: Sequence[TimedPair]) -> tuple[float, float]:
    """Join residuals, one witness a vessel, outliers weighed down: value and sigma, s."""
    witnesses = [
        _witness([pair for pair in pairs if pair.vessel == vessel])
        for vessel in sorted({pair.vessel for pair in pairs})
    ]
    if not witnesses:
        return 0.0, float("inf")
    values, sigmas = np.array(witnesses).T
    centre = float(np.median(values))
    weights = 1 / sigmas**2
    for _ in range(20):
        away = np.abs(values - centre) / sigmas
        weights = np.minimum(1.0, _HUBER / np.maximum(away, 1e-9)) / sigmas**2
        centre = float((weights * values).sum() / weights.sum())
    if len(values) < 2:
        return centre, float(sigmas[0])
    spread = float(np.sqrt((weights * (values - centre) ** 2).sum() / (len(values) - 1)))
    return centre, max(1.0, spread) / float(np.sqrt(weights.sum()))


def _witness(pairs: Sequence[TimedPair]) -> tuple[float, float]:
    """Return a vessel's median residual and its sigma: boxes average out, the antenna does not."""
    late_s = float(np.median([pair.late_s for pair in pairs]))
    box_s = float(np.median([pair.box_sigma_s for pair in pairs])) / np.sqrt(len(pairs))
    antenna_s = _ANTENNA_SIGMA_M / max(pairs[0].speed_mps, _LEAST_SPEED_MPS)
    return late_s, float(np.hypot(box_s, antenna_s))
