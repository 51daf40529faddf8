"""Lens distortion after Brown and Conrady, and where it can be trusted.

A lens bends straight lines: the model moves a point of the normalised image plane (x = X/Z,
y = Y/Z) radially by a polynomial in r^2 and tangentially by two small terms (OpenCV's order
k1, k2, p1, p2, k3). Fitted to what the image shows, the polynomial turns back far outside of it: a
ship beside the field of view would fold onto the picture. The model is therefore trusted only
where it is one-to-one, from the centre out to the radius at which it stops growing.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

_BISECTIONS = 60  # halves the bracket to the last bit of a double
_AT_ONCE = 12  # after so many it is asked whether Newton's method may take over
_SURE = 1e-3  # the bracket's width, in share of what is left to the end of the one-to-one range
_NEWTON_STEPS = 12  # quadratic convergence: four are usual
_SETTLED = 1e-13  # on the normalised plane: under 1e-9 px for any focal length in use


def distort(distortion: FloatArray, points: FloatArray) -> FloatArray:
    """Move ideal points (n, 2) of the normalised plane to where the lens shows them, (n, 2).

    `distortion` is (5,) in OpenCV's order. Rows where the model is not one-to-one become NaN.
    """
    if not distortion.any():
        return points.copy()
    moved = _moved(distortion, points)
    r2 = (points**2).sum(axis=1)
    jacobian = distortion_jacobian(distortion, points)
    determinant = jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0]
    moved[~((r2 < one_to_one_radius(distortion) ** 2) & (determinant > 0))] = np.nan
    return moved


def undistort(distortion: FloatArray, points: FloatArray) -> FloatArray:
    """Find the ideal points (n, 2) that the lens shows at `points` (n, 2); NaN where none is.

    The radial part is bracketed inside the one-to-one range, so that the search cannot end on the
    folded branch; Newton's method on the full model does the rest.
    """
    if not distortion.any():
        return points.copy()
    ideal = _radial_start(distortion, points)
    for _ in range(_NEWTON_STEPS):
        miss = _moved(distortion, ideal) - points
        if not (np.abs(miss) > _SETTLED).any():
            break
        # A singular Jacobian only arises on the rim of the range, whose points are dropped below.
        jacobian = distortion_jacobian(distortion, ideal)
        ahead, aside, below = jacobian[:, 0, 0], jacobian[:, 0, 1], jacobian[:, 1, 1]
        determinant = ahead * below - aside * aside
        determinant[determinant == 0] = np.nan
        step_x = (below * miss[:, 0] - aside * miss[:, 1]) / determinant
        step_y = (ahead * miss[:, 1] - aside * miss[:, 0]) / determinant
        ideal = ideal - np.array([step_x, step_y]).T
    # A NaN compares false, so whatever left the range on the way is dropped here too.
    settled = (np.abs(distort(distortion, ideal) - points) < 1e-11).all(axis=1)
    ideal[~settled] = np.nan
    return ideal


def distortion_jacobian(distortion: FloatArray, points: FloatArray) -> FloatArray:
    """Differentiate the distorted by the ideal points (n, 2): (n, 2, 2), formula as it stands."""
    k1, k2, p1, p2, k3 = distortion.tolist()
    x, y = points[:, 0], points[:, 1]
    r2 = x * x + y * y
    radial = _radial_factor(distortion, r2)
    slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))  # d radial / dx = slope * x
    cross = slope * x * y + 2 * (p1 * x + p2 * y)
    jacobian: FloatArray = np.empty((len(points), 2, 2))
    jacobian[:, 0, 0] = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x
    jacobian[:, 0, 1] = jacobian[:, 1, 0] = cross
    jacobian[:, 1, 1] = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x
    return jacobian


def one_to_one_radius(distortion: FloatArray) -> float:
    """Radius on the normalised plane at which the radial polynomial stops growing, or infinity."""
    k1, k2, _, _, k3 = distortion.tolist()
    return _turning_radius(k1, k2, k3)


@lru_cache(maxsize=64)
def _turning_radius(k1: float, k2: float, k3: float) -> float:
    # Cached: a camera keeps its lens, and looking for roots takes longer than projecting a ship.
    # d/dr (r + k1 r^3 + k2 r^5 + k3 r^7) as a polynomial in r^2, highest power first.
    roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
    turning = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
    return float(np.sqrt(turning.min())) if turning.size else float("inf")


def _radial_factor(distortion: FloatArray, r2: FloatArray) -> FloatArray:
    k1, k2, _, _, k3 = distortion.tolist()
    return np.asarray(1 + r2 * (k1 + r2 * (k2 + r2 * k3)), dtype=np.float64)


def _moved(distortion: FloatArray, points: FloatArray) -> FloatArray:
    """Apply OpenCV's formula, wherever it leads."""
    _, _, p1, p2, _ = distortion.tolist()
    x, y = points[:, 0], points[:, 1]
    r2 = x * x + y * y
    radial = _radial_factor(distortion, r2)
    moved: FloatArray = np.empty_like(points)
    moved[:, 0] = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    moved[:, 1] = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return moved


def _radial_start(distortion: FloatArray, points: FloatArray) -> FloatArray:
    """Undo the radial part alone by bisection, (n, 2): near enough for Newton's method at least.

    Far from the end of the one-to-one range a narrow bracket is enough, near it every bit counts.
    """
    shown = np.hypot(points[:, 0], points[:, 1])

    def grown(radius: FloatArray) -> npt.NDArray[np.bool_]:
        return radius * _radial_factor(distortion, radius**2) >= shown

    low = np.zeros_like(shown)
    limit = one_to_one_radius(distortion)
    high = np.full_like(shown, limit if np.isfinite(limit) else 1.0)
    if not np.isfinite(limit):
        while not (reached := grown(high) | ~np.isfinite(shown)).all():
            high = np.where(reached, high, 2 * high)
    for done in range(_BISECTIONS):
        room = limit - high if np.isfinite(limit) else high
        if done % _AT_ONCE == 0 and not (high - low > _SURE * room).any():
            break
        middle = (low + high) / 2
        above = grown(middle)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    scale = np.divide(high, shown, out=np.ones_like(shown), where=shown > 0)
    return points * scale[:, None]
