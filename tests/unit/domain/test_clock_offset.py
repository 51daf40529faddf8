"""How far a camera's clock is off, told from vessels on a river."""

from dataclasses import replace

import numpy as np
import pytest

from app.domain.camera import Camera, Intrinsics
from app.domain.clock_offset import (
    OffsetSettings,
    TimedPair,
    estimate_offset,
    estimate_parts,
    matches_agree,
)
from app.domain.clock_sight import TimedImage
from app.domain.detection import Detection
from app.domain.vessel_path import VesselPath

SETTINGS = OffsetSettings(search_s=100.0)
IMAGES = 16


def looking_north(width_px: int = 1600, height_px: int = 1200) -> Camera:
    """Return a camera 30 m above the water that looks north, a little down."""
    tilt = np.radians(6.0)
    right = np.array([1.0, 0.0, 0.0])
    forward = np.array([0.0, np.cos(tilt), -np.sin(tilt)])
    K = np.array([[1500.0, 0, 800.0], [0, 1500.0, 600.0], [0, 0, 1]])
    rotation = np.vstack([right, np.cross(forward, right), forward])
    return Camera(Intrinsics(width_px, height_px, K), rotation, np.array([0.0, 0.0, 30.0]))


def passages(rng: np.random.Generator, count: int = 10) -> list[VesselPath]:
    """Return vessels that pass from east to west or back, at their own speed and distance."""
    paths = []
    for number in range(count):
        times_s = np.arange(-400.0, 1700.0, 8.0)
        speed = float(rng.uniform(2.5, 7.0)) * (1 if number % 2 else -1)
        middle_s = float(rng.uniform(0, 1200))
        x = speed * (times_s - middle_s)
        y = np.full_like(x, rng.uniform(250, 700))
        noise = rng.normal(0, 2.0, (2, 1)) + rng.normal(0, 0.5, (2, len(x)))
        half_m, beam_m = float(rng.uniform(10, 45)), float(rng.uniform(3, 8))
        hull = [(half_m, beam_m), (half_m, -beam_m), (-half_m, -beam_m), (-half_m, beam_m)]
        paths.append(
            VesselPath(
                identifier=str(number),
                times_s=times_s,
                antenna_in_world=np.column_stack([x + noise[0], y + noise[1], np.zeros_like(x)]),
                headings_deg=np.full_like(x, 90.0 if speed > 0 else 270.0),
                hull_m=np.array(hull),
                level_m=0.0,
            )
        )
    return paths


def photographs(
    rng: np.random.Generator, paths: list[VesselPath], offset_s: float
) -> list[TimedImage]:
    """Return what is detected on images whose clock needs `offset_s` to be right."""
    camera = looking_north()
    images = []
    for true_s in np.sort(rng.uniform(0, 1200, IMAGES)):
        boxes = []
        for path in paths:
            x1, y1, x2, y2 = path.rectangles_px(camera, 0.0, np.array([true_s]))[0]
            if x1 > 3 and x2 < 1597 and rng.random() < 0.85:
                x1, y1, x2, y2 = np.array([x1, y1 - (x2 - x1) / 3, x2, y2]) + rng.normal(0, 2, 4)
                boxes.append(Detection(x1, y1, x2, y2, 0.8, 8))
        left = float(rng.uniform(0, 1400))
        boxes.append(Detection(left, 500.0, left + 80.0, 560.0, 0.4, 8))  # shows nothing
        images.append(TimedImage(float(true_s) - offset_s, camera, 0.0, boxes))
    return images


@pytest.mark.parametrize("offset_s", [90.0, -37.0, 4.0])
def test_a_wrong_clock_is_found_within_a_second(offset_s: float) -> None:
    """Too far off for any match to be right, the offset is found and its interval holds it."""
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        paths = passages(rng)

        found = estimate_offset(photographs(rng, paths, offset_s), paths, SETTINGS)

        assert found.is_known
        assert found.is_off
        assert abs(found.offset_s - offset_s) < 1.0
        assert found.low_s - 0.5 < offset_s < found.high_s + 0.5


def test_a_right_clock_is_left_alone() -> None:
    """Where the clock is right the images say so, and nothing is proposed."""
    rng = np.random.default_rng(3)
    paths = passages(rng)

    found = estimate_offset(photographs(rng, paths, 0.0), paths, SETTINGS)

    assert found.is_known
    assert not found.is_off


def test_a_wrong_receiver_is_not_the_cameras_fault() -> None:
    """Where vessels' own seconds contradict the receiver's times, the camera is not corrected."""
    rng = np.random.default_rng(1)
    paths = passages(rng)
    images = photographs(rng, paths, 90.0)
    doubtful = [replace(path, is_contradicted=number > 3) for number, path in enumerate(paths)]

    found = estimate_offset(images, doubtful, SETTINGS)

    assert (found.is_suspect, found.is_receiver, found.is_off) == (True, True, False)
    assert abs(found.offset_s - 90.0) < 1.0


def test_a_clock_that_was_set_meanwhile_is_told_for_each_time() -> None:
    """Half of the images are 40 s late: two parts, and no one offset for all of them."""
    rng = np.random.default_rng(5)
    paths = passages(rng)
    images = photographs(rng, paths, 0.0)
    half = len(images) // 2
    later = [replace(image, clock_s=image.clock_s - 40.0) for image in images[half:]]

    before, after = estimate_parts([*images[:half], *later], paths, SETTINGS)

    assert (before.first, before.last, after.last) == (0, after.first, len(images))
    assert abs(after.first - half) <= 1
    assert (before.estimate.is_off, after.estimate.is_off) == (False, True)
    assert abs(after.estimate.offset_s - 40.0) < 1.0
    mixed = [image for pair in zip(images, later, strict=False) for image in pair]
    assert not estimate_offset(mixed, paths, SETTINGS).is_known
    assert len(estimate_parts(images, paths, SETTINGS)) == 1


def test_images_that_tell_nothing_propose_nothing() -> None:
    """Boxes at places where no vessel ever was, or no boxes at all, give no offset."""
    rng = np.random.default_rng(4)
    paths = passages(rng)
    images = photographs(rng, paths, 90.0)
    elsewhere = [
        replace(image, detections=[Detection(300.0, 1000.0, 420.0, 1100.0, 0.9, 8)])
        for image in images
    ]

    assert not estimate_offset(elsewhere, paths, SETTINGS).is_known
    assert not estimate_offset([], paths, SETTINGS).is_known
    assert not estimate_offset(images, [], SETTINGS).is_known


def late(*seconds: float) -> list[TimedPair]:
    """Return pairs of as many vessels at 4 m/s, each so late."""
    return [TimedPair(vessel, late_s, 0.7, 4.0) for vessel, late_s in enumerate(seconds)]


def test_matches_show_a_right_clock_only_where_vessels_agree_closely() -> None:
    """Pairs by chance, as a clock 80 s off makes them, are not believed; nor few among many."""
    right, chance = late(0.3, -0.6, 0.9, 0.1, -0.4), late(1.8, 4.7, 1.5, -8.3, 0.5)
    settings = OffsetSettings()
    assert matches_agree(right, 12, settings)
    assert not matches_agree(chance, 12, settings)
    assert not matches_agree(late(7.3, 6.4, 7.9, 7.1, 6.6), 12, settings)
    assert not matches_agree(right, 60, settings)
    assert not matches_agree(right[:2], 4, settings)
