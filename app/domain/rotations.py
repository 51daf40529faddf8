"""Rotation matrices as Rodrigues vectors: the axis, as long as the angle in radians.

Three numbers that cannot be inconsistent: the form in which poses and registrations are stored.
"""

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray, frozen_array

_UNIT = np.eye(3)
_ROUNDED = 1e-12  # more than this off a rotation, a matrix is not one by computation
_NO_TURN = 1e-300
# Four times x x, x y, x z, x w, y x and so on, of a rotation's entries row by row.
_PRODUCTS = np.array(
    [
        [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1],
        [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, -1, 0, 0, -1, 0],
        [0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0],
        [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0],
        [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1],
        [0, 0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0],
        [0, 0, 1, 0, 0, 0, 0, -1, 1, 0, 0, 0, 0, -1, 0, 0],
        [0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0],
        [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    ],
    dtype=np.float64,
)
_PRODUCTS_OF_UNIT = np.eye(4).ravel()

# OpenCV is imported where it is used: the web process reads stored rotations without it.


def rotvec_from_matrix(R: FloatArray) -> FloatArray:
    """Rodrigues vector (3,) of a rotation (3, 3); angles reach from 0 to pi."""
    import cv2  # noqa: PLC0415 - see above

    rotvec, _ = cv2.Rodrigues(np.asarray(R, dtype=np.float64))
    return np.asarray(rotvec, dtype=np.float64).reshape(3)


def rotvecs_from_matrices(R: FloatArray) -> FloatArray:
    """Rodrigues vectors (n, 3) of rotations (n, 3, 3), all at once; angles from 0 to pi.

    By quaternions (x, y, z, w): the products of each two of their numbers are sums of a matrix's
    entries, and those with the largest of them say the others without loss (S. W. Shepperd, 1978).
    """
    if np.abs(R @ R.swapaxes(1, 2) - _UNIT).max(initial=0.0) > _ROUNDED:
        return _of_nearest(R)
    products = (R.reshape(-1, 9) @ _PRODUCTS + _PRODUCTS_OF_UNIT).reshape(-1, 4, 4)
    largest = np.einsum("nii->ni", products).argmax(axis=1)
    rows = products.reshape(-1, 4).take(largest + 4 * np.arange(len(R)), axis=0)
    rows *= np.copysign(1 / np.sqrt((rows * rows).sum(axis=1)), rows[:, 3])[:, None]
    sine = np.sqrt((rows[:, :3] * rows[:, :3]).sum(axis=1))
    angle = 2 * np.arctan2(sine, rows[:, 3])
    return np.asarray(rows[:, :3] * (angle / np.maximum(sine, _NO_TURN))[:, None])


def _of_nearest(R: FloatArray) -> FloatArray:
    """Return the vectors of the rotations nearest to matrices that were printed with few digits."""
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
