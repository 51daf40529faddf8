"""The paper's projection table: how well each method puts landmarks where they are seen.

Every viewport's present control keypoints are solved by all methods, as the paper did, stored
solution or not. A figure is the mean over all keypoints of all viewports, so that a viewport with
many keypoints counts for more; percentages relate each error to its own image.
"""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock

import numpy as np
from sqlalchemy.orm import Session

from app.errors import Invalid
from app.evaluation.selection import Selection
from app.paging import Paging
from app.registration import service as registration
from app.registration.schemas import RegistrationIn
from app.registration.solving import Problem, solve
from app.runs import service as runs
from app.tables.registration import KeypointRole, RegistrationMethod
from app.tables.sites import Viewport

METHODS = (
    RegistrationMethod.PNP,
    RegistrationMethod.HOMOGRAPHY_WATER,
    RegistrationMethod.HOMOGRAPHY_PCA,
)
MOST_VIEWPORTS = 200
_KEPT = 2000  # solved viewports and methods that are remembered


@dataclass(frozen=True, slots=True)
class Solved:
    """Errors (px) of one viewport's keypoints by one method, or why there are none."""

    errors_px: tuple[float, ...]
    left_out_px: tuple[float, ...]
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class ViewportErrors:
    """One viewport: its image's size, its control keypoints, and what each method makes of them."""

    viewport: Viewport
    width_px: int
    height_px: int
    control: int
    by_method: dict[RegistrationMethod, Solved]


@dataclass(frozen=True, slots=True)
class MethodFigures:
    """A method over all viewports it could solve; None where it could solve none."""

    method: RegistrationMethod
    viewports: int
    keypoints: int
    mae_px: float | None
    mae_pct_width: float | None
    mae_pct_height: float | None
    leave_one_out_px: float | None


@dataclass(frozen=True, slots=True)
class ProjectionFigures:
    """The table with the viewports behind it; `considered` counts those of the selection."""

    methods: list[MethodFigures]
    viewports: list[ViewportErrors]
    considered: int


def projection_figures(session: Session, chosen: Selection) -> ProjectionFigures:
    """Solve the viewports of a selection by all methods and average."""
    viewports = _viewports(session, chosen)
    problems = [(one, registration.problem_of(session, one)) for one in viewports]
    solved = [_errors(one, problem) for one, problem in problems if problem.keypoints]
    return ProjectionFigures(
        [_figures(method, solved) for method in METHODS], solved, len(viewports)
    )


def _viewports(session: Session, chosen: Selection) -> Sequence[Viewport]:
    asked = chosen.asked
    if asked.run_id is not None:
        return [runs.get_run(session, asked.run_id).viewport]
    if asked.viewport_id is not None:
        return [registration.get_viewport(session, asked.viewport_id)]
    found, _ = registration.list_viewports(
        session,
        chosen.site_ids,
        Paging(limit=MOST_VIEWPORTS, after=None),
        camera_id=asked.camera_id,
        site_id=asked.site_id,
    )
    return found


def _errors(viewport: Viewport, problem: Problem) -> ViewportErrors:
    image = problem.intrinsics
    control = sum(point.role is KeypointRole.CONTROL for point in problem.keypoints)
    return ViewportErrors(
        viewport=viewport,
        width_px=image.width_px,
        height_px=image.height_px,
        control=control,
        by_method={method: _remembered.solve(problem, method) for method in METHODS},
    )


def _figures(method: RegistrationMethod, viewports: Sequence[ViewportErrors]) -> MethodFigures:
    used = [(one, one.by_method[method]) for one in viewports if one.by_method[method].errors_px]
    errors = np.array([error for _, solved in used for error in solved.errors_px])
    of_width = [error / one.width_px for one, solved in used for error in solved.errors_px]
    of_height = [error / one.height_px for one, solved in used for error in solved.errors_px]
    left_out = [error for _, solved in used for error in solved.left_out_px]
    return MethodFigures(
        method=method,
        viewports=len(used),
        keypoints=len(errors),
        mae_px=float(errors.mean()) if len(errors) else None,
        mae_pct_width=100 * float(np.mean(of_width)) if of_width else None,
        mae_pct_height=100 * float(np.mean(of_height)) if of_height else None,
        leave_one_out_px=float(np.mean(left_out)) if left_out else None,
    )


class _Remembered:
    """Solutions by what they were solved from: pages ask for the same ones again and again."""

    def __init__(self) -> None:
        self._solved: OrderedDict[object, Solved] = OrderedDict()
        self._lock = Lock()

    def solve(self, problem: Problem, method: RegistrationMethod) -> Solved:
        """Return a method's errors for a viewport's keypoints."""
        key = _fingerprint(problem, method)
        with self._lock:
            known = self._solved.get(key)
        if known is not None:
            return known
        solved = _solve(problem, method)
        with self._lock:
            self._solved[key] = solved
            while len(self._solved) > _KEPT:
                self._solved.popitem(last=False)
        return solved


_remembered = _Remembered()


def _fingerprint(problem: Problem, method: RegistrationMethod) -> object:
    origin = problem.frame.origin
    return (
        method,
        (origin.lat_deg, origin.lon_deg, origin.height_m, problem.water_level_m),
        problem.intrinsics.K.tobytes(),
        problem.intrinsics.distortion.tobytes(),
        (problem.intrinsics.width_px, problem.intrinsics.height_px),
        tuple(
            (
                point.landmark.name,
                point.landmark.lat_deg,
                point.landmark.lon_deg,
                point.landmark.height_m,
                point.u_px,
                point.v_px,
                point.role,
            )
            for point in problem.keypoints
        ),
    )


def _solve(problem: Problem, method: RegistrationMethod) -> Solved:
    try:
        row = solve(problem, RegistrationIn(method=method))
    except Invalid as error:
        return Solved((), (), error.fields[0].message if error.fields else error.detail)
    control = [one for one in row.residuals if one["role"] == KeypointRole.CONTROL.value]
    errors = tuple(one["error_px"] for one in control if one["error_px"] is not None)
    left_out = tuple(
        one["leave_one_out_px"] for one in control if one["leave_one_out_px"] is not None
    )
    return Solved(errors, left_out)
