"""The solve preview: all methods side by side, with what an editor draws. Nothing is stored."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.keypoints import Keypoints, RegistrationError, Suspicion, keypoints_in
from app.domain.registration import Registration, register_homography, register_pnp
from app.domain.registration import RegistrationMethod as DomainMethod
from app.domain.water_view import WaterView
from app.errors import Invalid
from app.registration.preview_drawing import Drawings, camera_out, draw, finite
from app.registration.preview_readiness import readiness_out
from app.registration.preview_schemas import (
    SeenLandmarkOut,
    SolvedMethodOut,
    SolvedPointOut,
    SolveIn,
    SolveOut,
    SolvePointOut,
    SuspicionOut,
)
from app.sites.fields import Place
from app.tables.registration import KeypointRole, RegistrationMethod


@dataclass(frozen=True, slots=True)
class EditedPoint:
    """A keypoint being edited, its landmark's place settled."""

    key: str
    name: str
    landmark_id: int | None
    place: Geodetic
    u_px: float
    v_px: float
    role: KeypointRole


@dataclass(frozen=True, slots=True)
class KnownLandmark:
    """A landmark of the site."""

    id: int
    name: str
    place: Geodetic


@dataclass(frozen=True, slots=True)
class Preview:
    """All that is needed to solve without a database."""

    frame: EnuFrame
    water_level_m: float
    intrinsics: Intrinsics
    points: Sequence[EditedPoint]
    landmarks: Sequence[KnownLandmark]


@dataclass(frozen=True, eq=False)
class _Attempt:
    """A method's registration, or why there is none."""

    method: RegistrationMethod
    found: Registration | None
    error: RegistrationError | None


def solve_preview(preview: Preview, asked: SolveIn) -> SolveOut:
    """Solve all methods asked for. Raises Invalid only for numbers that are none."""
    try:
        everyone = _keypoints(preview, preview.points)
        control = _keypoints(preview, _control(preview))
    except ValueError as error:
        raise Invalid.field("keypoints", str(error)) from error
    attempts = [
        _attempt(preview, control, RegistrationMethod(method))
        for method in dict.fromkeys(asked.methods)
    ]
    pnp = next((one for one in attempts if one.method is RegistrationMethod.PNP), None)
    found = pnp.found if pnp else None
    water = _water(preview, found)
    drawings = draw(found, water) if asked.overlays and found and water else Drawings()
    origin = preview.frame.origin
    return SolveOut(
        water_level_m=preview.water_level_m,
        origin=Place(lat_deg=origin.lat_deg, lon_deg=origin.lon_deg, height_m=origin.height_m),
        points=_points(preview, everyone, found),
        methods=[_method(preview, everyone, attempt) for attempt in attempts],
        suspicions=_suspicions(preview, pnp),
        camera=camera_out(found, water) if found and water else None,
        horizon=drawings.horizon,
        grid=drawings.grid,
        heat_map=drawings.heat_map,
        landmarks=_landmarks(preview, found) if asked.overlays else [],
        readiness=readiness_out(
            control, preview.intrinsics, found, pnp.error if pnp else None, water
        ),
    )


def _control(preview: Preview) -> list[EditedPoint]:
    return [point for point in preview.points if point.role is KeypointRole.CONTROL]


def _keypoints(preview: Preview, points: Sequence[EditedPoint]) -> Keypoints:
    seen = [(point.place, (point.u_px, point.v_px)) for point in points]
    return keypoints_in(preview.frame, seen, [point.name for point in points])


def _attempt(preview: Preview, control: Keypoints, method: RegistrationMethod) -> _Attempt:
    frame, intrinsics = preview.frame, preview.intrinsics
    try:
        if method is RegistrationMethod.PNP:
            water_up_m = preview.water_level_m - frame.origin.height_m
            found = register_pnp(frame, intrinsics, control, water_level_m=water_up_m)
        else:
            found = register_homography(frame, intrinsics, control, DomainMethod(method.value))
    except RegistrationError as error:
        return _Attempt(method, None, error)
    return _Attempt(method, found, None)


def _water(preview: Preview, found: Registration | None) -> WaterView | None:
    if found is None or found.camera is None:
        return None
    try:
        return WaterView.of(found.camera, preview.frame, preview.water_level_m)
    except ValueError:  # at the waterline: nothing to draw
        return None


