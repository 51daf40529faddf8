"""Rotation matrices as Rodrigues vectors: the axis, as long as the angle in radians.

Three numbers that cannot be inconsistent: the form in which poses and registrations are stored.
"""

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray, frozen_array

# OpenCV is imported where it is used: the web process reads stored rotations without it.


def rotvec_from_matrix(R: FloatArray) -> FloatArray:
    """Rodrigues vector (3,) of a rotation (3, 3); angles reach from 0 to pi."""
    import cv2  # noqa: PLC0415 - see above

    rotvec, _ = cv2.Rodrigues(np.asarray(R, dtype=np.float64))
    return np.asarray(rotvec, dtype=np.float64).reshape(3)


def matrix_from_rotvec(rotvec: npt.ArrayLike) -> FloatArray:
    """Rotation (3, 3) of a Rodrigues vector (3,); raises ValueError unless it is three numbers."""
    import cv2  # noqa: PLC0415 - see above

    R, _ = cv2.Rodrigues(frozen_array("rotation", rotvec, (3,)).copy())
    return np.asarray(R, dtype=np.float64)
