"""Where a camera looks now, told from photographs of when it was known.

A mast sways, a bracket slips, someone cleans the lens: the camera still stands where it stood but
has turned a little. One registered photograph is the reference; each new one is compared with a
bank of keyframes (photographs whose turn against the reference is already known, in many kinds of
weather), and all pairs together vote for one rotation. A wrong answer would put every vessel in the
wrong place, so a gate refuses what is weakly supported: people look at what is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import degrees, radians, sqrt

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.reregistration_features import Features, match_features, near_pairs
from app.domain.reregistration_rotation import (
    RotationFit,
    fit_rotation,
    polish_rotation,
    rotation_angle_deg,
)

MOVEMENT_ALARM_DEG = 0.05  # 6 px at the focal length of the paper's camera
# Pairs that follow the best rotation only nearly are no witnesses for another one.
_CLEARLY_APART = 3.0
# How far around the expected place more is looked for, in tolerances.
_SEARCH = 2.5
# Where cameras write on their pictures, of the height, and what counts as the same place.
_RIM = 0.08
_UNMOVED_PX = 8.0

BoolArray = npt.NDArray[np.bool_]


class Refusal(StrEnum):
    """Why the gate lets an image not pass."""

    UNREADABLE = "unreadable"
    WRONG_SIZE = "wrong_size"
    NO_STRUCTURE = "no_structure"
    TOO_FEW_INLIERS = "too_few_inliers"
    TOO_SMALL_AREA = "too_small_area"
    TURNED_TOO_FAR = "turned_too_far"
    TWO_MOTIONS = "two_motions"
    UNCERTAIN = "uncertain"


@dataclass(frozen=True, slots=True)
class Gate:
    """What an image must show before its rotation is believed."""

    inliers: int = 15
    hull_share: float = 0.03
    angle_deg: float = 15.0
    tolerance_px: float = 6.0  # of a picture 2560 px wide
    # Standard deviation, all three axes together; 0.02 degree for the paper's camera.
    uncertainty_px: float = 2.3
    fewest_features: int = 100
    # A second motion with this share of the support (a ship across the picture) is a doubt.
    rival_share: float = 0.5
    rival_deg: float = 0.1
    # With as many inliers no further keyframe is asked.
    enough_inliers: int = 150


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A photograph whose turn against the reference is known; features of the scenery only."""

    image_id: int
    features: Features
    R_from_reference: FloatArray


@dataclass(frozen=True, eq=False)
class Turn:
    """What came of one image: its rotation against the reference, or why it has none.

    `inliers` counts the image's own features, however many keyframes show them too; `hull_share`
    is the part of the image they span; `rmse_px` is how well the rotation explains them and what it
    helped to find besides. `covariance` (3, 3) is of the turn about the axes of the
    image's camera, rad^2. A refused image may have a rotation, which is then not to be used.
    """

    refusal: Refusal | None
    R_from_reference: FloatArray | None = None
    angle_deg: float = 0.0
    inliers: int = 0
    hull_share: float = 0.0
    rmse_px: float = 0.0
    covariance: FloatArray | None = None
    keyframe_ids: tuple[int, ...] = ()

    @property
    def uncertainty_deg(self) -> float:
        """Standard deviation of the rotation, all three axes together, degrees."""
        return 0.0 if self.covariance is None else degrees(sqrt(np.trace(self.covariance)))

    @property
    def passed(self) -> bool:
        """Whether the gate let it pass."""
        return self.refusal is None


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Matches with all keyframes: rays of both, the image's feature, the keyframe, a weight."""

    rays_reference: FloatArray
    rays_image: FloatArray
    features: FloatArray
    keyframes: FloatArray
    weights: FloatArray

    def without(self, dropped: BoolArray) -> "_Pairs":
        """Return the pairs that are not dropped."""
        kept = ~dropped
        return _Pairs(
            self.rays_reference[kept],
            self.rays_image[kept],
            self.features[kept],
            self.keyframes[kept],
            self.weights[kept],
        )


