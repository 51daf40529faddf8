"""Registration: from keypoints to a camera in the site's ENU frame, with its errors and doubts.

Four methods share one result. `pnp` is the method; the two homographies are the paper's, for
comparison; `given` takes extrinsics measured elsewhere and only says how well keypoints agree.
A fit error always looks better with fewer keypoints, so the error to trust is the one of each
keypoint against a fit without it (leave one out), beside the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.consensus import Consensus, NoConsensusError, find_consensus
from app.domain.diagnosis import explain_disagreement, suspect_outliers
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.homography import Homography, fit_homographies, principal_axes, water_axes
from app.domain.keypoints import (
    Keypoints,
    RegistrationError,
    Suspicion,
    depth_warning,
    require_usable,
    spread_warnings,
)
from app.domain.pnp import (
    Priors,
    condition_number,
    distances_px,
    parameter_covariance,
    refine_without_each,
)
from app.domain.projection import projection_jacobian
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix

_UNSURE_CENTER_M = 5.0  # one sigma: as much as an AIS position
_WET_M = 1.0  # a camera at the waterline may come out a little below it


class RegistrationMethod(StrEnum):
    """How a viewport was registered."""

    PNP = "pnp"
    HOMOGRAPHY_WATER = "homography_water"
    HOMOGRAPHY_PCA = "homography_pca"
    GIVEN = "given"


@dataclass(frozen=True, slots=True)
class RegistrationSettings:
    """Numbers of PnP, each measured on simulated cameras.

    `refine_intrinsics` moves focal length and k1 from `refine_from_points` agreeing keypoints on,
    held by `priors`.
    """

    minimum_points: int = 6
    inlier_threshold_px: float = 8.0
    refine_intrinsics: bool = True
    refine_from_points: int = 10
    priors: Priors = field(default_factory=Priors)
    maximum_condition: float = 1e6  # of pixels by radians and metres


@dataclass(frozen=True, eq=False)
class Registration:
    """One solution. Frames: the site's ENU for `camera`, `homography` and `covariance`.

    `residuals_px` (n, 2) are projected minus observed pixels of all keypoints in their order,
    `leave_one_out_distances_px` (n,) the distance of each keypoint from a fit without it; both are
    NaN where there is no projection. `inliers` (n,) are the keypoints that the fit used.
    `parameter_covariance` is (6, 6), or (8, 8) with refined intrinsics: see `covariance`; those
    before are `refined_from`. PnP's inliers lie within `threshold_px`, which was widened where too
    few did; `suspicions` say what is probably wrong with the others.
    """

    method: RegistrationMethod
    frame: EnuFrame
    intrinsics: Intrinsics
    residuals_px: FloatArray
    leave_one_out_distances_px: FloatArray
    inliers: npt.NDArray[np.bool_]
    warnings: list[str]
    camera: Camera | None = None
    homography: Homography | None = None
    parameter_covariance: FloatArray | None = None
    suspicions: Sequence[Suspicion] = ()
    threshold_px: float | None = None
    is_widened: bool = False
    refined_from: Intrinsics | None = None

    @property
    def covariance(self) -> FloatArray | None:
        """Covariance (6, 6) of the pose (PnP only).

        In this order: small rotations about the camera's x, y and z axes (rad), then the camera's
        centre east, north and up (m).
        """
        found = self.parameter_covariance
        return None if found is None else found[:6, :6]

    @property
    def rotvec_cam_from_enu(self) -> FloatArray | None:
        """Rodrigues vector (3,) of the rotation from the site's ENU frame to the camera's."""
        return None if self.camera is None else rotvec_from_matrix(self.camera.R_cam_from_world)

    @property
    def center(self) -> Geodetic | None:
        """The camera's centre as a WGS84 place."""
        if self.camera is None:
            return None
        return self.frame.geodetic(self.camera.center_in_world)

    @property
    def distances_px(self) -> FloatArray:
        """Reprojection errors (n,), NaN where there is no projection."""
        return np.asarray(np.linalg.norm(self.residuals_px, axis=1), dtype=np.float64)

    @property
    def mae_px(self) -> float | None:
        """Mean reprojection error of all keypoints, outliers too; None without any."""
        return _mean(self.distances_px)

    @property
    def mae_inliers_px(self) -> float | None:
        """Mean reprojection error of the keypoints that the fit used."""
        return _mean(self.distances_px[self.inliers])

    @property
    def mae_pct_width(self) -> float | None:
        """Mean reprojection error in per cent of the image's width."""
        return None if self.mae_px is None else 100 * self.mae_px / self.intrinsics.width_px

    @property
    def mae_pct_height(self) -> float | None:
        """Mean reprojection error in per cent of the image's height."""
        return None if self.mae_px is None else 100 * self.mae_px / self.intrinsics.height_px

    @property
    def leave_one_out_px(self) -> float | None:
        """Mean distance of all keypoints from the fits without them."""
        return _mean(self.leave_one_out_distances_px)


