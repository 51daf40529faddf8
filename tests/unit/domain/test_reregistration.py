"""Turns told from photographs: the real scene in all weathers, known turns, and what is refused."""

import itertools
import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.camera import Camera, Intrinsics
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.reregistration import Gate, Keyframe, Refusal, Turn, find_turn
from app.domain.reregistration_features import Features, extract_features
from app.domain.reregistration_rotation import rotation_angle_deg
from app.domain.reregistration_scenery import Scene, scenery
from app.domain.rotations import matrix_from_rotvec

PHOTOGRAPHS = ("00139255c1d7dd9c", "0a4a2c7b525668be", "0aab0dffe4ab4bc7", "0b03876aae8ccfec")
REFERENCE, BACKLIT, FOGGY, SUNNY = range(4)
Picture = UInt8Array


@pytest.fixture(scope="module")
def bonk(shared_dir: Path) -> Path:
    """Give the folder of the published photographs, all of one scene."""
    return shared_dir / "real" / "bonk"


@pytest.fixture(scope="module")
def intrinsics(bonk: Path) -> Intrinsics:
    """Give the published camera's intrinsics."""
    published = json.loads((bonk / "camera.json").read_text())
    return Intrinsics(published["width"], published["height"], np.array(published["K"]))


@pytest.fixture(scope="module")
def pictures(bonk: Path) -> list[Picture]:
    """Give four photographs: autumn, backlight with a ferry, fog in winter, summer."""
    paths = [next(bonk.glob(f"*/{name}.jpg")) for name in PHOTOGRAPHS]
    return [np.asarray(cv2.imread(str(path)), np.uint8) for path in paths]


@pytest.fixture(scope="module")
def features(pictures: list[Picture]) -> list[Features]:
    """Give what the photographs are recognised by."""
    return [extract_features(picture) for picture in pictures]


def known(features: Features, number: int = 0, turned: FloatArray | None = None) -> Keyframe:
    """Return a photograph as a keyframe, by default as the reference itself."""
    return Keyframe(number, features.keep(slice(8000)), np.eye(3) if turned is None else turned)


def turned_picture(picture: Picture, intrinsics: Intrinsics, R: FloatArray) -> Picture:
    """Return what a camera sees that turned by R."""
    H = intrinsics.K @ R @ np.linalg.inv(intrinsics.K)
    size = (intrinsics.width_px, intrinsics.height_px)
    return np.asarray(cv2.warpPerspective(picture, H, size, borderValue=(90, 90, 90)), np.uint8)


def test_all_pairs_of_the_scene_agree_around_each_loop(
    features: list[Features], intrinsics: Intrinsics
) -> None:
    """Seasons, backlight and fog apart, all six pairs pass, and each loop closes to 0.1 degree."""
    turns: dict[tuple[int, int], Turn] = {
        (a, b): find_turn(features[b], intrinsics, [known(features[a])], Gate())
        for a, b in itertools.combinations(range(len(features)), 2)
    }
    assert [pair for pair, turn in turns.items() if not turn.passed] == []
    R = {pair: turn.R_from_reference for pair, turn in turns.items()}
    for a, b, c in itertools.combinations(range(len(features)), 3):
        ab, bc, ac = R[a, b], R[b, c], R[a, c]
        assert ab is not None
        assert bc is not None
        assert ac is not None
        assert rotation_angle_deg(bc @ ab @ ac.T) < 0.1


def test_a_bank_supports_a_weak_image_better(
    features: list[Features], intrinsics: Intrinsics
) -> None:
    """Keyframes in other light lift the backlit image's support, and change its turn hardly."""
    bank = [known(features[REFERENCE])]
    alone = find_turn(features[BACKLIT], intrinsics, bank, Gate())
    for number in (FOGGY, SUNNY):
        turn = find_turn(features[number], intrinsics, bank[:1], Gate())
        bank.append(known(features[number], number, turn.R_from_reference))
    together = find_turn(features[BACKLIT], intrinsics, bank, Gate())
    assert together.inliers > 1.5 * alone.inliers
    assert len(together.keyframe_ids) == 3
    assert together.uncertainty_deg < alone.uncertainty_deg
    assert alone.R_from_reference is not None
    assert together.R_from_reference is not None
    apart = rotation_angle_deg(together.R_from_reference @ alone.R_from_reference.T)
    assert apart < 0.05


WEATHER: dict[str, Callable[[Picture], Picture]] = {
    "dark": lambda picture: (picture * 0.35).astype(np.uint8),
    "thick fog": lambda picture: (picture * 0.1 + 200).astype(np.uint8),
    "out of focus": lambda picture: np.asarray(cv2.GaussianBlur(picture, (0, 0), 4), np.uint8),
    "a poor JPEG": lambda picture: np.asarray(
        cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 15])[1], 1), np.uint8
    ),
}


@pytest.mark.parametrize(
    ("weather", "turn_deg"),
    [
        ("dark", (0.03, 0.02, 0.0)),
        ("thick fog", (1.5, -3.0, 0.8)),
        ("out of focus", (-0.7, 4.0, -2.0)),
        ("a poor JPEG", (0.1, -0.2, 0.3)),
    ],
)
def test_a_known_turn_is_found(
    pictures: list[Picture],
    features: list[Features],
    intrinsics: Intrinsics,
    weather: str,
    turn_deg: tuple[float, float, float],
) -> None:
    """A photograph turned by us is told its turn within 0.01 degree, a pixel, in bad weather."""
    R = matrix_from_rotvec(np.radians(turn_deg))
    seen = WEATHER[weather](turned_picture(pictures[REFERENCE], intrinsics, R))
    turn = find_turn(extract_features(seen), intrinsics, [known(features[REFERENCE])], Gate())
    assert turn.passed
    assert turn.R_from_reference is not None
    assert rotation_angle_deg(turn.R_from_reference @ R.T) < 0.01


