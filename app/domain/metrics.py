"""How far a generated pose is from the true one, and how such errors are summed up.

Poses are judged by where they are, not by how well their boxes cover pixels: a box can fit the
silhouette and stand ten metres off. Errors are split along the water (horizontal) and along the
ellipsoid's normal (vertical), because they have different causes: AIS and registration on the one
hand, the water level on the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees
from typing import Protocol, Self

import cv2
import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

Box = tuple[float, float, float, float]
# Less than this is a box beside the vessel, not of it.
LEAST_IOU = 0.1


class HasBoxPose(Protocol):
    """What has a box's pose among much else: a generated pose, a true one, a row of either."""

    @property
    def centroid_in_cam_m(self) -> npt.ArrayLike:
        """Centroid (3,) in the camera frame."""

    @property
    def rotvec_cam_from_vessel(self) -> npt.ArrayLike:
        """Rodrigues vector (3,)."""

    @property
    def length_m(self) -> float:
        """Along x_v."""

    @property
    def width_m(self) -> float:
        """Along y_v."""

    @property
    def height_m(self) -> float:
        """Along z_v."""


@dataclass(frozen=True, eq=False)
class BoxPose:
    """A 3D box in the camera frame: centroid (3,) m, Rodrigues vector (3,), dimensions in metres.

    The rotation's columns are the vessel's forward, port and up axes in the camera frame.
    """

    centroid_in_cam_m: FloatArray
    rotvec_cam_from_vessel: FloatArray
    length_m: float
    width_m: float
    height_m: float

    @classmethod
    def of(cls, pose: HasBoxPose) -> Self:
        """Return the box of whatever has one."""
        return cls(
            np.asarray(pose.centroid_in_cam_m, dtype=np.float64),
            np.asarray(pose.rotvec_cam_from_vessel, dtype=np.float64),
            pose.length_m,
            pose.width_m,
            pose.height_m,
        )

    @property
    def axes_in_cam(self) -> FloatArray:
        """Columns forward, port, up (3, 3)."""
        rotation, _ = cv2.Rodrigues(np.asarray(self.rotvec_cam_from_vessel, dtype=np.float64))
        return np.asarray(rotation, dtype=np.float64)

    @property
    def corners_in_cam_m(self) -> FloatArray:
        """The eight corners (8, 3): bow-port, bow-starboard, stern-starboard, stern-port, twice."""
        half = np.array([self.length_m, self.width_m, self.height_m]) / 2
        signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]], dtype=np.float64)
        offsets = np.vstack(
            [np.column_stack([signs, np.full(4, side)]) for side in (-1.0, 1.0)],
        )
        return np.asarray(self.centroid_in_cam_m) + (offsets * half) @ self.axes_in_cam.T


@dataclass(frozen=True, slots=True)
class PoseError:
    """Errors of one pose against the truth.

    `horizontal_m` is the distance of the centroids along the water, `vertical_m` and `height_m`
    are signed (generated minus true), `heading_deg` is the angle between the bows, 0 to 180.
    `add_s_m` is ADD-S (Hinterstoisser 2012, symmetric form of Xiang 2018) over the box corners:
    the mean distance from each true corner to the nearest generated one.
    """

    horizontal_m: float
    vertical_m: float
    heading_deg: float
    height_m: float
    add_s_m: float


def pose_error(generated: BoxPose, true: BoxPose) -> PoseError:
    """Compare a generated pose with the true one; both in the same camera frame."""
    forward, _, up = true.axes_in_cam.T
    apart = np.asarray(generated.centroid_in_cam_m) - np.asarray(true.centroid_in_cam_m)
    # A tall box has its centroid higher: only where the box stands says how the level is off.
    lifted = apart @ up - (generated.height_m - true.height_m) / 2
    cosine = float(np.clip(generated.axes_in_cam[:, 0] @ forward, -1.0, 1.0))
    distances = np.linalg.norm(
        true.corners_in_cam_m[:, None, :] - generated.corners_in_cam_m[None, :, :], axis=2
    )
    return PoseError(
        horizontal_m=float(np.linalg.norm(apart - (apart @ up) * up)),
        vertical_m=float(lifted),
        heading_deg=degrees(np.arccos(cosine)),
        height_m=generated.height_m - true.height_m,
        add_s_m=float(distances.min(axis=1).mean()),
    )


@dataclass(frozen=True, slots=True)
class Spread:
    """Median and 95th percentile of absolute errors, and how many there are."""

    count: int
    median: float
    p95: float


def spread(errors: Sequence[float]) -> Spread | None:
    """Sum up errors by their absolute values; None when there are none."""
    if not errors:
        return None
    values = np.abs(np.asarray(errors, dtype=np.float64))
    return Spread(len(values), float(np.median(values)), float(np.percentile(values, 95)))


def best_covered(box_px: Box, silhouettes_px: Sequence[Box]) -> int | None:
    """Return the index of the silhouette that a detection covers best, by IoU; None for none."""
    ious = [box_iou(box_px, silhouette) for silhouette in silhouettes_px]
    best = max(range(len(ious)), key=ious.__getitem__, default=None)
    return best if best is not None and ious[best] > LEAST_IOU else None


def box_iou(first_px: Box, second_px: Box) -> float:
    """Intersection over union of two boxes (x1, y1, x2, y2), px."""
    width = min(first_px[2], second_px[2]) - max(first_px[0], second_px[0])
    height = min(first_px[3], second_px[3]) - max(first_px[1], second_px[1])
    if width <= 0 or height <= 0:
        return 0.0
    shared = width * height
    areas = [(box[2] - box[0]) * (box[3] - box[1]) for box in (first_px, second_px)]
    return shared / (sum(areas) - shared)