def _points(
    preview: Preview, everyone: Keypoints, found: Registration | None
) -> list[SolvePointOut]:
    ranges: FloatArray | None = None
    if found is not None and found.camera is not None:
        ranges = np.linalg.norm(
            everyone.points_in_world - found.camera.center_in_world, axis=1
        ).astype(np.float64)
    return [
        SolvePointOut(
            key=point.key,
            name=point.name,
            role=point.role,
            landmark_id=point.landmark_id,
            u_px=point.u_px,
            v_px=point.v_px,
            enu_m=everyone.points_in_world[index].tolist(),
            range_m=None if ranges is None else float(ranges[index]),
        )
        for index, point in enumerate(preview.points)
    ]


def _method(preview: Preview, everyone: Keypoints, attempt: _Attempt) -> SolvedMethodOut:
    found = attempt.found
    if found is None:
        return SolvedMethodOut(method=attempt.method, error=str(attempt.error))
    projected = everyone.pixels_px + np.nan
    for model in (found.camera, found.homography):
        if model is not None:  # a solution has one of the two
            projected = model.project(everyone.points_in_world)
    number = {point.key: index for index, point in enumerate(_control(preview))}
    points = [
        _solved_point(point, projected[index], found, number.get(point.key))
        for index, point in enumerate(preview.points)
    ]
    checks = [
        solved.error_px
        for point, solved in zip(preview.points, points, strict=True)
        if point.role is KeypointRole.CHECK and solved.error_px is not None
    ]
    return SolvedMethodOut(
        method=attempt.method,
        mae_px=found.mae_px,
        mae_inliers_px=found.mae_inliers_px,
        mae_pct_width=found.mae_pct_width,
        mae_pct_height=found.mae_pct_height,
        leave_one_out_px=found.leave_one_out_px,
        check_mae_px=sum(checks) / len(checks) if checks else None,
        points=points,
        warnings=found.warnings,
    )


def _solved_point(
    point: EditedPoint, pixel: FloatArray, found: Registration, number: int | None
) -> SolvedPointOut:
    du_px, dv_px = pixel[0] - point.u_px, pixel[1] - point.v_px
    left_out = None if number is None else finite(found.leave_one_out_distances_px[number])
    return SolvedPointOut(
        key=point.key,
        u_px=finite(pixel[0]),
        v_px=finite(pixel[1]),
        du_px=finite(du_px),
        dv_px=finite(dv_px),
        error_px=finite(np.hypot(du_px, dv_px)),
        leave_one_out_px=left_out,
        is_used=number is not None and bool(found.inliers[number]),
    )


def _suspicions(preview: Preview, pnp: _Attempt | None) -> list[SuspicionOut]:
    if pnp is None:
        return []
    said: Sequence[Suspicion] = pnp.error.suspicions if pnp.error else ()
    if pnp.found is not None:
        said = pnp.found.suspicions
    control = _control(preview)
    return [
        SuspicionOut(
            kind=one.kind,
            keys=[control[index].key for index in one.indices],
            message=one.message,
        )
        for one in said
    ]


def _landmarks(preview: Preview, found: Registration | None) -> list[SeenLandmarkOut]:
    """Project all landmarks of the site; those inside the image are seen."""
    if found is None or found.camera is None or not preview.landmarks:
        return []
    camera, image = found.camera, preview.intrinsics
    placed = {point.landmark_id for point in preview.points}
    placed_names = {point.name for point in preview.points}
    points = np.array(
        [
            preview.frame.position(one.place.lat_deg, one.place.lon_deg, one.place.height_m)
            for one in preview.landmarks
        ]
    )
    pixels = camera.project(points)
    ranges = np.linalg.norm(points - camera.center_in_world, axis=1)
    size = (image.width_px - 0.5, image.height_px - 0.5)
    inside = ((pixels >= -0.5) & (pixels < size)).all(axis=1)
    return [
        SeenLandmarkOut(
            landmark_id=preview.landmarks[index].id,
            name=preview.landmarks[index].name,
            u_px=float(pixels[index, 0]),
            v_px=float(pixels[index, 1]),
            range_m=float(ranges[index]),
            is_placed=preview.landmarks[index].id in placed
            or preview.landmarks[index].name in placed_names,
        )
        for index in np.flatnonzero(inside).tolist()
    ]
