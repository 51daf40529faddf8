"""How fast and how exact turns are told from photographs: time an image, loops, known turns.

    python benchmarks/bench_reregistration.py [FOLDER]

FOLDER is laid out like `real/bonk` (camera.json, photographs of one scene below it). Prints, for
two threads: seconds an image against one keyframe and against a bank of three; how many pairs pass;
the loops of three; and the error over turns made by us, in weather made by us, with the 95 % bound.
Images that show something else must be refused: false acceptances are counted.
"""

import itertools
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.camera import Intrinsics
from app.domain.reregistration import Gate, Keyframe, find_turn
from app.domain.reregistration_features import Features, extract_features
from app.domain.reregistration_rotation import rotation_angle_deg
from app.domain.rotations import matrix_from_rotvec

SEEDS = range(24)
THREADS = 2
REFERENCE_FEATURES = 8000
KEYFRAME_FEATURES = 4000


def main(folder: Path) -> None:
    """Run all measurements on a folder of photographs."""
    cv2.setNumThreads(THREADS)
    published = json.loads((folder / "camera.json").read_text())
    intrinsics = Intrinsics(published["width"], published["height"], np.array(published["K"]))
    paths = sorted(folder.glob("image/*.jpg")) + sorted(folder.glob("preview/*.jpg"))
    pictures = [np.asarray(cv2.imread(str(path)), np.uint8) for path in paths]
    print(f"{len(pictures)} photographs of {intrinsics.width_px} x {intrinsics.height_px} px")
    features = measure_time(pictures, intrinsics)
    measure_pairs(features, intrinsics)
    measure_known_turns(pictures, features, intrinsics)
    measure_strangers(pictures, features, intrinsics)


def measure_time(pictures: list[UInt8Array], intrinsics: Intrinsics) -> list[Features]:
    """Print wall and processor seconds an image; returns the features."""
    features, rows = [], []
    for picture in pictures:
        begun, used = time.perf_counter(), time.process_time()
        features.append(extract_features(picture))
        rows.append((time.perf_counter() - begun, time.process_time() - used))
    report("features", rows)
    bank = [Keyframe(0, features[0].keep(slice(REFERENCE_FEATURES)), np.eye(3))]
    for number, one in enumerate(features[1:3], 1):
        turn = find_turn(one, intrinsics, bank[:1], Gate())
        if turn.R_from_reference is not None:
            kept = one.keep(slice(KEYFRAME_FEATURES))
            bank.append(Keyframe(number, kept, turn.R_from_reference))
    for name, asked in (("one keyframe", bank[:1]), (f"bank of {len(bank)}", bank)):
        rows = []
        for one in features[1:]:
            begun, used = time.perf_counter(), time.process_time()
            # No early answer: the slowest way an image can take.
            find_turn(one, intrinsics, asked, Gate(enough_inliers=1_000_000))
            rows.append((time.perf_counter() - begun, time.process_time() - used))
        report(name, rows)
    return features


def report(name: str, rows: list[tuple[float, float]]) -> None:
    """Print the median and the slowest of (wall, processor) seconds."""
    wall, used = np.array(rows).T
    print(
        f"  {name:14} {np.median(wall):.2f} s (slowest {wall.max():.2f}), "
        f"{np.median(used):.2f} s of processor"
    )


def measure_pairs(features: list[Features], intrinsics: Intrinsics) -> None:
    """Print which pairs pass, and how well loops of three close."""
    turns: dict[tuple[int, int], FloatArray] = {}
    inliers = []
    for a, b in itertools.permutations(range(len(features)), 2):
        known = Keyframe(a, features[a].keep(slice(REFERENCE_FEATURES)), np.eye(3))
        turn = find_turn(features[b], intrinsics, [known], Gate())
        if turn.passed and turn.R_from_reference is not None:
            turns[a, b] = turn.R_from_reference
            inliers.append(turn.inliers)
    count = len(features) * (len(features) - 1)
    print(f"  pairs passed   {len(turns)} of {count}, inliers {min(inliers)} to {max(inliers)}")
    loops = [
        rotation_angle_deg(turns[b, c] @ turns[a, b] @ turns[a, c].T)
        for a, b, c in itertools.permutations(range(len(features)), 3)
        if {(a, b), (b, c), (a, c)} <= turns.keys()
    ]
    print(
        f"  loops of three {len(loops)}, median {np.median(loops):.4f}, worst {max(loops):.4f} deg"
    )


