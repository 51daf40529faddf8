"""Levenberg-Marquardt for many small problems of one kind at once.

Leaving each keypoint out in turn means as many fits as there are keypoints, all alike. Done one
after the other, most of the time goes into calling NumPy; done side by side, with one more axis on
every array, forty cost little more than one. Each problem keeps its own damping and its own end.

The fits end far below anything a pixel can mean, so that whoever minimises the same cost by other
means (the browser, while a keypoint is dragged) arrives at the same figures.
"""

from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray

_MOST_STEPS = 100
_FIRST_DAMPING = 1e-3
_LEAST_DAMPING = 1e-12
_GIVING_UP = 1e12  # damping at which no step downhill is left
_NEARLY_UNDAMPED = 1e-5  # a short step proves nothing while damping keeps it short
_ROUNDING = 1e-12  # relative rise that is not told from none
State = TypeVar("State")


class Problems(Protocol[State]):
    """B problems of one kind: m residuals in units of their sigma, p unknowns each."""

    def linearised(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Residuals (B, m), infinite where there are none, and derivatives (B, m, p)."""
        ...

    def moved(self, state: State, steps: FloatArray) -> State:
        """Apply the steps (B, p)."""
        ...

    def chosen(self, accepted: npt.NDArray[np.bool_], new: State, old: State) -> State:
        """Take the new state where `accepted` (B,) holds, else the old one."""
        ...


def minimised(problems: Problems[State], start: State, tolerance: float) -> State:
    """Move every problem downhill until a step changes no residual by more than `tolerance`.

    A problem whose start has no finite cost stays where it is.
    """
    state = start
    residuals, J = problems.linearised(state)
    cost = np.einsum("bm,bm->b", residuals, residuals)
    damping = np.full(len(cost), _FIRST_DAMPING)
    done = ~np.isfinite(cost)
    for _ in range(_MOST_STEPS):
        if done.all():
            break
        steps = _steps(residuals, J, damping, done)
        moved = problems.moved(state, steps)
        moved_residuals, moved_J = problems.linearised(moved)
        moved_cost = np.einsum("bm,bm->b", moved_residuals, moved_residuals)
        accepted = ~done & (moved_cost <= cost * (1 + _ROUNDING))
        change = np.abs((J @ steps[:, :, None])[:, :, 0]).max(axis=1)
        settled = accepted & (change <= tolerance) & (damping <= _NEARLY_UNDAMPED)
        state = problems.chosen(accepted, moved, state)
        residuals = np.where(accepted[:, None], moved_residuals, residuals)
        J = np.where(accepted[:, None, None], moved_J, J)
        cost = np.where(accepted, moved_cost, cost)
        damping = np.where(accepted, np.maximum(damping / 10, _LEAST_DAMPING), damping * 10)
        done = done | settled | (damping > _GIVING_UP)
    return state


def _steps(
    residuals: FloatArray, J: FloatArray, damping: FloatArray, done: npt.NDArray[np.bool_]
) -> FloatArray:
    """Solve the damped normal equations (B, p, p); zero where nothing is to be done."""
    normal = np.swapaxes(J, 1, 2) @ J
    diagonal = np.einsum("bpp->bp", normal) + 1e-15
    # Scaled to a unit diagonal: metres and radians differ by thousands.
    scale = 1 / np.sqrt(diagonal)
    scaled = normal * scale[:, :, None] * scale[:, None, :]
    scaled += damping[:, None, None] * np.eye(scaled.shape[1])
    gradient = np.einsum("bmp,bm->bp", J, residuals) * scale
    scaled[done], gradient[done] = np.eye(scaled.shape[1]), 0.0
    steps: FloatArray = -np.linalg.solve(scaled, gradient[:, :, None])[:, :, 0] * scale
    return steps