def find_turn(
    features: Features, intrinsics: Intrinsics, keyframes: Sequence[Keyframe], gate: Gate
) -> Turn:
    """Find how an image is turned against the reference, asking the keyframes in their order.

    One keyframe is enough where it agrees well; otherwise all are asked and vote together.
    """
    if len(features) < gate.fewest_features:
        return Turn(Refusal.NO_STRUCTURE)
    lens = Camera(intrinsics, np.eye(3), np.zeros(3))
    rays = lens.rays(features.pixels_px)
    pairs = _pairs(rays, features, lens, keyframes[:1], 0)
    turn = _judged(pairs, features, keyframes, intrinsics, gate)
    if turn.inliers >= gate.enough_inliers or len(keyframes) == 1:
        return turn
    rest = _pairs(rays, features, lens, keyframes[1:], 1)
    return _judged(_joined([pairs, rest]), features, keyframes, intrinsics, gate)


def _pairs(
    rays: FloatArray, features: Features, lens: Camera, keyframes: Sequence[Keyframe], first: int
) -> _Pairs:
    parts = []
    for number, keyframe in enumerate(keyframes, first):
        own, theirs, ratio = match_features(features, keyframe.features)
        seen = lens.rays(keyframe.features.pixels_px[theirs]) @ keyframe.R_from_reference
        good = np.isfinite(seen).all(axis=1) & np.isfinite(rays[own]).all(axis=1)
        good &= ~_burnt_in(features.pixels_px[own], keyframe.features.pixels_px[theirs], lens)
        parts.append(
            _Pairs(
                seen[good],
                rays[own][good],
                own[good].astype(np.float64),
                np.full(int(good.sum()), float(number)),
                (1.0 - ratio[good]) ** 2 + 1e-3,
            )
        )
    return _joined(parts)


def _burnt_in(pixels_px: FloatArray, known_px: FloatArray, lens: Camera) -> BoolArray:
    """Return which pairs may be writing on the picture: near its upper or lower rim, and unmoved.

    A time or a name in the picture's corners says of any camera that it stands still.
    """
    from_rim_px = _RIM * lens.intrinsics.height_px
    v_px = pixels_px[:, 1]
    at_rim = (v_px < from_rim_px) | (v_px > lens.intrinsics.height_px - 1 - from_rim_px)
    unmoved = np.linalg.norm(pixels_px - known_px, axis=1) < _UNMOVED_PX
    return np.asarray(at_rim & unmoved)


def _joined(parts: Sequence[_Pairs]) -> _Pairs:
    return _Pairs(
        np.concatenate([part.rays_reference for part in parts]),
        np.concatenate([part.rays_image for part in parts]),
        np.concatenate([part.features for part in parts]),
        np.concatenate([part.keyframes for part in parts]),
        np.concatenate([part.weights for part in parts]),
    )


def _judged(
    pairs: _Pairs,
    features: Features,
    keyframes: Sequence[Keyframe],
    intrinsics: Intrinsics,
    gate: Gate,
) -> Turn:
    tolerance_rad = _tolerance_rad(intrinsics, gate)
    fit = _fit(pairs, tolerance_rad, gate)
    if fit is None:
        return Turn(Refusal.TOO_FEW_INLIERS)
    witnesses = np.unique(pairs.features[fit.inliers]).astype(int)
    asked = [keyframes[int(number)] for number in np.unique(pairs.keyframes[fit.inliers])]
    exact = _refined(fit, features, intrinsics, asked, tolerance_rad)
    turn = Turn(
        refusal=None,
        R_from_reference=exact.R_b_from_a,
        angle_deg=rotation_angle_deg(exact.R_b_from_a),
        inliers=len(witnesses),
        hull_share=_hull_share(features.pixels_px[witnesses], intrinsics),
        rmse_px=sqrt((exact.distances_rad[exact.inliers] ** 2).mean())
        * float(intrinsics.focal_px.mean()),
        covariance=exact.covariance,
        keyframe_ids=tuple(keyframe.image_id for keyframe in asked),
    )
    refusal = _refusal(turn, float(intrinsics.focal_px.mean()), gate)
    if refusal is None and _has_rival(pairs, fit, turn, tolerance_rad, gate):
        refusal = Refusal.TWO_MOTIONS
    return replace(turn, refusal=refusal)