def measure_known_turns(
    pictures: list[UInt8Array], features: list[Features], intrinsics: Intrinsics
) -> None:
    """Print the error over turns and weather made by us, over seeds."""
    errors, refused = [], 0
    for seed in SEEDS:
        generator = np.random.default_rng(seed)
        base = seed % len(pictures)
        axis = generator.normal(size=3) * (1, 1, 0.5)
        angle = np.radians(generator.uniform(0.02, 6.0))
        R = matrix_from_rotvec(axis / np.linalg.norm(axis) * angle)
        seen = weathered(turned(pictures[base], intrinsics, R), generator)
        known = Keyframe(base, features[base].keep(slice(REFERENCE_FEATURES)), np.eye(3))
        turn = find_turn(extract_features(seen), intrinsics, [known], Gate())
        if turn.passed and turn.R_from_reference is not None:
            errors.append(rotation_angle_deg(turn.R_from_reference @ R.T))
        else:
            refused += 1
    bound = np.quantile(errors, 0.95)
    print(
        f"  known turns    {len(errors)} found, {refused} refused, error median "
        f"{np.median(errors):.4f}, 95 % {bound:.4f}, worst {max(errors):.4f} deg"
    )


def turned(picture: UInt8Array, intrinsics: Intrinsics, R: FloatArray) -> UInt8Array:
    """Return what a camera sees that turned by R."""
    H = intrinsics.K @ R @ np.linalg.inv(intrinsics.K)
    size = (intrinsics.width_px, intrinsics.height_px)
    return np.asarray(cv2.warpPerspective(picture, H, size, borderValue=(90, 90, 90)), np.uint8)


def weathered(picture: UInt8Array, generator: np.random.Generator) -> UInt8Array:
    """Return a picture darker or brighter, in fog, out of focus, noisy and squeezed into a JPEG."""
    clear = generator.uniform(0.15, 1.0)
    light = picture.astype(np.float32) * clear + (1 - clear) * generator.uniform(80, 210)
    light = cv2.GaussianBlur(light, (0, 0), generator.uniform(0.3, 3.5))
    light += generator.normal(0, generator.uniform(0, 8), light.shape)
    encoded = cv2.imencode(
        ".jpg",
        np.clip(light, 0, 255).astype(np.uint8),
        [cv2.IMWRITE_JPEG_QUALITY, int(generator.integers(20, 90))],
    )[1]
    return np.asarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR), np.uint8)


def measure_strangers(
    pictures: list[UInt8Array], features: list[Features], intrinsics: Intrinsics
) -> None:
    """Print how many pictures of something else pass: none should."""
    count = passed = 0
    bank = [
        Keyframe(number, one.keep(slice(REFERENCE_FEATURES)), np.eye(3))
        for number, one in enumerate(features)
    ]
    for stranger in strangers(pictures):
        found = extract_features(stranger)
        for known in bank:
            count += 1
            passed += find_turn(found, intrinsics, [known], Gate()).passed
    print(f"  strangers      {passed} of {count} passed")


def strangers(pictures: list[UInt8Array]) -> Iterator[UInt8Array]:
    """Give pictures of other scenes: mirrored, upside down, noise, a pattern."""
    for picture in pictures:
        yield np.ascontiguousarray(picture[:, ::-1])
        yield np.ascontiguousarray(picture[::-1])
    yield np.random.default_rng(1).integers(0, 255, pictures[0].shape, dtype=np.uint8)
    grid = np.zeros_like(pictures[0])
    grid[::64], grid[:, ::64] = 255, 255
    yield grid


if __name__ == "__main__":
    default = Path(__file__).resolve().parents[2] / "shared" / "real" / "bonk"
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else default)