def test_other_scenes_are_refused(
    pictures: list[Picture], features: list[Features], intrinsics: Intrinsics
) -> None:
    """Pictures of something else never pass: mirrored, upside down, noise, a regular pattern."""
    noise = np.random.default_rng(3).integers(0, 255, (1920, 2560, 3), dtype=np.uint8)
    grid = np.zeros((1920, 2560, 3), np.uint8)
    grid[::64], grid[:, ::64] = 255, 255
    bank = [known(features[REFERENCE]), known(features[SUNNY], 3)]
    for other in (pictures[SUNNY][:, ::-1], pictures[REFERENCE][::-1], noise, grid):
        turn = find_turn(extract_features(np.ascontiguousarray(other)), intrinsics, bank, Gate())
        assert turn.refusal is Refusal.TOO_FEW_INLIERS


def test_writing_on_the_picture_says_nothing(
    pictures: list[Picture], intrinsics: Intrinsics
) -> None:
    """A name burnt into all pictures of a camera does not make another scene pass as unmoved."""
    found = []
    for picture in (pictures[REFERENCE], np.ascontiguousarray(pictures[SUNNY][:, ::-1])):
        written = picture.copy()
        for text, place in (("CAM 3 NORDERELBE", (20, 90)), ("QUAYMARK HARBOUR", (1500, 1880))):
            cv2.putText(written, text, place, cv2.FONT_HERSHEY_SIMPLEX, 3, (255, 255, 255), 6)
        found.append(extract_features(written))
    turn = find_turn(found[1], intrinsics, [known(found[0])], Gate())
    assert turn.refusal is Refusal.TOO_FEW_INLIERS


@pytest.mark.parametrize(
    "picture",
    [
        np.full((1920, 2560, 3), 128, np.uint8),
        np.zeros((1, 1, 3), np.uint8),
        np.zeros((40, 3000, 3), np.uint8),
    ],
    ids=["blank", "a pixel", "a strip"],
)
def test_nothing_to_see_is_refused(
    picture: Picture, features: list[Features], intrinsics: Intrinsics
) -> None:
    """A blank, tiny or odd picture has no structure, and says so instead of breaking."""
    turn = find_turn(extract_features(picture), intrinsics, [known(features[REFERENCE])], Gate())
    assert turn.refusal is Refusal.NO_STRUCTURE
    assert turn.R_from_reference is None


def test_a_gate_can_be_stricter(features: list[Features], intrinsics: Intrinsics) -> None:
    """Each bound of the gate refuses by its own name, with what was found beside it."""
    bank = [known(features[REFERENCE])]
    for gate, refusal in (
        (Gate(inliers=5000), Refusal.TOO_FEW_INLIERS),
        (Gate(hull_share=0.99), Refusal.TOO_SMALL_AREA),
        (Gate(angle_deg=1.5), Refusal.TURNED_TOO_FAR),
        (Gate(uncertainty_px=0.01), Refusal.UNCERTAIN),
    ):
        turn = find_turn(features[FOGGY], intrinsics, bank, gate)
        assert turn.refusal is refusal
        assert turn.inliers > 100


def test_two_motions_are_a_doubt(features: list[Features], intrinsics: Intrinsics) -> None:
    """Where half of the points moved otherwise (a ship across the picture), nobody is believed."""
    half = features[REFERENCE].pixels_px[:, 0] > intrinsics.width_px / 2
    moved = features[REFERENCE].pixels_px + np.where(half, 40.0, 0.0)[:, None]
    two = features[REFERENCE].moved_to(moved)
    turn = find_turn(two, intrinsics, [known(features[REFERENCE])], Gate())
    assert turn.refusal is Refusal.TWO_MOTIONS


def test_water_before_the_land_and_clouds_are_left_out() -> None:
    """A landmark tells how far land is; nearer there is water, and soft blobs above are clouds."""
    frame = EnuFrame(Geodetic(53.5, 9.9, 0.0))
    north = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    intrinsics = Intrinsics(2000, 1000, np.array([[2000, 0, 1000], [0, 2000, 500], [0, 0, 1.0]]))
    camera = Camera(intrinsics, north, np.array([0.0, 0.0, 30.0]))
    scene = Scene(frame, 0.0, np.array([[0.0, 500.0, 5.0], [290.0, 500.0, 5.0]]))
    rows = {"cloud": 300.0, "crane": 300.0, "quay": 615.0, "ferry": 800.0}
    features = Features(
        np.array([[1000.0, v_px] for v_px in rows.values()]),
        np.zeros((4, 128), np.float32),
        np.array([60.0, 8.0, 8.0, 8.0]),
    )
    assert scenery(features, camera, scene).tolist() == [False, True, True, False]
    blind = Scene(frame, 0.0, np.empty((0, 3)))
    assert scenery(features, camera, blind).tolist() == [False, True, True, True]
    told = Scene(frame, 0.0, np.empty((0, 3)), nearest_land_m=400.0)
    assert scenery(features, camera, told).tolist() == [False, True, True, False]
