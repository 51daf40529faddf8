"""What is probably wrong with keypoints that do not agree.

"Three of fourteen do not fit" sends a person through fourteen keypoints. Most mistakes are of few
kinds, though, and each kind has a test: exchange the two pixels, turn the heights over, count the
rows from below, try another focal length, and see whether the rest falls into place. What passes is
named with the fix. It is a hint: nothing is ever corrected by itself.
"""

from itertools import combinations

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.consensus import Consensus, NoConsensusError, find_consensus
from app.domain.geodesy import EnuFrame
from app.domain.keypoints import Keypoints, Suspicion, SuspicionKind
from app.domain.pnp import Priors, closed_camera, distances_px
from app.domain.projection import projection_jacobian

_FITS_PX = 24.0  # with a lens not yet known, right keypoints are off by up to 20 px
_MUCH_BETTER = 4.0
_FAR_PX = 80.0  # few keypoints predict another one no better
_MOST_PAIRED = 40  # keypoints: 780 exchanges take half a second
_FEWEST_TO_GUESS = 7
_MOST_AGREE = 0.8
_FOCAL_SCALES = (0.35, 0.5, 0.7, 0.8, 0.9, 1.1, 1.25, 1.4, 2.0, 2.8)
_FOCAL_DIFFERS = 0.04
_WIDE_PRIORS = Priors(focal=0.3, k1=0.05)
_HEIGHT_STEPS = 8
_HEIGHT_DIFFERS_M = 0.5


def suspect_outliers(frame: EnuFrame, found: Consensus, keypoints: Keypoints) -> list[Suspicion]:
    """Say of the keypoints that do not agree with a camera what is probably wrong with them."""
    outliers = [int(index) for index in np.flatnonzero(~found.inliers)]
    projected = found.camera.project(keypoints.points_in_world)
    # How far each landmark's projection (rows) lies from each pixel (columns).
    apart = np.linalg.norm(projected[:, None] - keypoints.pixels_px[None], axis=2)
    own = np.nan_to_num(np.diag(apart), nan=0.0)
    near = np.maximum(max(_FITS_PX, found.threshold_px), np.minimum(_FAR_PX, own / _MUCH_BETTER))
    fits = apart <= near[:, None]
    said: list[Suspicion] = []
    left = list(outliers)
    for one, other in combinations(outliers, 2):
        if one in left and other in left and fits[one, other] and fits[other, one]:
            said.append(_swapped(keypoints, one, other))
            left = [index for index in left if index not in (one, other)]
    for index in left:
        elsewhere = [other for other in left if other != index and fits[other, index]]
        said.append(
            _misplaced(keypoints, index, elsewhere[0])
            if elsewhere
            else _alone(frame, found, keypoints, index)
        )
    return said


def explain_disagreement(
    intrinsics: Intrinsics,
    keypoints: Keypoints,
    threshold_px: float,
    minimum: int,
    water_level_m: float | None = None,
) -> list[Suspicion]:
    """Say of keypoints on which no camera, or only a poor one, agrees what is probably wrong.

    Heights turned over and rows counted from below look the same to the solver; where the water is
    (in the world frame) tells which of them puts the camera above it.
    """
    if len(keypoints) < max(minimum, _FEWEST_TO_GUESS):
        return []
    swapped = _swap_that_helps(intrinsics, keypoints)
    if swapped is not None:
        return [swapped]
    turned = Keypoints(keypoints.points_in_world * (1, 1, -1), keypoints.pixels_px)
    if _is_dry(_agree(intrinsics, turned, threshold_px, minimum), water_level_m):
        return [
            Suspicion(
                SuspicionKind.MIRRORED_HEIGHTS,
                (),
                "The keypoints agree once all heights are turned over: check the heights' sign.",
            )
        ]
    from_below = Keypoints(
        keypoints.points_in_world, keypoints.pixels_px * (1, -1) + (0, intrinsics.height_px - 1)
    )
    if _is_dry(_agree(intrinsics, from_below, threshold_px, minimum), water_level_m):
        return [
            Suspicion(
                SuspicionKind.MIRRORED_ROWS,
                (),
                "The keypoints agree once v is counted from the image's top: v seems to be "
                "counted from its bottom.",
            )
        ]
    return _focal_that_helps(intrinsics, keypoints, threshold_px, minimum)


def _swapped(keypoints: Keypoints, one: int, other: int) -> Suspicion:
    names = f"{keypoints.label(one)} and {keypoints.label(other)}"
    return Suspicion(
        SuspicionKind.SWAPPED,
        (one, other),
        f"{names} seem to be exchanged: each is seen where the other should be.",
    )


def _misplaced(keypoints: Keypoints, index: int, other: int) -> Suspicion:
    return Suspicion(
        SuspicionKind.MISPLACED,
        (index, other),
        f"{keypoints.label(index)} is marked where {keypoints.label(other)} should be.",
    )


