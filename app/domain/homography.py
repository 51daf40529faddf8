"""Homographies between a plane of the world and the image, for comparison with the camera.

The paper (Homography): landmarks are projected onto an interim plane, `k_2d = A^T k_3d`, and one
matrix H maps the plane to the image, `x_1 = H x_2`. Two planes are compared: the tangent plane of
the water surface, and the plane of the landmarks' two first principal axes (PCA). Whatever height
the projection throws away comes back as error: it is shown beside PnP to say why PnP is used.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.keypoints import Keypoints
from app.domain.least_squares import minimised

_UNKNOWNS = 8  # H without its last entry, which is 1
_FEWEST = 4
_DEGENERATE = 1e-9  # of the largest singular value: two solutions are as good as each other
_SETTLED_PX = 1e-10

Axes = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Homography:
    """H (3, 3), from metres in the interim plane to pixels.

    Plane coordinates are `A^T (X - origin)` with the plane's two unit vectors as columns of
    `A` (3, 2) and `origin_in_world` (3,), the landmarks' centroid, where H has its 1.
    """

    A: FloatArray
    origin_in_world: FloatArray
    H: FloatArray

    def project(self, points_in_world: FloatArray) -> FloatArray:
        """Pixels (n, 2) of world points (n, 3), NaN at the plane's horizon and beyond it."""
        in_plane = (points_in_world - self.origin_in_world) @ self.A
        homogeneous = np.column_stack([in_plane, np.ones(len(in_plane))]) @ self.H.T
        ahead = homogeneous[:, 2] > 0  # as at the origin
        pixels: FloatArray = np.full((len(in_plane), 2), np.nan)
        pixels[ahead] = homogeneous[ahead, :2] / homogeneous[ahead, 2:]
        return pixels


def water_axes(_points_in_world: FloatArray) -> FloatArray:
    """Span the tangent plane of the water in an ENU frame: A (3, 2) of east and north."""
    return np.eye(3)[:, :2]


def principal_axes(points_in_world: FloatArray) -> FloatArray:
    """Span the plane along which points (n, 3) vary most: A (3, 2) of two axes."""
    _, _, axes = np.linalg.svd(points_in_world - points_in_world.mean(axis=0))
    return np.asarray(axes[:2].T, dtype=np.float64)


def fit_homographies(
    axes: Axes, keypoints: Keypoints, chosen: Iterable[npt.NDArray[np.bool_]]
) -> list[Homography | None]:
    """Fit H to the least squared reprojection error of each choice (n,) of the keypoints.

    `axes` spans the interim plane of the chosen points. None where they do not determine H.
    """
    plans = [_plan(axes, keypoints[used], used) for used in chosen]
    solvable = [plan for plan in plans if plan is not None]
    fitted = iter(_fitted(keypoints, solvable))
    return [None if plan is None else next(fitted) for plan in plans]


@dataclass(frozen=True, eq=False)
class _Plan:
    """A choice (n,) of keypoints with its plane, the scale that makes numbers small, a first H.

    `first` maps scaled plane coordinates to pixels scaled and shifted likewise.
    """

    used: npt.NDArray[np.bool_]
    A: FloatArray
    origin: FloatArray
    scale_m: float
    centre_px: FloatArray
    scale_px: float
    first: FloatArray


def _plan(axes: Axes, keypoints: Keypoints, used: npt.NDArray[np.bool_]) -> _Plan | None:
    """Choose the plane and solve the linear equations of H (Hartley's normalised DLT)."""
    if len(keypoints) < _FEWEST:
        return None
    A, origin = axes(keypoints.points_in_world), keypoints.points_in_world.mean(axis=0)
    in_plane = (keypoints.points_in_world - origin) @ A
    centre_px = keypoints.pixels_px.mean(axis=0)
    shifted = keypoints.pixels_px - centre_px
    scale_m, scale_px = (float(np.sqrt((one**2).sum(axis=1).mean())) for one in (in_plane, shifted))
    if scale_m == 0 or scale_px == 0:
        return None
    x, y = (in_plane / scale_m).T
    u, v = (shifted / scale_px).T
    zero, one = np.zeros_like(x), np.ones_like(x)
    equations = np.vstack(
        [
            np.column_stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u]),
            np.column_stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v]),
        ]
    )
    _, extents, rows = np.linalg.svd(equations)
    first = rows[8].reshape(3, 3)
    if extents[7] < _DEGENERATE * extents[0] or abs(first[2, 2]) < _DEGENERATE:
        return None
    return _Plan(used, A, origin, scale_m, centre_px, scale_px, first / first[2, 2])


def _fitted(keypoints: Keypoints, plans: Sequence[_Plan]) -> list[Homography | None]:
    """Refine all first solutions side by side."""
    if not plans:
        return []
    fits = _Fits(
        np.stack([(keypoints.points_in_world - p.origin) @ p.A / p.scale_m for p in plans]),
        np.stack([(keypoints.pixels_px - p.centre_px) / p.scale_px for p in plans]),
        np.stack([p.used for p in plans]),
    )
    tolerance = _SETTLED_PX / max(plan.scale_px for plan in plans)
    found = minimised(fits, np.stack([plan.first.ravel()[:_UNKNOWNS] for plan in plans]), tolerance)
    return [
        _unscaled(plan, np.append(H, 1.0).reshape(3, 3))
        for plan, H in zip(plans, found, strict=True)
    ]


def _unscaled(plan: _Plan, H: FloatArray) -> Homography | None:
    to_pixels = np.array(
        [
            [plan.scale_px, 0, plan.centre_px[0]],
            [0, plan.scale_px, plan.centre_px[1]],
            [0, 0, 1],
        ]
    )
    H = to_pixels @ H @ np.diag([1 / plan.scale_m, 1 / plan.scale_m, 1.0])
    return Homography(plan.A, plan.origin, H) if np.isfinite(H).all() else None


@dataclass(frozen=True, eq=False)
class _Fits:
    """B fits: plane coordinates and pixels (B, n, 2), and which of them are used (B, n)."""

    in_plane: FloatArray
    pixels: FloatArray
    used: npt.NDArray[np.bool_]

    def linearised(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (B, 2n) and their derivatives (B, 2n, 8) by H's entries (B, 8)."""
        count, n, _ = self.in_plane.shape
        H = np.concatenate([state, np.ones((count, 1))], axis=1).reshape(count, 3, 3)
        points = np.concatenate([self.in_plane, np.ones((count, n, 1))], axis=2)
        homogeneous = points @ np.swapaxes(H, 1, 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / homogeneous[..., 2]
            shown = homogeneous[..., :2] * inverse[..., None]
            J: FloatArray = np.zeros((count, n, 2, _UNKNOWNS))
            J[..., 0, 0:3] = J[..., 1, 3:6] = points * inverse[..., None]
            J[..., 6:8] = -shown[..., :, None] * (self.in_plane * inverse[..., None])[..., None, :]
            residuals = shown - self.pixels
        residuals[~np.isfinite(residuals)] = np.inf
        residuals[~self.used], J[~self.used] = 0.0, 0.0
        return residuals.reshape(count, -1), J.reshape(count, -1, _UNKNOWNS)

    def moved(self, state: FloatArray, steps: FloatArray) -> FloatArray:
        """Apply a step to each."""
        return state + steps

    def chosen(
        self, accepted: npt.NDArray[np.bool_], new: FloatArray, old: FloatArray
    ) -> FloatArray:
        """Take the new ones where they are better."""
        return np.where(accepted[:, None], new, old)
