"""The exact truth of every vessel in an image.

Poses come from the simulated motion, silhouettes from the rendered pixels. Silhouette boxes follow
the convention of detections (COCO): they run from the left edge of the leftmost pixel to the right
edge of the rightmost, counted from the image's edge. Corners are projected points and follow the
camera's convention: (0, 0) is the centre of the first pixel, half a pixel less.

Classes are those of the paper's 2D annotation. A convoy is one `ship`, and each of its hulls a
`subvessel` besides.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.simulation.fleet_view import HullView
from app.simulation.raster import Window
from app.simulation.vessels import Vessel

Box = tuple[float, float, float, float]

_MOSTLY_HIDDEN = 0.4


class VesselClass(StrEnum):
    """The paper's five classes."""

    SHIP = "ship"
    SHIP_LEAVING_FRAME = "ship_leaving_frame"
    SHIP_MOORED = "ship_moored"
    SHIP_PARTIAL = "ship_partial"
    SUBVESSEL = "subvessel"


@dataclass(frozen=True, eq=False)
class VesselTruth:
    """One vessel (or one hull of a convoy) in one image.

    `corners_in_enu` (8, 3) metres and `corners_in_image_px` (8, 2) are the box of length, width and
    height around the hull, from the waterline to the highest mast: bow-port, bow-starboard,
    stern-starboard, stern-port at the water, then the same above. `centroid_*` is their mean.
    `rotvec_cam_from_vessel` is a Rodrigues vector. `visible_fraction` counts pixels seen in the
    image against those of the whole silhouette; `box_px` bounds the former (None when there are
    none), `whole_box_px` the latter.
    """

    identifier: str
    part_of: str | None
    mmsi: int | None
    class_name: VesselClass
    ship_type: str
    centroid_in_enu_m: FloatArray
    centroid_in_cam_m: FloatArray
    rotvec_cam_from_vessel: FloatArray
    heading_deg: float
    speed_m_s: float
    length_m: float
    width_m: float
    height_m: float
    corners_in_enu_m: FloatArray
    corners_in_image_px: FloatArray
    visible_fraction: float
    box_px: Box | None
    whole_box_px: Box


@dataclass(frozen=True, eq=False)
class PlacedVessel:
    """A vessel at one instant: middle of the waterline and axes (3, 3) of its hull in ENU."""

    vessel: Vessel
    middle_in_enu_m: FloatArray
    R_enu_from_vessel: FloatArray
    heading_deg: float
    speed_m_s: float


def vessel_truths(
    camera: Camera, placed: PlacedVessel, views: Sequence[HullView]
) -> list[VesselTruth]:
    """Return the truth of a vessel whose parts are seen as `views`; empty if outside the image.

    The vessel itself comes first, then each hull of a convoy that reaches into the image.
    """
    vessel, ship = placed.vessel, placed.vessel.ship
    inner = camera.intrinsics
    whole = _Silhouette.of(views, inner.width_px, inner.height_px)
    if whole is None or not whole.reaches_image:
        return []
    truths = [
        _truth(
            camera, placed, whole, vessel.identifier, None, _class_of(vessel, whole), (0.0, 0.0),
            (ship.length_m, ship.width_m, ship.height_m),
        )
    ]  # fmt: skip
    if len(ship.parts) == 1:
        return truths
    for part, view in zip(ship.parts, views, strict=True):
        shape = _Silhouette.of([view], inner.width_px, inner.height_px)
        if shape is None or not shape.reaches_image:
            continue
        name = f"{vessel.identifier}/{part.name}"
        size = (part.length_m, part.width_m, part.height_m)
        truths.append(
            _truth(camera, placed, shape, name, vessel.identifier, VesselClass.SUBVESSEL,
                   part.middle_in_ship_m, size)
        )  # fmt: skip
    return truths


