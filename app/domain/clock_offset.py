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
from itertools import pairwise

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import cut_edges
from app.domain.clock_sight import TimedImage, scores, sights
from app.domain.detection import Detection
from app.domain.vessel_path import VesselPath

# Of one vessel's time residuals: what its boxes and its antenna add.
_BOX_CENTRE_OF_WIDTH = 0.06
_BOX_CENTRE_PX = 3.0
_ANTENNA_SIGMA_M = 4.0
_LEAST_SPEED_MPS = 0.2  # slower vessels are no clocks
_FEWEST_VESSELS = 4  # whose seconds contradict the times they were received at
_HUBER = 1.5
_NEAR_S, _FAR_S = 10.0, 60.0  # large and slow vessels look alike some seconds away, not a minute
_UNCLEAR = "no offset explains the images clearly better than others"
_HARMLESS_S = 2.0
_FEWEST_IMAGES = 3  # that say by themselves that a clock was set
_OTHER_SHARE = 0.05  # of all that is explained, must be by another offset to be one
_LEAST_MATCHED_SHARE = 0.25  # for matches to be believed without a search


@dataclass(frozen=True, slots=True)
class OffsetSettings:
    """How far to look, how finely, and what it takes to say that a clock is off."""

    search_s: float = 300.0
    step_s: float = 2.0
    least_vessels: int = 3
    least_gain: float = 12.0  # of log likelihood, over every offset elsewhere
    # One of both, over those a minute away: in dense traffic vessels fall into place by chance.
    least_gain_per_vessel: float = 2.0
    least_gain_of_rival: float = 0.15
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
    wrong; `message` is why or why not, in words. With `is_receiver` the times that AIS was given
    are as far off instead, for the vessels' own seconds contradict them.
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
    is_receiver: bool = False

    @property
    def is_suspect(self) -> bool:
        """Whether matches made by this clock are not to be shown: it is off by more than 2 s.

        With the whole interval; what is less moves a vessel by less than its own length.
        """
        nearest_s = min(abs(self.low_s), abs(self.high_s))
        return (self.is_off or self.is_receiver) and nearest_s >= _HARMLESS_S


@dataclass(frozen=True, slots=True)
class TimedPair:
    """A detection and the vessel it shows at a trial offset: how late it seems to be.

    `across_mps` is how fast it crosses the line of sight: what its antenna is off by weighs less on
    a fast one.
    """

    vessel: int
    late_s: float
    box_sigma_s: float
    across_mps: float


@dataclass(frozen=True, slots=True)
class Part:
    """Images `first` up to `last` (not itself) of those given, and what they say of the clock."""

    first: int
    last: int
    estimate: OffsetEstimate


def estimate_offset(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], settings: OffsetSettings
) -> OffsetEstimate:
    """Estimate one clock offset from all images of a time in which the clock was not set.

    `paths` stand in the same world frame as the cameras, their times on the same scale as
    `clock_s`. Where some of the images tell another offset than the others, none is known.
    """
    images = [_without_cut_boxes(image) for image in images]
    grid_s = _grid_s(settings)
    return _estimated(images, paths, settings, scores(images, paths, grid_s))


def estimate_parts(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], settings: OffsetSettings
) -> list[Part]:
    """Estimate an offset for each time between which the clock was set; images in their order.

    One part for all images where nothing says that it was.
    """
    images = [_without_cut_boxes(image) for image in images]
    by_image = scores(images, paths, _grid_s(settings))
    edges = [0, *sorted(_changes(by_image, settings, 0)), len(images)]
    parts = [
        Part(first, last, _estimated(images[first:last], paths, settings, by_image[first:last]))
        for first, last in pairwise(edges)
    ]
    if len(parts) > 1 and any(part.estimate.is_known for part in parts):
        return parts
    return [Part(0, len(images), _estimated(images, paths, settings, by_image))]


def _grid_s(settings: OffsetSettings) -> FloatArray:
    return np.arange(-settings.search_s, settings.search_s + 1e-9, settings.step_s)


def _changes(by_image: FloatArray, settings: OffsetSettings, first: int) -> list[int]:
    """Return before which images (numbers from `first`) the clock was set.

    There two offsets, one up to a moment and another from then on, explain clearly more than one.
    """
    if len(by_image) < 2 * _FEWEST_IMAGES:
        return []
    grid_s = _grid_s(settings)
    earlier = np.cumsum(by_image, axis=0)[:-1]
    later = by_image.sum(axis=0) - earlier
    gain = earlier.max(axis=1) + later.max(axis=1) - by_image.sum(axis=0).max()
    apart_s = np.abs(grid_s[earlier.argmax(axis=1)] - grid_s[later.argmax(axis=1)])
    gain[apart_s <= 2 * settings.step_s] = 0.0
    gain[: _FEWEST_IMAGES - 1] = gain[len(gain) - _FEWEST_IMAGES + 1 :] = 0.0
    if gain.max() < settings.least_gain:
        return []
    at = int(gain.argmax()) + 1
    return [
        *_changes(by_image[:at], settings, first),
        first + at,
        *_changes(by_image[at:], settings, first + at),
    ]


