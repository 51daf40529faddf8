"""Pulling the AIS segment under its detection, and raising it to the detection's height.

Paper, Correcting AIS data using visual cues and Creating the 3D bounding box: each edge of the
detection, seen from the camera, is a plane through the camera's centre: alpha (left), beta (right),
both containing the vertical, gamma (bottom) and delta (top). The segment moves as a whole until its
extreme corners lie on alpha, beta and gamma, and is raised until the first corner reaches delta.

Two formulas differ from the printed ones, because only so do the published labels come out: the
corrections are subtracted (printed plus signs would double the gap), and the top face is raised
along delta's normal, not along the vertical.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import CutEdges
from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.sighting import Sighting, VesselBox


@dataclass(frozen=True, eq=False)
class EdgePlanes:
    """Unit normals (3,) in the world frame of the four planes, which meet at `center_in_world`.

    In the image of an upright camera alpha and beta point to the left, gamma and delta downwards:
    a vessel inside its box has alpha <= 0 <= beta, gamma <= 0 <= delta.
    """

    center_in_world: FloatArray
    alpha: FloatArray
    beta: FloatArray
    gamma: FloatArray
    delta: FloatArray

    def distances_m(self, normal: FloatArray, points_in_world: FloatArray) -> FloatArray:
        """Signed distances (n,) of points (n, 3) to the plane with that normal."""
        return np.asarray((points_in_world - self.center_in_world) @ normal, dtype=np.float64)


def edge_planes(
    camera: Camera, detections: Sequence[Detection], ups_in_world: Sequence[FloatArray]
) -> list[EdgePlanes]:
    """Build alpha, beta, gamma, delta from each detection and its vessel's z_v.

    Raises ValueError when a corner of a box has no line of sight (beyond the lens's range).
    """
    corners = [
        [(d.x1_px, d.y1_px), (d.x1_px, d.y2_px), (d.x2_px, d.y1_px), (d.x2_px, d.y2_px)]
        for d in detections
    ]
    rays = camera.rays(np.array(corners).reshape(-1, 2)).reshape(-1, 4, 3)
    top_left, bottom_left, top_right, bottom_right = np.swapaxes(rays, 0, 1)
    up = np.array(ups_in_world).reshape(-1, 3)
    normals = np.stack(
        [
            np.cross(up, bottom_left),
            np.cross(up, bottom_right),
            np.cross(bottom_left, bottom_right),
            np.cross(top_left, top_right),
        ],
        axis=1,
    )
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    if not np.isfinite(normals).all():
        raise ValueError(
            "a corner of the detection lies where the lens distortion is not one-to-one: "
            "check the camera's distortion coefficients"
        )
    return [EdgePlanes(camera.center_in_world, *four) for four in normals]


def correction_in_world(
    planes: EdgePlanes, corners_in_world: FloatArray, cut: CutEdges
) -> FloatArray:
    """Find the shift (3,) of a segment (4, 3) that brings it between its planes (paper, delta v).

    All distances are those of the uncorrected corners, and every pull counts even where its plane
    is not violated. An edge made by the image's border pulls nothing; its opposite then counts
    fully. The paper leaves a cut lower edge open: gamma is dropped there.
    """
    # The paper's extreme corners i, j, k: the leftmost, the rightmost and the lowest one.
    alpha_gap = planes.distances_m(planes.alpha, corners_in_world).max()
    beta_gap = planes.distances_m(planes.beta, corners_in_world).min()
    gamma_gap = planes.distances_m(planes.gamma, corners_in_world).max()
    alpha_weight = 0.0 if cut.left else (1.0 if cut.right else 0.5)
    beta_weight = 0.0 if cut.right else (1.0 if cut.left else 0.5)
    gamma_weight = 0.0 if cut.bottom else 1.0
    shift = (
        gamma_weight * gamma_gap * planes.gamma
        + alpha_weight * alpha_gap * planes.alpha
        + beta_weight * beta_gap * planes.beta
    )
    return np.asarray(-shift, dtype=np.float64)


def height_m(planes: EdgePlanes, bottom_corners_in_world: FloatArray) -> float:
    """Find the height at which the first corner of the raised segment touches delta (paper, h)."""
    return float(planes.distances_m(planes.delta, bottom_corners_in_world).min())


def paper_boxes(camera: Camera, sightings: Sequence[Sighting]) -> list[VesselBox]:
    """Build the boxes of sightings as published (paper, b1 to b8)."""
    ups = [sighting.candidate.segment.vessel_axes_in_world[2] for sighting in sightings]
    planes = edge_planes(camera, [sighting.detection for sighting in sightings], ups)
    return [_paper_box(*one) for one in zip(sightings, planes, strict=True)]


def _paper_box(sighting: Sighting, planes: EdgePlanes) -> VesselBox:
    segment = sighting.candidate.segment
    bottom = segment.corners_in_world + correction_in_world(
        planes, segment.corners_in_world, sighting.cut
    )
    height = height_m(planes, bottom)
    return VesselBox(
        vessel_axes_in_world=segment.vessel_axes_in_world,
        heading_deg=sighting.candidate.state.heading_deg,
        bottom_in_world=bottom,
        top_from_bottom_m=-height * planes.delta,
        height_m=height,
        water_level_m=sighting.water_level_m,
    )
