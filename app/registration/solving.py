"""From a viewport's keypoints to a registration's row, without a database.

Reading the problem, solving it and storing the answer are three steps, because solving takes its
time and a writing transaction must not wait for it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.homography import Homography
from app.domain.keypoints import Keypoints, keypoints_in
from app.domain.registration import Registration as Solution
from app.domain.registration import (
    RegistrationMethod as DomainMethod,
)
from app.domain.registration import (
    register_given,
    register_homography,
    register_pnp,
)
from app.domain.rotations import rotvec_from_matrix
from app.errors import Invalid
from app.registration.conversion import intrinsics_to_json
from app.registration.schemas import GivenIntrinsics, RegistrationIn
from app.sites.fields import matrix_of
from app.tables.registration import Keypoint, KeypointRole, Registration, RegistrationMethod

# Published matrices are printed with few digits.
ORTHONORMAL = 1e-4


@dataclass(frozen=True, slots=True)
class Problem:
    """A viewport to register: its site's frame, its camera's intrinsics, its keypoints.

    `water_level_m` is the height of the water above the ellipsoid.
    """

    viewport_id: int
    frame: EnuFrame
    water_level_m: float
    intrinsics: Intrinsics
    keypoints: Sequence[Keypoint]

    @property
    def water_up_m(self) -> float:
        """The height of the water in the site's frame."""
        return self.water_level_m - self.frame.origin.height_m


def solve(problem: Problem, asked: RegistrationIn) -> Registration:
    """Return the registration asked for, not yet stored.

    Raises Invalid with the reason and the fix for keypoints that carry no camera, or for a given
    pose that is none.
    """
    control = [point for point in problem.keypoints if point.role is KeypointRole.CONTROL]
    try:
        solution = _solution(problem, asked, _seen(problem.frame, control))
    except ValueError as error:
        field = "rotation" if asked.method is RegistrationMethod.GIVEN else "keypoints"
        raise Invalid.field(field, str(error)) from error
    return _row(problem, asked.method, solution, control)


def _seen(frame: EnuFrame, keypoints: Sequence[Keypoint]) -> Keypoints:
    return keypoints_in(
        frame,
        [
            (
                Geodetic(point.landmark.lat_deg, point.landmark.lon_deg, point.landmark.height_m),
                (point.u_px, point.v_px),
            )
            for point in keypoints
        ],
        [point.landmark.name for point in keypoints],
    )


def _solution(problem: Problem, asked: RegistrationIn, control: Keypoints) -> Solution:
    match asked.method:
        case RegistrationMethod.PNP:
            return register_pnp(
                problem.frame, problem.intrinsics, control, water_level_m=problem.water_up_m
            )
        case RegistrationMethod.GIVEN:
            return _given(problem, asked, control)
        case method:
            return register_homography(
                problem.frame, problem.intrinsics, control, DomainMethod(method.value)
            )


def _given(problem: Problem, asked: RegistrationIn, control: Keypoints) -> Solution:
    if asked.center is None or asked.rotation is None:
        raise ValueError("method `given` needs rotation and center")
    return register_given(
        problem.frame,
        _intrinsics(problem.intrinsics, asked.intrinsics),
        _rotvec(asked.rotation),
        Geodetic(asked.center.lat_deg, asked.center.lon_deg, asked.center.height_m),
        control,
    )


def _rotvec(rotation: Sequence[float] | Sequence[Sequence[float]]) -> FloatArray:
    values = np.array(rotation, dtype=np.float64)
    if values.shape == (3,):
        return values
    if np.abs(values @ values.T - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(values) < 0:
        raise ValueError("is no rotation matrix: rows must be orthonormal and the determinant +1")
    return rotvec_from_matrix(values)


def _intrinsics(own: Intrinsics, given: GivenIntrinsics | None) -> Intrinsics:
    """Return the given intrinsics, with the camera's own in place of what was left out."""
    if given is None:
        return own
    size = (given.width_px or own.width_px, given.height_px or own.height_px)
    if size != (own.width_px, own.height_px):
        raise Invalid.field(
            "intrinsics",
            f"are for {size[0]} x {size[1]} px, but the camera takes {own.width_px} x "
            f"{own.height_px} px; scale them, or register a camera of that size",
        )
    values = intrinsics_to_json(own) | given.pinhole()
    distortion = own.distortion if given.distortion is None else np.array(given.distortion)
    return Intrinsics(own.width_px, own.height_px, np.array(matrix_of(values)), distortion)


def _row(
    problem: Problem,
    method: RegistrationMethod,
    solution: Solution,
    control: Sequence[Keypoint],
) -> Registration:
    center, rotvec = solution.center, solution.rotvec_cam_from_enu
    covariance = solution.covariance
    return Registration(
        viewport_id=problem.viewport_id,
        method=method,
        rotation=None if rotvec is None else rotvec.tolist(),
        center_lat_deg=center and center.lat_deg,
        center_lon_deg=center and center.lon_deg,
        center_height_m=center and center.height_m,
        intrinsics=intrinsics_to_json(solution.intrinsics),
        homography=_projection(solution.homography),
        covariance=None if covariance is None else covariance.tolist(),
        mae_px=solution.mae_px,
        mae_pct_width=solution.mae_pct_width,
        mae_pct_height=solution.mae_pct_height,
        # Nothing is fitted to the keypoints of a given pose, so there is nothing to leave out.
        leave_one_out_px=None if method is RegistrationMethod.GIVEN else solution.leave_one_out_px,
        residuals=_residuals(problem, solution, control),
        warnings=[*solution.warnings, *(one.message for one in solution.suspicions)],
    )


def _projection(homography: Homography | None) -> list[list[float]] | None:
    """Return a homography together with its plane: 3 x 4, from homogeneous ENU metres to px."""
    if homography is None:
        return None
    plane_from_enu = np.zeros((3, 4))
    plane_from_enu[:2, :3] = homography.A.T
    plane_from_enu[:2, 3] = -homography.A.T @ homography.origin_in_world
    plane_from_enu[2, 3] = 1.0
    combined: list[list[float]] = (homography.H @ plane_from_enu).tolist()
    return combined


def _residuals(
    problem: Problem, solution: Solution, control: Sequence[Keypoint]
) -> list[dict[str, Any]]:
    """Return every keypoint's residual, those that took no part in the solution too."""
    place = {point.id: index for index, point in enumerate(control)}
    points = list(problem.keypoints)
    projected = _project(solution, _seen(problem.frame, points).points_in_world)
    rows = []
    for point, (u_px, v_px) in zip(points, projected, strict=True):
        index = place.get(point.id)
        du_px, dv_px = _finite(u_px - point.u_px), _finite(v_px - point.v_px)
        rows.append(
            {
                "keypoint_id": point.id,
                "landmark_id": point.landmark_id,
                "name": point.landmark.name,
                "role": point.role.value,
                "u_px": point.u_px,
                "v_px": point.v_px,
                "du_px": du_px,
                "dv_px": dv_px,
                "error_px": _finite(np.hypot(u_px - point.u_px, v_px - point.v_px)),
                "leave_one_out_px": None
                if index is None
                else _finite(solution.leave_one_out_distances_px[index]),
                "is_used": index is not None and bool(solution.inliers[index]),
            }
        )
    return rows


def _project(solution: Solution, points_in_enu: FloatArray) -> FloatArray:
    if solution.camera is not None:
        return solution.camera.project(points_in_enu)
    if solution.homography is not None:
        return solution.homography.project(points_in_enu)
    return np.full((len(points_in_enu), 2), np.nan)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