@dataclass(frozen=True, slots=True)
class _Silhouette:
    """Pixels of one or more hulls together."""

    visible_fraction: float
    inside_fraction: float
    box_px: Box | None
    whole_box_px: Box
    reaches_image: bool
    leaves_image: bool

    @staticmethod
    def of(views: Sequence[HullView], width_px: int, height_px: int) -> "_Silhouette | None":
        total = sum(int(view.raster.mask.sum()) for view in views)
        whole = _bounds([(view.raster.window, view.raster.mask) for view in views])
        if not total or whole is None:
            return None
        seen = sum(int(view.visible.sum()) for view in views)
        inside = sum(_inside(view, width_px, height_px) for view in views)
        box = _bounds([(view.raster.window, view.visible) for view in views])
        x1, y1, x2, y2 = whole
        leaves = x1 < 0 or y1 < 0 or x2 > width_px or y2 > height_px
        return _Silhouette(seen / total, inside / total, box, whole, inside > 0, leaves)


def _inside(view: HullView, width_px: int, height_px: int) -> int:
    """How many of a hull's samples lie in the image, hidden or not."""
    window = view.raster.window
    per_px = window.samples_per_px
    image = Window(0, 0, width_px * per_px, height_px * per_px, per_px)
    return int(view.raster.mask[window.clipped(image).within(window)].sum())


def _bounds(masks: Sequence[tuple[Window, np.ndarray]]) -> Box | None:
    """Smallest box, in pixels from the image's edge, around all samples set."""
    corners = []
    for window, mask in masks:
        columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
        if len(columns):
            low = (columns[0] + window.left, rows[0] + window.top)
            high = (columns[-1] + 1 + window.left, rows[-1] + 1 + window.top)
            corners.append(np.array([*low, *high]) / window.samples_per_px)
    if not corners:
        return None
    stacked = np.array(corners)
    x1, y1 = stacked[:, :2].min(axis=0)
    x2, y2 = stacked[:, 2:].max(axis=0)
    return float(x1), float(y1), float(x2), float(y2)


def _class_of(vessel: Vessel, shape: _Silhouette) -> VesselClass:
    hidden = shape.visible_fraction < _MOSTLY_HIDDEN * shape.inside_fraction
    if vessel.moored:
        return VesselClass.SHIP_PARTIAL if hidden or shape.leaves_image else VesselClass.SHIP_MOORED
    return VesselClass.SHIP_LEAVING_FRAME if shape.leaves_image else VesselClass.SHIP


def _truth(
    camera: Camera,
    placed: PlacedVessel,
    shape: _Silhouette,
    identifier: str,
    part_of: str | None,
    class_name: VesselClass,
    middle_m: tuple[float, float],
    size_m: tuple[float, float, float],
) -> VesselTruth:
    length, width, height = size_m
    ground = np.array(
        [(length / 2, width / 2), (length / 2, -width / 2), (-length / 2, -width / 2),
         (-length / 2, width / 2)]
    ) + middle_m  # fmt: skip
    in_vessel = np.vstack([np.column_stack([ground, np.full(4, z)]) for z in (0.0, height)])
    corners = in_vessel @ placed.R_enu_from_vessel.T + placed.middle_in_enu_m
    centroid = corners.mean(axis=0)
    rotvec, _ = cv2.Rodrigues(camera.R_cam_from_world @ placed.R_enu_from_vessel)
    vessel = placed.vessel
    return VesselTruth(
        identifier=identifier,
        part_of=part_of,
        mmsi=vessel.mmsi if part_of is None else None,
        class_name=class_name,
        ship_type=vessel.ship.ship_type.value,
        centroid_in_enu_m=centroid,
        centroid_in_cam_m=camera.to_cam(centroid)[0],
        rotvec_cam_from_vessel=rotvec.ravel().astype(np.float64),
        heading_deg=placed.heading_deg,
        speed_m_s=placed.speed_m_s,
        length_m=length,
        width_m=width,
        height_m=height,
        corners_in_enu_m=corners,
        corners_in_image_px=camera.project(corners),
        visible_fraction=shape.visible_fraction,
        box_px=shape.box_px,
        whole_box_px=shape.whole_box_px,
    )