def _estimated(
    images: Sequence[TimedImage],
    paths: Sequence[VesselPath],
    settings: OffsetSettings,
    by_image: FloatArray,
) -> OffsetEstimate:
    """Estimate one offset; `by_image` are the scores of each image at each offset of the grid."""
    grid_s, score = _grid_s(settings), by_image.sum(axis=0)
    best = int(score.argmax())
    start_s = float(grid_s[best])
    fine_s = start_s + np.arange(-settings.step_s, settings.step_s + 1e-9, settings.step_s / 8)
    offset_s = float(fine_s[scores(images, paths, fine_s).sum(axis=0).argmax()])
    gain, far_gain = (
        float(score[best] - score[np.abs(grid_s - start_s) > away_s].max(initial=0.0))
        for away_s in (max(_NEAR_S, 2 * settings.step_s), _FAR_S)
    )
    pairs: list[TimedPair] = []
    sigma_s = float("inf")
    for _ in range(4):
        pairs = _pairs(images, paths, offset_s)
        change_s, sigma_s = _joined(pairs)
        offset_s += change_s
    half_s = 1.96 * sigma_s
    estimate = OffsetEstimate(
        offset_s=offset_s,
        low_s=offset_s - half_s,
        high_s=offset_s + half_s,
        image_count=sum(bool(image.detections) for image in images),
        vessel_count=len({pair.vessel for pair in pairs}),
        pair_count=len(pairs),
        detection_count=sum(len(image.detections) for image in images),
        score=float(score[best]),
        gain=gain,
        is_known=False,
        is_off=False,
        message="",
    )
    by_vessels = settings.least_gain_per_vessel * estimate.vessel_count
    by_rival = settings.least_gain_of_rival * (estimate.score - far_gain)
    is_clear = far_gain >= min(by_vessels, by_rival)
    if not is_clear and estimate.vessel_count >= settings.least_vessels:
        return replace(estimate, message=_UNCLEAR)
    return _blamed(_judged(estimate, settings, _other_s(by_image, best, settings)), paths)


def _other_s(by_image: FloatArray, best: int, settings: OffsetSettings) -> float | None:
    """Return another offset that explains images which the best one does not; None without one."""
    gain = np.maximum(by_image - by_image[:, [best]], 0.0).sum(axis=0)
    grid_s = _grid_s(settings)
    gain[np.abs(grid_s - grid_s[best]) <= 2 * settings.step_s] = 0.0
    is_clear = gain.max() >= max(settings.least_gain, _OTHER_SHARE * by_image[:, best].sum())
    return float(grid_s[gain.argmax()]) if is_clear else None


def _judged(
    estimate: OffsetEstimate, settings: OffsetSettings, other_s: float | None
) -> OffsetEstimate:
    """Say whether an estimate is known and off, and why."""
    vessels, offset_s = estimate.vessel_count, estimate.offset_s
    if vessels < settings.least_vessels:
        few = f"only {vessels} moving vessels agree; at least {settings.least_vessels} are needed"
        return replace(estimate, message=few)
    if other_s is not None:
        two = (
            f"some images say {offset_s:+.0f} s and others {other_s:+.0f} s: two clocks, "
            "or one that was set; ask for a shorter time"
        )
        return replace(estimate, message=two)
    if estimate.gain < settings.least_gain:
        return replace(estimate, message=_UNCLEAR)
    known = replace(estimate, is_known=True)
    off = abs(offset_s) >= settings.least_offset_s and not known.low_s <= 0 <= known.high_s
    if not off:
        return replace(known, message="the clock is right as far as the images can tell")
    side = "slow" if offset_s > 0 else "fast"
    return replace(known, is_off=True, message=f"the clock is {abs(offset_s):.1f} s {side}")


def _blamed(estimate: OffsetEstimate, paths: Sequence[VesselPath]) -> OffsetEstimate:
    """Say that the AIS receiver's clock is wrong where most vessels' own seconds contradict it."""
    contradicted = sum(path.is_contradicted for path in paths)
    if not estimate.is_off or len(paths) < _FEWEST_VESSELS or contradicted <= len(paths) / 2:
        return estimate
    off = (
        "the AIS receiver's clock seems wrong rather than the camera's: the seconds in most "
        "vessels' messages contradict its times; set it right, or import AIS of another source"
    )
    return replace(estimate, is_off=False, is_receiver=True, message=off)


def _without_cut_boxes(image: TimedImage) -> TimedImage:
    """Leave out boxes that the image's border cuts: their middle is not the vessel's."""
    inner = image.camera.intrinsics
    whole = [box for box in image.detections if not cut_edges(box, inner, 2.0).sideways]
    return replace(image, detections=whole)


def _pairs(
    images: Sequence[TimedImage], paths: Sequence[VesselPath], offset_s: float
) -> list[TimedPair]:
    """Return how late vessels seem to be at an offset, where their boxes can tell."""
    pairs = (
        timed_pair(
            sight.box,
            sight.centre_px,
            sight.px_per_s,
            sight.vessel,
            sight.px_per_m,
        )
        for sight in sights(images, paths, offset_s)
    )
    return [pair for pair in pairs if pair is not None]


def timed_pair(
    box: Detection, centre_px: float, px_per_s: float, vessel: int, px_per_m: float
) -> TimedPair | None:
    """Return how late a vessel is that AIS puts at `centre_px`; None if it cannot tell.

    It moves by `px_per_s` across the picture: too slow, or unknown (NaN), says nothing. A metre
    there is `px_per_m`.
    """
    box_sigma_px = _BOX_CENTRE_OF_WIDTH * (box.x2_px - box.x1_px) + _BOX_CENTRE_PX
    if not np.isfinite(px_per_s) or abs(px_per_s) * 5.0 < box_sigma_px:
        return None
    late_s = ((box.x1_px + box.x2_px) / 2 - centre_px) / px_per_s
    return TimedPair(vessel, late_s, box_sigma_px / abs(px_per_s), abs(px_per_s) / px_per_m)


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
    across_mps = float(np.median([pair.across_mps for pair in pairs]))
    antenna_s = _ANTENNA_SIGMA_M / max(across_mps, _LEAST_SPEED_MPS)
    return late_s, float(np.hypot(box_s, antenna_s))
