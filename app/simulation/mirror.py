"""Mirror images in the water: of the land, found once a session, and of each hull.

Still water would show every thing upside down below itself. Waves smear that image downwards and
mix it with the sky, the more the stronger the wind.
"""

import cv2
import numpy as np
import numpy.typing as npt

from app.domain.camera import Camera
from app.simulation.light import Light
from app.simulation.mesh import Mesh, Shade
from app.simulation.raster import Window, rasterise, window_of


def mirrored(mesh: Mesh, water_level_m: float) -> Mesh:
    """Return the mesh as still water would show it, faces turned to stay outward."""
    vertices = mesh.vertices * (1.0, 1.0, -1.0) + (0.0, 0.0, 2 * water_level_m)
    return Mesh(vertices, mesh.faces[:, ::-1].copy(), mesh.colours, mesh.surfaces)


def paint_reflection(
    canvas: Shade,
    camera: Camera,
    mesh: Mesh,
    light: Light,
    water_level_m: float,
    open_water: npt.NDArray[np.bool_],
) -> None:
    """Darken and tint the water (h, w, 3) below a hull by its blurred mirror image.

    `open_water` (h, w) is where water can be seen.
    """
    height, width = open_water.shape
    still = mirrored(mesh, water_level_m)
    # Waves stretch a mirror image: each hull's is smeared downwards over its own height.
    window = window_of(camera, still, 1, Window(0, 0, width, height, 1))
    if window.width < 2 or window.height < 2:
        return
    raster = rasterise(camera, still, window)
    table = light.on(mesh.normals(), mesh.colours)
    colour = table[np.maximum(raster.face, 0)] * raster.mask[..., None]
    kernel = (1 | max(3, window.width // 90), 1 | max(3, window.height // 2))
    cover = cv2.blur(raster.mask.astype(np.float32), kernel, borderType=cv2.BORDER_CONSTANT)
    paint = cv2.blur(colour.astype(np.float32), kernel, borderType=cv2.BORDER_CONSTANT)
    share = np.float32(0.5 - 0.028 * min(light.weather.wind_m_s, 10.0))
    part = canvas[window.slices]
    wet = open_water[window.slices][..., None]
    mixed = part * (1 - share * cover[..., None]) + share * 0.55 * paint
    part[:] = np.where(wet, mixed, part)


def mirror_of_land(
    camera: Camera, land: Mesh, light: Light, water_level_m: float, sight: Shade
) -> tuple[Shade, Shade]:
    """Return colour times coverage (h, w, 3) and coverage (h, w) of the land as waves mirror it.

    `sight` (h, w, 3) are the pixels' unit directions.
    """
    height, width = sight.shape[:2]
    raster = rasterise(camera, mirrored(land, water_level_m), Window(0, 0, width, height, 1))
    along = sight @ camera.R_cam_from_world[2].astype(np.float32)
    away = 1 / np.maximum(raster.inverse_depth * along, np.float32(1e-6))
    depth_m = water_level_m - float(camera.center_in_world[2]) - sight[..., 2] * away
    shown = (raster.mask & (depth_m > 0)).astype(np.float32)
    table = light.on(land.normals(), land.colours).astype(np.float32)
    colour = table[np.maximum(raster.face, 0)]
    clear = np.exp(-away / light.weather.visibility_m)[..., None]
    colour = (colour * clear + light.haze * (1 - clear)) * shown[..., None]
    # Coarse first: the smear hides what a smaller picture loses.
    small = (max(1, width // 2), max(1, height // 2))
    kernel = (1 | max(3, width // 320), 1 | max(3, height // 22))
    smeared = []
    for picture in (colour.astype(np.float32), shown):
        coarse = cv2.resize(picture, small, interpolation=cv2.INTER_AREA)
        for _ in range(2):
            coarse = cv2.blur(coarse, kernel, borderType=cv2.BORDER_REPLICATE)
        smeared.append(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR))
    share = np.float32(0.8 - 0.03 * min(light.weather.wind_m_s, 10.0))
    return np.asarray(smeared[0]) * share, np.asarray(smeared[1]) * share
