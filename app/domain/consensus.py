"""Which keypoints agree on one camera, when some are wrong and the lens is not quite known.

A wrong landmark or a slip of the mouse is off by hundreds of pixels; a focal length 3 % off or an
unknown barrel distortion moves correct keypoints at the edges by 10 to 20. Both have to be told
apart: starting from the keypoints that agree at once, fit and agreement are repeated, with the
intrinsics refined on the way, until no keypoint joins or leaves.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
import numpy.typing as npt

from app.domain.camera import Camera, Intrinsics
from app.domain.keypoints import Keypoints, RegistrationError
from app.domain.pnp import Priors, distances_px, first_camera, refine

_ROUNDS = 15
_COARSE_FACTOR = 8
_WIDEST_FACTOR = 8  # 64 px at the usual 8: beyond it, "agreeing" means nothing
_WIDE_FACTOR = 4  # from here on, nearly all must agree
_NEARLY_ALL = 0.8


class NoConsensusError(RegistrationError):
    """There is no camera on which enough keypoints agree."""


@dataclass(frozen=True, eq=False)
class Consensus:
    """The camera, the keypoints (n,) that agree on it within `threshold_px`.

    `refined_from` are the intrinsics from which focal length and k1 were refined, None if they
    were kept. `widened` says that the usual threshold left too few agreeing keypoints.
    """

    camera: Camera
    inliers: npt.NDArray[np.bool_]
    threshold_px: float
    widened: bool
    refined_from: Intrinsics | None


def find_consensus(
    intrinsics: Intrinsics,
    keypoints: Keypoints,
    *,
    threshold_px: float,
    minimum: int,
    refine_from: int | None,
    priors: Priors,
    widest_factor: int = _WIDEST_FACTOR,
) -> Consensus:
    """Find the camera on which most keypoints agree, at least half of them and `minimum`.

    With `refine_from` or more agreeing keypoints, focal length and k1 are refined. The threshold
    is doubled, up to `widest_factor` times its size, while too few agree or while it cuts into the
    scatter of those that do; when it is wide, half of the keypoints agree on many a wrong camera,
    so nearly all must. Raises NoConsensusError if none will do.
    """
    factor = 1
    while factor <= widest_factor:
        share = 0.5 if factor < _WIDE_FACTOR else _NEARLY_ALL
        enough = max(minimum, ceil(share * len(keypoints)))
        threshold = threshold_px * factor
        start = first_camera(intrinsics, keypoints, threshold)
        if start is not None:
            camera, inliers, refined = _settle(start, keypoints, threshold, refine_from, priors)
            if inliers.sum() >= enough and (
                factor == widest_factor or _stands_clear(camera, keypoints[inliers], threshold)
            ):
                return Consensus(
                    camera, inliers, threshold, factor > 1, intrinsics if refined else None
                )
        factor *= 2
    enough = max(minimum, ceil(len(keypoints) / 2))
    raise NoConsensusError(
        f"fewer than {enough} of {len(keypoints)} keypoints agree on any camera: check the "
        "landmarks' coordinates, their pixels and the focal length"
    )


def _stands_clear(camera: Camera, agreeing: Keypoints, threshold_px: float) -> bool:
    """Whether the threshold lies well outside of the scatter, so that it trims no honest errors.

    Trimmed errors look small, and the covariance would be too sure of itself.
    """
    mean_square = float((distances_px(camera, agreeing) ** 2).mean())
    return mean_square <= (threshold_px / 2) ** 2


def _settle(
    start: Camera,
    keypoints: Keypoints,
    threshold_px: float,
    refine_from: int | None,
    priors: Priors,
) -> tuple[Camera, npt.NDArray[np.bool_], bool]:
    """Repeat fit and agreement, with refined intrinsics if they hold, else with the given ones."""
    if refine_from is not None and len(keypoints) >= refine_from:
        camera, inliers = _agree(start, keypoints, threshold_px, start.intrinsics, priors)
        if inliers.sum() >= refine_from and _covers_image(camera.intrinsics):
            return camera, inliers, True
    camera, inliers = _agree(start, keypoints, threshold_px, None, priors)
    return camera, inliers, False


def _agree(
    start: Camera,
    keypoints: Keypoints,
    threshold_px: float,
    refined_from: Intrinsics | None,
    priors: Priors,
) -> tuple[Camera, npt.NDArray[np.bool_]]:
    """Fit to the agreeing keypoints and ask again who agrees, from coarse to fine or at once.

    From coarse to fine, keypoints that wrong intrinsics push away get the chance to correct them;
    at once, wrong keypoints get no chance to pull. The larger agreement wins, then the closer one.
    """
    found = []
    for widest in (1, _COARSE_FACTOR):
        camera, factor = start, widest
        while factor >= 1:
            camera, inliers = _repeat(
                camera, keypoints, threshold_px * factor, refined_from, priors
            )
            factor //= 2
        found.append((camera, inliers))
    return max(
        found,
        key=lambda pair: (
            pair[1].sum(),
            -float((distances_px(pair[0], keypoints[pair[1]]) ** 2).sum()),
        ),
    )


def _repeat(
    start: Camera,
    keypoints: Keypoints,
    threshold_px: float,
    refined_from: Intrinsics | None,
    priors: Priors,
) -> tuple[Camera, npt.NDArray[np.bool_]]:
    camera = start
    inliers = distances_px(camera, keypoints) <= threshold_px
    for _ in range(_ROUNDS):
        if inliers.sum() < 4:  # too few to hold a camera: the caller widens the threshold
            break
        camera = refine(camera, keypoints[inliers], priors, refined_from)
        agreeing = distances_px(camera, keypoints) <= threshold_px
        if (agreeing == inliers).all():
            break
        inliers = agreeing
    return camera, inliers


def _covers_image(intrinsics: Intrinsics) -> bool:
    """Whether the distortion is one-to-one up to the image's corners."""
    corners = np.array(
        [
            [u, v]
            for u in (-0.5, intrinsics.width_px - 0.5)
            for v in (-0.5, intrinsics.height_px - 0.5)
        ]
    )
    camera = Camera(intrinsics, np.eye(3), np.zeros(3))
    return bool(np.isfinite(camera.rays(corners)).all())
