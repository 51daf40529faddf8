"""Golden registrations: the figures that the browser's own fit must reach as well.

`QUAYMARK_WRITE_GOLDEN=1 pytest` writes the files anew, after a change of what is minimised.
"""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.keypoints import Keypoints
from app.domain.pnp import Priors
from app.domain.registration import (
    Registration,
    RegistrationMethod,
    RegistrationSettings,
    register_homography,
    register_pnp,
)
from app.domain.rotations import matrix_from_rotvec

GOLDEN = Path(__file__).resolve().parents[2] / "golden"
FRAME = EnuFrame(Geodetic(53.54, 9.98, 0.0))
K = np.array([[6570.0, 0, 1187], [0, 6590, 935], [0, 0, 1]])
CASES = {
    # name: points, wrong ones among them, k1 and further distortion, seed
    "few_points": (8, 0, [0.0, 0, 0, 0, 0], 1),
    "refined_lens": (14, 0, [-0.2, 0, 0, 0, 0], 2),
    "wrong_points": (14, 3, [-0.2, 0, 0, 0, 0], 3),
    "forty_points": (40, 1, [-0.2, 0, 0, 0, 0], 4),
    "known_lens": (9, 0, [-0.21, 0.1, 4e-4, -3e-4, 0.02], 5),
}


def _scene(name: str) -> tuple[Keypoints, Intrinsics]:
    """Give keypoints with 2 px of noise and the lens as the solver is told of it."""
    count, wrong, distortion, seed = CASES[name]
    rng = np.random.default_rng(seed)
    level = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    R = matrix_from_rotvec([np.radians(2.0), 0, 0.01]) @ level @ matrix_from_rotvec([0, 0, 0.7])
    truth = Camera(Intrinsics(2560, 1920, K, np.array(distortion)), R, np.array([40.0, -25, 31]))
    pixels = np.column_stack([rng.uniform(60, 2500, count), rng.uniform(60, 1860, count)])
    points = truth.center_in_world + truth.rays(pixels) * rng.uniform(100, 1500, (count, 1))
    pixels = truth.project(points) + rng.normal(0, 2, (count, 2))
    pixels[:wrong] += rng.uniform(60, 300, (wrong, 2))
    told = truth.intrinsics if name == "known_lens" else Intrinsics(2560, 1920, K)
    return Keypoints(points, pixels), told


def _lens(intrinsics: Intrinsics) -> dict[str, Any]:
    return {
        "width_px": intrinsics.width_px,
        "height_px": intrinsics.height_px,
        "fx_px": float(intrinsics.K[0, 0]),
        "fy_px": float(intrinsics.K[1, 1]),
        "cx_px": float(intrinsics.K[0, 2]),
        "cy_px": float(intrinsics.K[1, 2]),
        "distortion": intrinsics.distortion.tolist(),
    }


def _plane(keypoints: Keypoints, told: Intrinsics, method: RegistrationMethod) -> dict[str, Any]:
    found = register_homography(FRAME, told, keypoints, method)
    assert found.homography is not None
    return {
        "A": found.homography.A.tolist(),
        "origin": found.homography.origin_in_world.tolist(),
        "H": found.homography.H.tolist(),
        "projected_px": _listed(found.residuals_px + keypoints.pixels_px),
        "leave_one_out_px": _listed(found.leave_one_out_distances_px),
    }


def _listed(values: np.ndarray) -> list[Any]:
    """Give nested lists with None for NaN, which JSON does not know."""
    if values.ndim > 1:
        return [_listed(row) for row in values]
    return [None if np.isnan(value) else float(value) for value in values]


def _case(name: str) -> dict[str, Any]:
    keypoints, told = _scene(name)
    found = register_pnp(FRAME, told, keypoints, RegistrationSettings())
    camera, covariance = found.camera, found.parameter_covariance
    assert camera is not None
    assert covariance is not None
    priors, refined = Priors(), len(covariance) == 8
    away = matrix_from_rotvec([2e-3, -1e-3, 1e-3])
    return {
        "intrinsics": _lens(told),
        "priors": {"pixel_px": priors.pixel_px, "focal": priors.focal, "k1": priors.k1},
        "points_enu_m": keypoints.points_in_world.tolist(),
        "pixels_px": keypoints.pixels_px.tolist(),
        "used": found.inliers.tolist(),
        "refined_from": _lens(told) if refined else None,
        "start": {
            "R": (away @ camera.R_cam_from_world).tolist(),
            "C": (camera.center_in_world + np.array([0.5, -0.4, 0.3])).tolist(),
            "intrinsics": _lens(found.intrinsics),
        },
        "expected": _expected(found, keypoints, told),
    }


def _expected(found: Registration, keypoints: Keypoints, told: Intrinsics) -> dict[str, Any]:
    assert found.camera is not None
    assert found.parameter_covariance is not None
    return {
        "R": found.camera.R_cam_from_world.tolist(),
        "C": found.camera.center_in_world.tolist(),
        "intrinsics": _lens(found.intrinsics),
        "projected_px": _listed(found.residuals_px + keypoints.pixels_px),
        "errors_px": _listed(found.distances_px),
        "leave_one_out_px": _listed(found.leave_one_out_distances_px),
        "mae_px": found.mae_px,
        "mae_inliers_px": found.mae_inliers_px,
        "leave_one_out_mean_px": found.leave_one_out_px,
        "covariance": found.parameter_covariance.tolist(),
        "homography_water": _plane(keypoints, told, RegistrationMethod.HOMOGRAPHY_WATER),
        "homography_pca": _plane(keypoints, told, RegistrationMethod.HOMOGRAPHY_PCA),
    }


def _same(found: Any, kept: Any, where: str) -> None:
    if isinstance(kept, dict):
        assert found.keys() == kept.keys(), where
        for key, value in kept.items():
            _same(found[key], value, f"{where}.{key}")
    elif isinstance(kept, list):
        assert len(found) == len(kept), where
        for index, value in enumerate(kept):
            _same(found[index], value, f"{where}[{index}]")
    elif isinstance(kept, float):
        assert found == pytest.approx(kept, rel=1e-7, abs=1e-7), where
    else:
        assert found == kept, where


@pytest.mark.parametrize("name", CASES)
def test_solutions_are_as_they_were_kept(name: str) -> None:
    """Cameras, errors, leave-one-out errors and homographies stay what the files say."""
    path = GOLDEN / f"registration_{name}.json"
    found = _case(name)
    if os.environ.get("QUAYMARK_WRITE_GOLDEN"):
        path.write_text(json.dumps(found, indent=1) + "\n")
    _same(found, json.loads(path.read_text()), name)
