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

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.borders import CutEdges
from app.domain.camera import Camera
from app.domain.sighting import Sighting, VesselBoxes
from app.domain.waterplane import WaterPlane

# Of x, y and z: those that come after each, and before it.
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def edge_normals(camera: Camera, boxes_px: FloatArray, ups_in_world: FloatArray) -> FloatArray:
    """Return the unit normals (n, 4, 3) of alpha, beta, gamma and delta in the world frame.

    From boxes (n, 4) x1, y1, x2, y2 and each vessel's z_v (n, 3). In the image of an upright camera
    alpha and beta point to the left, gamma and delta downwards: a vessel inside its box has
    alpha <= 0 <= beta, gamma <= 0 <= delta. Raises ValueError when a corner of a box has no line of
    sight (beyond the lens's range).
    """
    # Top left, bottom left, top right, bottom right.
    corners = boxes_px.take([0, 1, 0, 3, 2, 1, 2, 3], axis=1)
    rays = camera.rays(corners.reshape(-1, 2)).reshape(-1, 4, 3)
    along = rays.take([0, 0, 1, 0], axis=1)
    along[:, :2] = ups_in_world[:, None]
    normals = cross(along, rays.take([1, 3, 3, 2], axis=1))
    normals /= np.sqrt((normals**2).sum(axis=2, keepdims=True))
    if not np.isfinite(normals).all():
        raise ValueError(
            "a corner of the detection lies where the lens distortion is not one-to-one: "
            "check the camera's distortion coefficients"
        )
    return normals


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return vector products along the last axis; np.cross takes several times as long."""
    product = a.take(_NEXT, axis=-1) * b.take(_LAST, axis=-1)
    product -= a.take(_LAST, axis=-1) * b.take(_NEXT, axis=-1)
    return product


def pull_weights(cuts: Sequence[CutEdges]) -> FloatArray:
    """Return how much alpha, beta and gamma (n, 3) pull.

    An edge made by the image's border pulls nothing; its opposite then counts fully. The paper
    leaves a cut lower edge open: gamma is dropped there.
    """
    return np.array(
        [
            (
                0.0 if cut.left else (1.0 if cut.right else 0.5),
                0.0 if cut.right else (1.0 if cut.left else 0.5),
                0.0 if cut.bottom else 1.0,
            )
            for cut in cuts
        ]
    )


def corrections_in_world(
    normals: FloatArray, corners_from_camera: FloatArray, weights: FloatArray
) -> FloatArray:
    """Find the shifts (n, 3) that bring segments (n, 4, 3) between their planes (paper, delta v).

    Corners count from the camera's centre, where the planes (n, 3 or 4, 3) meet. All distances are
    those of the uncorrected corners, and every pull counts even where its plane is not violated.
    """
    normals = normals[:, :3]
    distances = corners_from_camera @ np.swapaxes(normals, 1, 2)
    # The paper's extreme corners i, j, k: the leftmost, the rightmost and the lowest one.
    gaps = distances.max(axis=1)
    gaps[:, 1] = distances[..., 1].min(axis=1)
    shifts: FloatArray = -((weights * gaps)[..., None] * normals).sum(axis=1)
    return shifts


def paper_boxes(camera: Camera, sightings: Sequence[Sighting]) -> VesselBoxes:
    """Build the boxes of sightings, one at least, as published (paper, b1 to b8)."""
    plane = WaterPlane.of([sighting.candidate.segment for sighting in sightings])
    boxes = np.array([sighting.detection.edges_px for sighting in sightings])
    normals = edge_normals(camera, boxes, plane.vessel_axes_in_world[:, 2])
    corners = plane.corners_in_world
    weights = pull_weights([sighting.cut for sighting in sightings])
    shifts = corrections_in_world(normals, corners - camera.center_in_world, weights)
    bottom = corners + shifts[:, None]
    # The height at which the first corner of the raised segment touches delta (paper, h).
    away, delta = bottom - camera.center_in_world, normals[:, 3]
    heights = (away @ delta[..., None])[..., 0].min(axis=1)
    return VesselBoxes(
        vessel_axes_in_world=plane.vessel_axes_in_world,
        heading_deg=np.array([sighting.candidate.state.heading_deg for sighting in sightings]),
        bottom_in_world=bottom,
        top_from_bottom_m=-heights[:, None] * delta,
        height_m=heights,
        water_level_m=np.array([sighting.water_level_m for sighting in sightings]),
        sigmas=None,
        doubts=[()] * len(sightings),
    )
