"""What an editor draws of a registration: its camera, horizon, water grid and heat map, as JSON."""

from dataclasses import dataclass, field

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Intrinsics
from app.domain.guidance import REFERENCE_RANGE_M
from app.domain.pnp import Priors
from app.domain.registration import Registration, water_point_sigma_px
from app.domain.water_view import GridLine, WaterView
from app.registration.conversion import intrinsics_to_json
from app.registration.preview_schemas import (
    Cells,
    GridLineOut,
    HeatMapOut,
    HorizonOut,
    PriorsOut,
    SolvedCameraOut,
)
from app.registration.schemas import IntrinsicsOut
from app.sites.fields import Place, matrix_of

_REFINED = 8  # unknowns when focal length and k1 are among them


@dataclass(frozen=True, slots=True)
class Drawings:
    """Lines and cells over the image; none without a camera above the water."""

    horizon: HorizonOut | None = None
    grid: list[GridLineOut] = field(default_factory=list)
    heat_map: HeatMapOut | None = None


def draw(found: Registration, water: WaterView) -> Drawings:
    """Draw the water as the camera sees it."""
    heat_map = None
    if found.parameter_covariance is not None:
        heat = water.heat_map(found.parameter_covariance)
        heat_map = HeatMapOut(
            columns=heat.sigma_px.shape[1],
            rows=heat.sigma_px.shape[0],
            cell_px=list(heat.cell_px),
            sigma_px=_cells(heat.sigma_px),
            sigma_m=_cells(heat.sigma_m),
            range_m=_cells(heat.range_m),
        )
    return Drawings(
        HorizonOut(distance_m=water.horizon_m, lines=water.horizon()),
        [_grid_line(line) for line in water.grid()],
        heat_map,
    )


def camera_out(found: Registration, water: WaterView) -> SolvedCameraOut | None:
    """Show the camera that PnP found."""
    camera, center, rotvec = found.camera, found.center, found.rotvec_cam_from_enu
    covariance, parameters = found.covariance, found.parameter_covariance
    if camera is None or center is None or rotvec is None:
        return None
    if covariance is None or parameters is None or found.threshold_px is None:
        return None
    heading, pitch, roll = _attitude_deg(camera.R_cam_from_world @ water.axes.T)
    refined = len(parameters) == _REFINED
    priors = Priors()
    water_up_m = center.height_m - water.height_m - found.frame.origin.height_m
    return SolvedCameraOut(
        rotation=rotvec.tolist(),
        R_cam_from_enu=camera.R_cam_from_world.tolist(),
        center=Place(lat_deg=center.lat_deg, lon_deg=center.lon_deg, height_m=center.height_m),
        center_enu_m=camera.center_in_world.tolist(),
        center_sigma_m=np.sqrt(np.diag(covariance)[3:]).tolist(),
        height_above_water_m=water.height_m,
        heading_deg=heading,
        pitch_deg=pitch,
        roll_deg=roll,
        intrinsics=_intrinsics(found.intrinsics),
        refined_from=_intrinsics(found.refined_from) if found.refined_from else None,
        focal_sigma_pct=float(100 * np.sqrt(parameters[6, 6])) if refined else None,
        k1_sigma=float(np.sqrt(parameters[7, 7])) if refined else None,
        covariance=covariance.tolist(),
        parameter_covariance=parameters.tolist(),
        threshold_px=found.threshold_px,
        is_widened=found.is_widened,
        priors=PriorsOut(pixel_px=priors.pixel_px, focal=priors.focal, k1=priors.k1),
        water_sigma_px=water_point_sigma_px(found, REFERENCE_RANGE_M, water_up_m),
        water_sigma_range_m=REFERENCE_RANGE_M,
    )


def finite(value: float) -> float | None:
    """Return a number, or None for NaN, which JSON does not know."""
    return float(value) if np.isfinite(value) else None


def _intrinsics(intrinsics: Intrinsics) -> IntrinsicsOut:
    values = intrinsics_to_json(intrinsics)
    return IntrinsicsOut(K=matrix_of(values), **values)


def _attitude_deg(axes_in_local: FloatArray) -> tuple[float, float, float]:
    """Heading (clockwise from north), pitch (up) and roll (clockwise, seen from behind)."""
    right, _, forward = axes_in_local
    heading = np.degrees(np.arctan2(forward[0], forward[1])) % 360
    pitch = np.degrees(np.arcsin(np.clip(forward[2], -1, 1)))
    # A level camera's right hand is horizontal.
    level = np.cross(forward, [0.0, 0.0, 1.0])
    up = np.cross(level, forward)
    roll = np.degrees(np.arctan2(-right @ up, right @ level))
    return float(heading), float(pitch), float(roll)


def _grid_line(line: GridLine) -> GridLineOut:
    if line.kind == "range":
        label = f"{line.value:g} m" if line.value < 1000 else f"{line.value / 1000:g} km"
        return GridLineOut(
            kind="range", range_m=line.value, label=label, lines=line.lines, at_px=line.label_px
        )
    return GridLineOut(
        kind="bearing",
        bearing_deg=line.value,
        label=f"{line.value:g}°",
        lines=line.lines,
        at_px=line.label_px,
    )


def _cells(values: FloatArray) -> Cells:
    return [
        [round(float(value), 4) if np.isfinite(value) else None for value in row] for row in values
    ]
