"""How far preset `waterline` lowers the errors of preset `paper`, on hulls neither was built from.

Ships lie strewn before a camera like the paper's; all that differs from truth has a known spread.
A figure is the mean error of one preset in share of the other's, over the same ships; its interval
comes from drawing whole roadsteads anew (bootstrap), since ships of one share their water.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.fusion import FusedPose, FusionSettings, Preset, SeenImage, fuse_series
from app.domain.metrics import BoxPose, pose_error
from app.simulation.roadstead import FRAME, Anchored, Roadstead, RoadsteadSettings, make_roadstead

FIGURES = ("horizontal_m", "vertical_m", "heading_deg", "height_m", "add_s_m")
BOOTSTRAPS = 1000
# Matching is not what is judged here: each ship has an image of its own.
PAPER = FusionSettings(maximum_cost=9.0)
WATERLINE = replace(PAPER, preset=Preset.WATERLINE)
CASES: dict[str, tuple[int, RoadsteadSettings]] = {
    "20 ships, exact camera": (60, RoadsteadSettings()),
    "20 ships, camera 0.1 deg off": (60, RoadsteadSettings(rotation_sigma_deg=0.1)),
    "5 ships, exact camera": (240, RoadsteadSettings(ships=5)),
    "5 ships, camera 0.1 deg off": (240, RoadsteadSettings(ships=5, rotation_sigma_deg=0.1)),
    "AIS 2 m, heading 1 deg": (60, RoadsteadSettings(position_sigma_m=2.0, heading_sigma_deg=1.0)),
    "AIS 10 m, heading 5 deg": (
        60,
        RoadsteadSettings(position_sigma_m=10.0, heading_sigma_deg=5.0),
    ),
    "180 to 400 m": (60, RoadsteadSettings(farthest_m=400.0)),
    "600 to 900 m": (60, RoadsteadSettings(nearest_m=600.0)),
}


def errors(stead: Roadstead, settings: FusionSettings) -> FloatArray:
    """Return the absolute errors (ships, figures) of a roadstead's poses."""
    images = [SeenImage([s.detection], [s.state], 0.0, at) for at, s in enumerate(stead.ships)]
    results = fuse_series(stead.camera, FRAME, images, settings)
    return np.array(
        [
            error_of(pose, ship)
            for result, ship in zip(results, stead.ships, strict=True)
            for pose in result.poses
        ]
    )


def error_of(pose: FusedPose, ship: Anchored) -> list[float]:
    """Return the absolute errors of one pose."""
    error = pose_error(BoxPose.of(pose), ship.truth)
    return [abs(getattr(error, name)) for name in FIGURES]


def compare(
    steads: list[Roadstead], is_counted: Callable[[Anchored], bool] = lambda _ship: True
) -> None:
    """Print the errors of both presets and their ratio with its interval."""
    pairs = []
    for stead in steads:
        counted = [is_counted(ship) for ship in stead.ships]
        pairs.append((errors(stead, PAPER)[counted], errors(stead, WATERLINE)[counted]))
    rng = np.random.default_rng(0)
    sums = np.array([[of.sum(axis=0) for of in pair] for pair in pairs])
    counts = sum(len(pair[0]) for pair in pairs)
    drawn = sums[rng.integers(len(sums), size=(BOOTSTRAPS, len(sums)))].sum(axis=1)
    low, high = np.percentile(drawn[:, 1] / drawn[:, 0], [2.5, 97.5], axis=0)
    paper, ours = sums.sum(axis=0) / counts
    for column, name in enumerate(FIGURES):
        change = 100 * (ours[column] / paper[column] - 1)
        interval = f"[{100 * (low[column] - 1):+.0f}, {100 * (high[column] - 1):+.0f}]"
        print(f"   {name:<14}{paper[column]:7.2f}{ours[column]:9.2f}  {change:+5.0f} %  {interval}")


def bows_on(ship: Anchored) -> bool:
    """Whether a ship shows the camera its bow or stern rather than its side."""
    return bool(abs(np.cos(np.radians(ship.heading_deg))) > np.sqrt(0.5))


def main() -> None:
    """Print one table a case."""
    print(f"   {'mean error':<14}{'paper':>7}{'waterline':>11}  change, 95 % interval")
    for label, (seeds, settings) in CASES.items():
        print(label)
        compare([make_roadstead(seed, settings) for seed in range(seeds)])
    steads = list(map(partial(make_roadstead, settings=RoadsteadSettings()), range(60)))
    for label, is_counted in (
        ("of the first case: bow or stern towards the camera", bows_on),
        ("of the first case: side towards the camera", lambda ship: not bows_on(ship)),
    ):
        print(label)
        compare(steads, is_counted)


if __name__ == "__main__":
    main()