def _tolerance_rad(intrinsics: Intrinsics, gate: Gate) -> float:
    focal_px = float(intrinsics.focal_px.mean())
    return gate.tolerance_px * max(intrinsics.width_px / 2560, 0.5) / focal_px


def _refined(
    fit: RotationFit,
    features: Features,
    intrinsics: Intrinsics,
    keyframes: Sequence[Keyframe],
    tolerance_rad: float,
) -> RotationFit:
    """Fit again to all that is found where the rotation says it must be."""
    rays_reference, rays_image = [], []
    lens = Camera(intrinsics, np.eye(3), np.zeros(3))
    radius_px = _SEARCH * tolerance_rad * float(intrinsics.focal_px.mean())
    for keyframe in keyframes:
        seen = lens.rays(keyframe.features.pixels_px) @ keyframe.R_from_reference
        expected_px = lens.project(seen @ fit.R_b_from_a.T)
        own, theirs = near_pairs(features, keyframe.features.moved_to(expected_px), radius_px)
        rays_reference.append(seen[theirs])
        rays_image.append(lens.rays(features.pixels_px[own]))
    exact = polish_rotation(
        fit.R_b_from_a, np.concatenate(rays_reference), np.concatenate(rays_image), tolerance_rad
    )
    return fit if exact is None or exact.inliers.sum() < fit.inliers.sum() else exact


def _fit(pairs: _Pairs, tolerance_rad: float, gate: Gate) -> RotationFit | None:
    # Beyond the gate's angle too, so that an image turned too far is told so.
    largest_rad = np.radians(2 * gate.angle_deg)
    return fit_rotation(
        pairs.rays_reference, pairs.rays_image, pairs.weights, tolerance_rad, largest_rad
    )


def _refusal(turn: Turn, focal_px: float, gate: Gate) -> Refusal | None:
    if turn.inliers < gate.inliers:
        return Refusal.TOO_FEW_INLIERS
    if turn.hull_share < gate.hull_share:
        return Refusal.TOO_SMALL_AREA
    if turn.angle_deg > gate.angle_deg:
        return Refusal.TURNED_TOO_FAR
    if radians(turn.uncertainty_deg) * focal_px > gate.uncertainty_px:
        return Refusal.UNCERTAIN
    return None


def _has_rival(
    pairs: _Pairs, fit: RotationFit, turn: Turn, tolerance_rad: float, gate: Gate
) -> bool:
    """Whether the pairs left over agree on another rotation nearly as well."""
    left = pairs.without(fit.distances_rad < _CLEARLY_APART * tolerance_rad)
    rival = _fit(left, tolerance_rad, gate)
    if rival is None:
        return False
    support = len(np.unique(left.features[rival.inliers]))
    apart_deg = rotation_angle_deg(rival.R_b_from_a @ fit.R_b_from_a.T)
    fewest = max(gate.inliers, gate.rival_share * turn.inliers)
    return support >= fewest and apart_deg > gate.rival_deg


def _hull_share(pixels_px: FloatArray, intrinsics: Intrinsics) -> float:
    import cv2  # noqa: PLC0415 - the web process reads results without it

    if len(pixels_px) < 3:
        return 0.0
    hull = cv2.convexHull(pixels_px.astype(np.float32))
    return float(cv2.contourArea(hull)) / (intrinsics.width_px * intrinsics.height_px)