def register_pnp(
    frame: EnuFrame,
    intrinsics: Intrinsics,
    keypoints: Keypoints,
    settings: RegistrationSettings | None = None,
    water_level_m: float | None = None,
) -> Registration:
    """Solve for the camera by PnP (paper, Perspective-n-Point) from keypoints in `frame`.

    `water_level_m` is the height of the water in `frame`, under which no camera stands. Raises
    RegistrationError, with the reason and the fix, for too few or collinear keypoints, for
    keypoints that do not agree on any camera, and for those that leave it undetermined.
    """
    settings = settings or RegistrationSettings()
    require_usable(keypoints, settings.minimum_points)
    found = _consensus(intrinsics, keypoints, settings, water_level_m)
    _require_dry(found.camera, water_level_m)
    used = keypoints[found.inliers]
    require_usable(used, settings.minimum_points)
    if condition_number(found.camera, used) > settings.maximum_condition:
        raise RegistrationError(
            "the keypoints leave the camera's place undetermined (they lie almost on a line); "
            "mark landmarks at other distances, heights and directions"
        )
    covariance = parameter_covariance(found.camera, used, settings.priors, found.refined_from)
    return Registration(
        method=RegistrationMethod.PNP,
        frame=frame,
        intrinsics=found.camera.intrinsics,
        residuals_px=found.camera.project(keypoints.points_in_world) - keypoints.pixels_px,
        leave_one_out_distances_px=_leave_one_out_pnp(found, keypoints, settings.priors),
        inliers=found.inliers,
        warnings=_pnp_warnings(found, keypoints, covariance),
        camera=replace(found.camera, covariance=covariance[:6, :6]),
        parameter_covariance=covariance,
        suspicions=_suspicions(frame, intrinsics, found, keypoints, settings),
        threshold_px=found.threshold_px,
        is_widened=found.widened,
        refined_from=found.refined_from,
    )


def register_homography(
    frame: EnuFrame, intrinsics: Intrinsics, keypoints: Keypoints, method: RegistrationMethod
) -> Registration:
    """Fit one of the paper's two homographies; all keypoints count, none is an outlier.

    Raises RegistrationError for too few or collinear keypoints.
    """
    require_usable(keypoints, RegistrationSettings().minimum_points)

    axes = water_axes if method is RegistrationMethod.HOMOGRAPHY_WATER else principal_axes
    everyone = np.ones((1, len(keypoints)), dtype=np.bool_)
    all_but_one = ~np.eye(len(keypoints), dtype=np.bool_)
    homography, *without = fit_homographies(axes, keypoints, np.vstack([everyone, all_but_one]))
    if homography is None:
        raise RegistrationError(
            "the keypoints lie on one line in the interim plane: mark landmarks beside it"
        )
    left_out = np.full(len(keypoints), np.nan)
    for index, refitted in enumerate(without):
        if refitted is not None:
            seen = refitted.project(keypoints.points_in_world[index : index + 1])[0]
            left_out[index] = np.linalg.norm(seen - keypoints.pixels_px[index])
    return Registration(
        method=method,
        frame=frame,
        intrinsics=intrinsics,
        residuals_px=homography.project(keypoints.points_in_world) - keypoints.pixels_px,
        leave_one_out_distances_px=left_out,
        inliers=np.ones(len(keypoints), dtype=np.bool_),
        warnings=spread_warnings(keypoints, intrinsics),
        homography=homography,
    )


def register_given(
    frame: EnuFrame,
    intrinsics: Intrinsics,
    rotvec_cam_from_enu: npt.ArrayLike,
    center: Geodetic,
    keypoints: Keypoints | None = None,
) -> Registration:
    """Take extrinsics as given: a Rodrigues vector (3,) in the site's ENU and a WGS84 centre.

    Keypoints, where there are any, are only compared. Nothing is fitted to them, so leaving one
    out changes nothing. Raises ValueError naming what is no rotation or no place.
    """
    camera = Camera(
        intrinsics,
        matrix_from_rotvec(rotvec_cam_from_enu),
        frame.position(center.lat_deg, center.lon_deg, center.height_m),
    )
    if keypoints is None:
        keypoints = Keypoints(np.empty((0, 3)), np.empty((0, 2)))
    registration = Registration(
        method=RegistrationMethod.GIVEN,
        frame=frame,
        intrinsics=intrinsics,
        residuals_px=camera.project(keypoints.points_in_world) - keypoints.pixels_px,
        leave_one_out_distances_px=np.empty(len(keypoints)),
        inliers=np.ones(len(keypoints), dtype=np.bool_),
        warnings=[],
        camera=camera,
    )
    hidden = int(np.isnan(registration.distances_px).sum())
    warnings = [f"{hidden} keypoints lie behind the given camera or beside its lens."]
    return replace(
        registration,
        leave_one_out_distances_px=registration.distances_px,
        warnings=warnings if hidden else [],
    )


