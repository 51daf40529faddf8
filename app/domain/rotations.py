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


def rotvecs_from_matrices(R: FloatArray) -> FloatArray:
    """Rodrigues vectors (n, 3) of rotations (n, 3, 3), all at once; angles from 0 to pi."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - the web process needs it seldom

    rotvecs: FloatArray = Rotation.from_matrix(R).as_rotvec()
    return rotvecs


def matrix_from_rotvec(rotvec: npt.ArrayLike) -> FloatArray:
    """Rotation (3, 3) of a Rodrigues vector (3,); raises ValueError unless it is three numbers."""
    import cv2  # noqa: PLC0415 - see above

    R, _ = cv2.Rodrigues(frozen_array("rotation", rotvec, (3,)).copy())
    return np.asarray(R, dtype=np.float64)


def matrices_from_rotvecs(rotvecs: npt.ArrayLike) -> FloatArray:
    """Rotations (n, 3, 3) of Rodrigues vectors (n, 3), all at once (O. Rodrigues' formula)."""
    vectors = np.asarray(rotvecs, dtype=np.float64).reshape(-1, 3)
    angles = np.sqrt((vectors * vectors).sum(axis=1))
    axes = vectors / np.where(angles > 0, angles, 1)[:, None]
    x, y, z = axes.T
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    sines, cosines = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    R: FloatArray = np.eye(3) + sines * K + (1 - cosines) * (K @ K)
    return R
