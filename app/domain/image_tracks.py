"""Boxes of one vessel through a series of images, seconds apart: tracks in the image.

Stone Soup (DSTL) follows each box with a Kalman filter in pixels (its middle, width and lower edge)
and gives the boxes of the next image to tracks by one global assignment.
"""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from app.domain.detection import HALF_PIXEL, Detection

if TYPE_CHECKING:
    from stonesoup.types.track import Track

# Few vessels pass faster than some 50 px/s; they gather way slowly.
_SPEED_SIGMA_PX_S = 15.0
_GROWTH_SIGMA_PX_S = 8.0
_AGILITY = 4.0  # px^2/s^3, of the constant-velocity model
_EDGE_SIGMA_PX = 2.5
_EDGE_SHARE = 0.02  # of the box's size
_FARTHEST_SIGMAS = 4.5
_MOST_MISSED = 3  # images
_EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
MEASURED = 3  # middle, width, lower edge


# A box of a track: the image and the detection, by index.
Sample = tuple[int, int]


def image_tracks(
    times_s: Sequence[float], images: Sequence[Sequence[tuple[int, Detection]]]
) -> list[list[Sample]]:
    """Return the tracks through a series of images, each with its samples in order of time.

    `times_s` rise; each image has its detections with their index. Every detection is in exactly
    one track, and many are alone in theirs.
    """
    follower = _Follower()
    for number, (at_s, boxes) in enumerate(zip(times_s, images, strict=True)):
        follower.see(number, at_s, boxes)
    return follower.samples


class _Follower:
    """The tracks so far; those not seen for some images end."""

    def __init__(self) -> None:
        # Stone Soup takes most of a second to load: only images that are a series need it.
        from stonesoup.dataassociator.neighbour import GNNWith2DAssignment  # noqa: PLC0415
        from stonesoup.hypothesiser.distance import DistanceHypothesiser  # noqa: PLC0415
        from stonesoup.measures import Mahalanobis  # noqa: PLC0415
        from stonesoup.models.transition.linear import (  # noqa: PLC0415
            CombinedLinearGaussianTransitionModel,
            ConstantVelocity,
        )
        from stonesoup.predictor.kalman import KalmanPredictor  # noqa: PLC0415
        from stonesoup.updater.kalman import KalmanUpdater  # noqa: PLC0415

        self._updater = KalmanUpdater(None)
        motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(_AGILITY)] * MEASURED)
        predictor = KalmanPredictor(motion)
        self._associator = GNNWith2DAssignment(
            DistanceHypothesiser(predictor, self._updater, Mahalanobis(), _FARTHEST_SIGMAS)
        )
        self._running: dict[Track, list[Sample]] = {}
        self.samples: list[list[Sample]] = []

    def see(self, number: int, at_s: float, boxes: Sequence[tuple[int, Detection]]) -> None:
        """Give an image's boxes to tracks; a box that none foretold begins one."""
        from stonesoup.types.track import Track  # noqa: PLC0415

        at = _EPOCH + timedelta(seconds=at_s)
        seen = {_measured(box, at): index for index, box in boxes}
        found = self._associator.associate(set(self._running), set(seen), at)
        for track, hypothesis in found.items():
            if hypothesis:
                self._running[track].append((number, seen.pop(hypothesis.measurement)))
                track.append(self._updater.update(hypothesis))
            else:
                track.append(hypothesis.prediction)
        self._running = {
            track: samples
            for track, samples in self._running.items()
            if number - samples[-1][0] < _MOST_MISSED
        }
        # The order of a set of objects differs from run to run; that of the boxes does not.
        for measured, index in seen.items():
            samples = [(number, index)]
            self._running[Track([_beginning(measured)])] = samples
            self.samples.append(samples)


def _measured(box: Detection, at: datetime) -> Any:  # noqa: ANN401 - Stone Soup has no types
    from stonesoup.models.measurement.linear import LinearGaussian  # noqa: PLC0415
    from stonesoup.types.detection import Detection as Measurement  # noqa: PLC0415

    width, height = box.x2_px - box.x1_px, box.y2_px - box.y1_px
    sideways = _EDGE_SIGMA_PX + _EDGE_SHARE * width
    down = _EDGE_SIGMA_PX + _EDGE_SHARE * height
    noise = np.diag([sideways**2 / 2, 2 * sideways**2, down**2])
    middle = (box.x1_px + box.x2_px) / 2 - HALF_PIXEL
    return Measurement(
        [middle, width, box.y2_px - HALF_PIXEL],
        timestamp=at,
        measurement_model=LinearGaussian(2 * MEASURED, [0, 2, 4], noise),
    )


def _beginning(measured: Any) -> Any:  # noqa: ANN401 - Stone Soup has no types
    """Return what one box tells: its place, and no speed."""
    from stonesoup.types.state import GaussianState  # noqa: PLC0415

    mean, variance = np.zeros(2 * MEASURED), np.zeros(2 * MEASURED)
    mean[::2] = measured.state_vector.ravel()
    variance[::2] = np.diag(measured.measurement_model.noise_covar)
    variance[1::2] = np.array([_SPEED_SIGMA_PX_S, _GROWTH_SIGMA_PX_S, _GROWTH_SIGMA_PX_S]) ** 2
    return GaussianState(mean, np.diag(variance), timestamp=measured.timestamp)
