"""How far preset `waterline` lowers the errors of preset `paper`, on hulls neither was built from.

Ships lie strewn before a camera like the paper's; all that differs from truth has a known spread.
A figure is the mean error of one preset in share of the other's, over the same ships; its interval
comes from drawing whole roadsteads anew (bootstrap), since ships of one share their water. The
second half judges by another shipyard, other lenses and other weather than the first. `NEES` is the
median of squared errors in units of the covariance, over what it should be (1; chi-square).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.detection import Detection
from app.domain.fusion import FusedPose, FusionSettings, Preset, SeenImage, fuse_series
from app.domain.geodesy import EnuFrame
from app.domain.metrics import BoxPose, pose_error
from app.domain.vessel_state import VesselState
from app.simulation.roadstead import FRAME, RoadsteadSettings, make_roadstead
from benchmarks import other_ships
from benchmarks.other_ships import FAMILIES, Weather, make_roads

FIGURES = ("horizontal_m", "vertical_m", "heading_deg", "height_m", "add_s_m")
BOOTSTRAPS = 1000
MEDIAN_CHI2 = (2.366, 0.455, 0.455)  # of place (3), heading (1) and height (1)
# Matching is not what is judged here: each ship has an image of its own.
PAPER = FusionSettings(maximum_cost=9.0)
WATERLINE = replace(PAPER, preset=Preset.WATERLINE)


class Ship(Protocol):
    """What both shipyards give: a detection, a state and the truth."""

    @property
    def detection(self) -> Detection:
        """As a detector has it."""

    @property
    def state(self) -> VesselState:
        """As AIS has it."""

    @property
    def truth(self) -> BoxPose:
        """In the true camera's frame."""


class Roads(Protocol):
    """Ships on one water surface."""

    @property
    def camera(self) -> Camera:
        """As it is registered."""

    @property
    def ships(self) -> Sequence[Ship]:
        """All of them."""


@dataclass(frozen=True)
class Case:
    """Roads of many seeds and, where a target is set, by how many % errors must fall at least."""

    label: str
    seeds: int
    make: Callable[[int], Roads]
    frame: EnuFrame
    horizontal_target: float | None = None
    add_s_target: float | None = None
    is_counted: Callable[[Ship], bool] = lambda _ship: True


def ours(label: str, seeds: int, targets: Sequence[float] = (), **settings: float) -> Case:
    """Return a case of the simulation's hulls."""
    how = replace(RoadsteadSettings(), **settings)  # type: ignore[arg-type]  # numbers
    return Case(label, seeds, partial(make_roadstead, settings=how), FRAME, *targets)


def other(label: str, seeds: int, weather: Weather, targets: Sequence[float] = ()) -> Case:
    """Return a case of the other shipyard."""
    return Case(label, seeds, partial(make_roads, weather=weather), other_ships.FRAME, *targets)


def across(ship: Ship) -> float:
    """Return how much a ship shows its side: 0 bow or stern on, 1 broadside."""
    return float(abs(ship.truth.axes_in_cam[0, 0]))


CASES = (
    ours("20 ships, exact camera", 60, (40, 30)),
    ours("20 ships, camera 0.1 deg off", 60, (25, 20), rotation_sigma_deg=0.1),
    ours("5 ships, exact camera", 240, (20,), ships=5),
    ours("5 ships, camera 0.1 deg off", 240, ships=5, rotation_sigma_deg=0.1),
    ours("AIS 2 m, heading 1 deg", 60, position_sigma_m=2.0, heading_sigma_deg=1.0),
    ours("AIS 10 m, heading 5 deg", 60, position_sigma_m=10.0, heading_sigma_deg=5.0),
    ours("180 to 400 m", 60, farthest_m=400.0),
    ours("600 to 900 m", 60, nearest_m=600.0),
    replace(ours("bow or stern on", 60), is_counted=lambda ship: across(ship) < 0.5),
    replace(ours("three quarters", 60), is_counted=lambda ship: 0.5 <= across(ship) < 0.87),
    replace(ours("broadside", 60), is_counted=lambda ship: across(ship) >= 0.87),
    other("other hulls: 20 ships, exact camera", 60, Weather(), (40, 30)),
    other("other hulls: camera 0.1 deg off", 60, Weather(rotation_sigma_deg=0.1), (25, 20)),
    other("other hulls: 5 ships", 240, Weather(ships=5), (20,)),
    other("other hulls: heavy-tailed AIS", 40, Weather(heavy_tails=True)),
    other("other hulls: AIS said to be 10 m", 40, Weather(stated_position_m=10.0)),
    other("other hulls: boxes 2 px too small", 40, Weather(edge_bias_px=-2.0)),
    other("other hulls: boxes off by 3 px", 40, Weather(edge_sigma_px=3.0)),
    other("other hulls: boxes off by 2 %", 40, Weather(edge_share=0.02)),
    other("other hulls: level 2 m off", 40, Weather(level_sigma_m=2.0)),
    other("other hulls: sizes entered 2 m wrong", 40, Weather(size_sigma_m=2.0)),
    other(
        "other hulls: wide lens, 12 m high",
        40,
        Weather(focal_px=3000, camera_height_m=12, nearest_m=120, farthest_m=500),
    ),
    other(
        "other hulls: 60 m high, to 1800 m",
        40,
        Weather(camera_height_m=60, nearest_m=500, farthest_m=1800),
    ),
    *(other(f"only: {family}", 20, Weather(family=family)) for family in FAMILIES),
)


