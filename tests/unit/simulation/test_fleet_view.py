"""Hulls in one image: silhouettes, and what hides what."""

import numpy as np
import pytest

from app.domain.camera import Camera
from app.simulation.fleet_view import view_hulls
from app.simulation.mesh import Mesh
from app.simulation.mirror import mirrored
from app.simulation.ships import ShipType, build_ship
from app.simulation.viewports import looking, make_intrinsics

_WIDTH, _HEIGHT = 1280, 960


@pytest.fixture(scope="module")
def camera() -> Camera:
    """Return a camera 28 m above the water that looks north, slightly down."""
    intrinsics = make_intrinsics(np.random.default_rng(1), _WIDTH, _HEIGHT)
    return looking(intrinsics, np.array([0.0, 0.0, 28.0]), 0.0, 9.0, 0.3)


def _ship(kind: ShipType, distance_m: float, aside_m: float = 0.0) -> Mesh:
    """Return a ship heading east at a distance north of the camera."""
    mesh = build_ship(kind, np.random.default_rng(2)).mesh
    return mesh.moved(np.eye(3), (aside_m, distance_m, 0.0))


def _no_land() -> np.ndarray:
    return np.zeros((2 * _HEIGHT, 2 * _WIDTH), dtype=np.float32)


@pytest.mark.parametrize("kind", [ShipType.TUG, ShipType.CONTAINER_SHIP, ShipType.SAILING_BOAT])
def test_a_silhouette_reaches_from_bow_to_stern_and_to_the_masthead(
    camera: Camera, kind: ShipType
) -> None:
    """Measured from the pixels it equals the projected mesh to a sample's width."""
    mesh = _ship(kind, 240.0)
    (view,) = view_hulls(camera, [mesh], 2, _no_land())
    rows, columns = np.nonzero(view.raster.mask)
    low = np.array([columns.min() + view.raster.window.left, rows.min() + view.raster.window.top])
    high = np.array([columns.max() + view.raster.window.left, rows.max() + view.raster.window.top])
    pixels = camera.project(mesh.vertices) + 0.5
    assert low / 2 == pytest.approx(pixels.min(axis=0), abs=0.75)
    assert (high + 1) / 2 == pytest.approx(pixels.max(axis=0), abs=0.75)


def test_a_nearer_ship_hides_what_is_behind_it(camera: Camera) -> None:
    """A tug behind a container ship loses pixels; the nearer one keeps all of its own."""
    meshes = [_ship(ShipType.TUG, 330.0), _ship(ShipType.CONTAINER_SHIP, 260.0)]
    far, near = view_hulls(camera, meshes, 1, _no_land()[::2, ::2].copy())
    assert near.visible.sum() == near.raster.mask.sum()
    assert far.visible.sum() < 0.7 * far.raster.mask.sum()


def test_land_in_front_hides_a_ship(camera: Camera) -> None:
    """Land nearer than the hull takes its pixels, land behind it takes none."""
    mesh = _ship(ShipType.TUG, 300.0)
    near, far = np.full((2, _HEIGHT, _WIDTH), 1 / 200, dtype=np.float32)
    far[:] = 1 / 400
    assert not view_hulls(camera, [mesh], 1, near)[0].visible.any()
    assert view_hulls(camera, [mesh], 1, far)[0].visible.any()


def test_pixels_outside_the_image_are_kept_but_not_visible(camera: Camera) -> None:
    """Half a ship beyond the border is about half visible."""
    half = 240.0 * _WIDTH / 2 / float(camera.intrinsics.K[0, 0])
    (view,) = view_hulls(camera, [_ship(ShipType.FERRY, 240.0, half)], 2, _no_land())
    share = view.visible.sum() / view.raster.mask.sum()
    assert 0.25 < share < 0.75


def test_a_mirror_image_hangs_below_the_waterline() -> None:
    """Heights are turned about the water level, and faces still point outwards."""
    mesh = _ship(ShipType.TUG, 0.0)
    still = mirrored(mesh, 0.4)
    assert still.vertices[:, 2].max() == pytest.approx(0.8)
    assert still.normals() == pytest.approx(mesh.normals() * (1, 1, -1), abs=1e-9)