def water_point_sigma_px(registration: Registration, range_m: float, water_level_m: float) -> float:
    """Uncertainty in pixels of a water point straight ahead of the camera at `range_m`.

    One sigma along the worst direction in the image, from the covariance; `water_level_m` is the
    height of the water in the site's frame. Raises ValueError unless the method is PnP.
    """
    camera, covariance = registration.camera, registration.parameter_covariance
    if camera is None or covariance is None:
        raise ValueError("only a PnP registration knows its uncertainty")
    ahead = camera.R_cam_from_world[2, :2]
    point = camera.center_in_world.copy()
    point[:2] += range_m * ahead / np.linalg.norm(ahead)
    point[2] = water_level_m
    J = projection_jacobian(camera, point[None])[0, :, : len(covariance)]
    return float(np.sqrt(np.linalg.eigvalsh(J @ covariance @ J.T).max()))


def _consensus(
    intrinsics: Intrinsics,
    keypoints: Keypoints,
    settings: RegistrationSettings,
    water_level_m: float | None,
) -> Consensus:
    """Find the camera; where there is none, say what is probably wrong."""
    try:
        return find_consensus(
            intrinsics,
            keypoints,
            threshold_px=settings.inlier_threshold_px,
            minimum=settings.minimum_points,
            refine_from=settings.refine_from_points if settings.refine_intrinsics else None,
            priors=settings.priors,
        )
    except NoConsensusError as error:
        suspicions = explain_disagreement(
            intrinsics,
            keypoints,
            settings.inlier_threshold_px,
            settings.minimum_points,
            water_level_m,
        )
        raise RegistrationError(str(error), suspicions) from error


def _require_dry(camera: Camera, water_level_m: float | None) -> None:
    under_m = 0.0 if water_level_m is None else water_level_m - camera.center_in_world[2]
    if under_m > _WET_M:
        raise RegistrationError(
            f"the camera would stand {under_m:.0f} m under the water: the landmarks' heights seem "
            "to be turned over or to have another datum; check their sign, and that they are "
            "above the ellipsoid"
        )


def _suspicions(
    frame: EnuFrame,
    intrinsics: Intrinsics,
    found: Consensus,
    keypoints: Keypoints,
    settings: RegistrationSettings,
) -> list[Suspicion]:
    said = suspect_outliers(frame, found, keypoints)
    if found.widened:
        said += [
            suspicion
            for suspicion in explain_disagreement(
                intrinsics, keypoints, settings.inlier_threshold_px, settings.minimum_points
            )
            if suspicion.indices not in {earlier.indices for earlier in said}
        ]
    return said


def _leave_one_out_pnp(found: Consensus, keypoints: Keypoints, priors: Priors) -> FloatArray:
    """Refit without each inlier; an outlier was left out already."""
    distances = distances_px(found.camera, keypoints)
    refitted = refine_without_each(
        found.camera, keypoints, found.inliers, priors, found.refined_from
    )
    for index, camera in zip(np.flatnonzero(found.inliers), refitted, strict=True):
        chosen = np.arange(len(keypoints)) == index
        distances[index] = distances_px(camera, keypoints[chosen])[0]
    return np.where(np.isfinite(distances), distances, np.nan)


def _pnp_warnings(found: Consensus, keypoints: Keypoints, covariance: FloatArray) -> list[str]:
    warnings = spread_warnings(keypoints[found.inliers], found.camera.intrinsics)
    depths = found.camera.to_cam(keypoints[found.inliers].points_in_world)[:, 2]
    warnings.extend(filter(None, [depth_warning(depths)]))
    outliers = np.flatnonzero(~found.inliers)
    if outliers.size:
        names = ", ".join(keypoints.label(int(index)) for index in outliers)
        warnings.append(
            f"{outliers.size} of {len(keypoints)} keypoints do not agree with the others and were "
            f"not used ({names}): check their landmarks and pixels."
        )
    if found.widened:
        warnings.append(
            f"The keypoints agree only within {found.threshold_px:.0f} px: check the focal length, "
            "the distortion and the landmarks' coordinates."
        )
    sigma_m = float(np.sqrt(np.linalg.eigvalsh(covariance[3:6, 3:6]).max()))
    if sigma_m > _UNSURE_CENTER_M:
        warnings.append(
            f"The camera's place is uncertain by {sigma_m:.0f} m: add landmarks that are near or "
            "spread more."
        )
    return warnings


def _mean(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else None