def _alone(frame: EnuFrame, found: Consensus, keypoints: Keypoints, index: int) -> Suspicion:
    label = keypoints.label(index)
    rise_m = _rise_that_fits(found.camera, keypoints, index, found.threshold_px)
    if rise_m is not None:
        point = keypoints.points_in_world[index]
        before, after = (
            frame.geodetic(point + np.array([0, 0, rise])).height_m for rise in (0.0, rise_m)
        )
        return Suspicion(
            SuspicionKind.HEIGHT,
            (index,),
            f"{label} would fit with a height of {after:.1f} m instead of {before:.1f} m.",
        )
    distance = distances_px(found.camera, keypoints[np.arange(len(keypoints)) == index])[0]
    words = f"{distance:.0f} px from where the others put it"
    if not np.isfinite(distance):
        words = "behind the camera that the others agree on"
    return Suspicion(
        SuspicionKind.OUTLIER, (index,), f"{label} lies {words}: check its pixel and its place."
    )


def _rise_that_fits(
    camera: Camera, keypoints: Keypoints, index: int, threshold_px: float
) -> float | None:
    """Find the metres up (or down) that bring a landmark to its pixel, if any do."""
    point, pixel = keypoints.points_in_world[index].copy(), keypoints.pixels_px[index]
    start = point[2]
    for _ in range(_HEIGHT_STEPS):
        miss = pixel - camera.project(point[None])[0]
        if not np.isfinite(miss).all():
            return None
        # Raising a point is lowering the camera.
        by_height = -projection_jacobian(camera, point[None])[0, :, 5]
        point[2] += float(by_height @ miss) / max(float(by_height @ by_height), 1e-12)
    miss = pixel - camera.project(point[None])[0]
    rise_m = float(point[2] - start)
    fits = np.isfinite(miss).all() and np.linalg.norm(miss) <= threshold_px
    return rise_m if fits and abs(rise_m) > _HEIGHT_DIFFERS_M else None


def _swap_that_helps(intrinsics: Intrinsics, keypoints: Keypoints) -> Suspicion | None:
    """Find the one pair whose exchange lets all keypoints agree."""
    if len(keypoints) > _MOST_PAIRED:
        return None
    before = _scatter_px(intrinsics, keypoints.points_in_world, keypoints.pixels_px)
    best = (np.inf, (0, 0))
    for one, other in combinations(range(len(keypoints)), 2):
        pixels = keypoints.pixels_px.copy()
        pixels[[one, other]] = pixels[[other, one]]
        scatter = _scatter_px(intrinsics, keypoints.points_in_world, pixels)
        best = min(best, (scatter, (one, other)))
    scatter, pair = best
    if scatter > min(_FITS_PX, before / _MUCH_BETTER):
        return None
    return _swapped(keypoints, *pair)


def _scatter_px(intrinsics: Intrinsics, points: FloatArray, pixels: FloatArray) -> float:
    """Root mean square error of the closed solution for all keypoints."""
    keypoints = Keypoints(points, pixels)
    camera = closed_camera(intrinsics, keypoints)
    if camera is None:
        return float("inf")
    return float(np.sqrt((distances_px(camera, keypoints) ** 2).mean()))


def _agree(
    intrinsics: Intrinsics, keypoints: Keypoints, threshold_px: float, minimum: int
) -> Consensus | None:
    """Find the camera on which most keypoints agree closely, if there is one."""
    try:
        found = find_consensus(
            intrinsics,
            keypoints,
            threshold_px=threshold_px,
            minimum=minimum,
            refine_from=minimum,
            priors=_WIDE_PRIORS,
            widest_factor=2,
        )
    except NoConsensusError:
        return None
    return found if found.inliers.mean() >= _MOST_AGREE else None


def _is_dry(found: Consensus | None, water_level_m: float | None) -> bool:
    if found is None:
        return False
    return water_level_m is None or float(found.camera.center_in_world[2]) > water_level_m


def _focal_that_helps(
    intrinsics: Intrinsics, keypoints: Keypoints, threshold_px: float, minimum: int
) -> list[Suspicion]:
    lenses = []
    for scale in (1.0, *_FOCAL_SCALES):
        K = intrinsics.K.copy()
        K[[0, 1], [0, 1]] *= scale
        lenses.append(
            Intrinsics(intrinsics.width_px, intrinsics.height_px, K, intrinsics.distortion)
        )
    # The closed solution is quick, and tells which of them is worth a closer look.
    scatters = [
        _scatter_px(lens, keypoints.points_in_world, keypoints.pixels_px) for lens in lenses
    ]
    best = lenses[int(np.argmin(scatters))]
    found = _agree(best, keypoints, threshold_px, minimum)
    if found is None:
        return []
    given, focal = intrinsics.K[0, 0], found.camera.intrinsics.K[0, 0]
    if abs(np.log(focal / given)) < _FOCAL_DIFFERS:
        return []
    return [
        Suspicion(
            SuspicionKind.FOCAL_LENGTH,
            (),
            f"The keypoints would agree with a focal length of about {focal:.0f} px instead "
            f"of {given:.0f} px: check the camera's intrinsics.",
        )
    ]
