"""Ships as one image sees them: their pixels, what hides what, and their colours.

Every hull is filled into a window of its own, which may reach beyond the image: so the share that
can be seen counts what other ships, the land and the image's edge take away.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from app.domain.camera import Camera
from app.simulation.mesh import Mesh, Shade
from app.simulation.raster import Raster, Window, rasterise, window_of


@dataclass(frozen=True, eq=False)
class HullView:
    """One hull in one image: all its samples, and which of them can be seen in the image.

    `visible` has the shape of `raster.face`; both may be empty.
    """

    mesh: Mesh
    raster: Raster
    visible: npt.NDArray[np.bool_]


def view_hulls(
    camera: Camera,
    meshes: Sequence[Mesh],
    samples_per_px: int,
    land_inverse_depth: Shade,
) -> list[HullView]:
    """Fill hulls (meshes in ENU) and find what each shows beside all others and the land.

    `land_inverse_depth` covers the image at `samples_per_px`, 0 where there is no land.
    """
    height, width = land_inverse_depth.shape
    image = Window(0, 0, width, height, samples_per_px)
    # A ship may reach far out of the image; one image size on each side is kept.
    limit = Window(-width, -height, 3 * width, 3 * height, samples_per_px)
    rasters = [rasterise(camera, m, window_of(camera, m, samples_per_px, limit)) for m in meshes]
    nearest = land_inverse_depth.copy()
    for raster in rasters:
        seen = raster.window.clipped(image)
        part = nearest[seen.slices]
        np.maximum(part, raster.inverse_depth[seen.within(raster.window)], out=part)
    views = []
    for mesh, raster in zip(meshes, rasters, strict=True):
        visible = np.zeros(raster.face.shape, dtype=np.bool_)
        seen = raster.window.clipped(image)
        inside = seen.within(raster.window)
        visible[inside] = raster.mask[inside] & (
            raster.inverse_depth[inside] >= nearest[seen.slices]
        )
        views.append(HullView(mesh, raster, visible))
    return views


def paint_hull(canvas: Shade, view: HullView, colours: Shade) -> None:
    """Lay a hull's visible pixels over the canvas (h, w, 3), with soft edges.

    `colours` (n, 3) are those of all its samples, row by row.
    """
    if not view.visible.any():
        return
    per_px = view.raster.window.samples_per_px
    height, width = canvas.shape[:2]
    image = Window(0, 0, width * per_px, height * per_px, per_px)
    seen = _whole_pixels(view.raster.window.clipped(image), image)
    # The window grown to whole pixels may reach a sample beyond what was filled.
    colour = np.zeros((seen.height, seen.width, 3), dtype=np.float32)
    shown = np.zeros((seen.height, seen.width), dtype=np.float32)
    filled = view.raster.window.clipped(seen)
    source, target = filled.within(view.raster.window), filled.within(seen)
    visible = view.visible[source]
    picture = np.zeros((*view.visible.shape, 3), dtype=np.float32)
    picture[view.raster.mask] = colours
    colour[target] = picture[source] * visible[..., None]
    shown[target] = visible
    size = (seen.width // per_px, seen.height // per_px)
    cover = cv2.resize(shown, size, interpolation=cv2.INTER_AREA)[..., None]
    paint = cv2.resize(colour, size, interpolation=cv2.INTER_AREA)
    top, left = seen.top // per_px, seen.left // per_px
    part = canvas[top : top + size[1], left : left + size[0]]
    part *= 1 - cover
    part += paint


def _whole_pixels(window: Window, image: Window) -> Window:
    """Grow a window of samples outwards to whole pixels, within the image."""
    per_px = window.samples_per_px
    left, top = window.left // per_px * per_px, window.top // per_px * per_px
    right = -(-(window.left + window.width) // per_px) * per_px
    bottom = -(-(window.top + window.height) // per_px) * per_px
    return Window(left, top, right - left, bottom - top, per_px).clipped(image)