def poses_of(roads: Roads, frame: EnuFrame, settings: FusionSettings) -> list[FusedPose]:
    """Fuse a ship an image, a second apart."""
    images = [SeenImage([s.detection], [s.state], 0.0, at) for at, s in enumerate(roads.ships)]
    results = fuse_series(roads.camera, frame, images, settings)
    return [pose for result in results for pose in result.poses]


def errors(roads: Roads, frame: EnuFrame, settings: FusionSettings) -> FloatArray:
    """Return absolute errors and normalised squared ones (ships, figures and 3) of all poses."""
    poses = poses_of(roads, frame, settings)
    return np.array([_row(roads, *both) for both in zip(poses, roads.ships, strict=True)])


def _row(roads: Roads, pose: FusedPose, ship: Ship) -> list[float]:
    error = pose_error(BoxPose.of(pose), ship.truth)
    figures = [abs(getattr(error, name)) for name in FIGURES]
    covariance = pose.position_covariance_in_enu_m2
    if covariance is None or not pose.heading_sigma_deg or not pose.height_sigma_m:
        return [*figures, np.nan, np.nan, np.nan]
    off = roads.camera.R_cam_from_world.T @ (pose.centroid_in_cam_m - ship.truth.centroid_in_cam_m)
    return [
        *figures,
        float(off @ np.linalg.solve(covariance, off)),
        (error.heading_deg / pose.heading_sigma_deg) ** 2,
        (error.height_m / pose.height_sigma_m) ** 2,
    ]


def compare(case: Case) -> bool:
    """Print the errors of both presets and their ratio with its interval; tell if targets hold."""
    pairs = []
    for seed in range(case.seeds):
        roads = case.make(seed)
        counted = [case.is_counted(ship) for ship in roads.ships]
        pairs.append([errors(roads, case.frame, how)[counted] for how in (PAPER, WATERLINE)])
    rng = np.random.default_rng(0)
    sums = np.array([[of[:, : len(FIGURES)].sum(axis=0) for of in pair] for pair in pairs])
    drawn = sums[rng.integers(len(sums), size=(BOOTSTRAPS, len(sums)))].sum(axis=1)
    low, high = 100 * (np.percentile(drawn[:, 1] / drawn[:, 0], [2.5, 97.5], axis=0) - 1)
    paper, waterline = sums.sum(axis=0) / sum(len(pair[0]) for pair in pairs)
    change = 100 * (waterline / paper - 1)
    all_met = True
    for column, name in enumerate(FIGURES):
        target = {"horizontal_m": case.horizontal_target, "add_s_m": case.add_s_target}.get(name)
        is_met = target is None or change[column] <= -target
        all_met = all_met and is_met
        verdict = f"  at least {target} % less: {'met' if is_met else 'MISSED'}" if target else ""
        print(
            f"   {name:<14}{paper[column]:7.2f}{waterline[column]:9.2f}  {change[column]:+5.0f} %"
            f"  [{low[column]:+.0f}, {high[column]:+.0f}]{verdict}"
        )
    normalised = np.median(np.concatenate([pair[1] for pair in pairs])[:, -3:], axis=0)
    place, heading, height = normalised / MEDIAN_CHI2
    print(f"   NEES of place {place:.2f}, heading {heading:.2f}, height {height:.2f}")
    return all_met


def main() -> None:
    """Print one table a case."""
    print(f"   {'mean error':<14}{'paper':>7}{'waterline':>11}  change, 95 % interval")
    missed = []
    for case in CASES:
        print(case.label)
        if not compare(case):
            missed.append(case.label)
    print("all targets met" if not missed else f"targets MISSED: {', '.join(missed)}")


if __name__ == "__main__":
    main()
