"""How well a camera's clock is set right from the vessels on its photographs.

Harbours of many seeds, cameras registered from clicked keypoints, states decoded from the NMEA
recording, simulated detections. The clock is right, 90 s slow or fast, or whole hours off: what is
estimated, how often the interval holds the truth, and how often a right clock is called wrong, or
so suspect that a run would withhold its matches. Last, the clock is right and AIS of its own time
is missing, while at every whole and half hour there is other traffic, which shows something else:
whatever is found there is a false alarm.
"""

import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from app.domain.clock_offset import OffsetEstimate, OffsetSettings
from app.domain.clock_sight import TimedImage
from app.domain.vessel_path import VesselPath, vessel_path
from app.domain.zone_offset import ZoneSettings, find_offset
from app.simulation.harbour import Harbour, make_harbour
from app.simulation.settings import HarbourSettings
from app.simulation.ship_plans import Fleet
from benchmarks.bench_accuracy import heard, interval, registered

SEEDS = range(2000, 2012)
IMAGES = 40
INJECTED_S = (0.0, 90.0, -90.0, 7.0, 3600.0, -7213.0)
MISSING = None  # the clock is right, and AIS of its own time is missing


def judge(seed: int) -> dict[float | None, OffsetEstimate]:
    """Estimate every injected offset on one harbour."""
    harbour = make_harbour(seed, IMAGES, settings=HarbourSettings(fleet=Fleet.JUDGING))
    images, paths = seen(harbour)
    found: dict[float | None, OffsetEstimate] = {
        injected_s: find_offset(
            [replace(image, clock_s=image.clock_s - injected_s) for image in images],
            lambda _: paths,
            OffsetSettings(),
            ZoneSettings(),
        )
        for injected_s in INJECTED_S
    }
    rng = np.random.default_rng(seed)

    def others(shift_s: float) -> list[VesselPath]:
        away_s = shift_s + float(rng.uniform(400, 1400) * rng.choice((-1, 1)))
        return [replace(path, times_s=path.times_s + away_s) for path in paths]

    return found | {MISSING: find_offset(images, others, OffsetSettings(), ZoneSettings())}


def seen(harbour: Harbour) -> tuple[list[TimedImage], list[VesselPath]]:
    """Return what a run knows of a harbour's images, their clocks right, and the vessels' paths."""
    cameras = registered(harbour)
    positions, statics = heard(harbour)
    level_m = harbour.site.water_level_m
    images = [
        TimedImage(
            (frame.captured_at - harbour.start).total_seconds(),
            cameras[frame.viewport.name],
            level_m,
            frame.detections,
        )
        for frame in harbour.frames
    ]
    paths = [
        vessel_path(reports, statics.get(mmsi, []), harbour.frame, level_m, harbour.start)
        for mmsi, reports in positions.items()
    ]
    return images, [path for path in paths if path is not None]


def main() -> None:
    """Judge all seeds and print one line for each injected offset."""
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        judged = list(pool.map(judge, SEEDS))
    print(f"{len(judged)} seeds, {IMAGES} images each; mean over seeds, 95 % interval")
    names = f"{'known':>6} {'off':>4} {'suspect':>8} {'held':>5}  {'largest':>8}"
    print(f"{'injected s':>10}  {names}  |error|, s")
    missing = [of[MISSING] for of in judged]
    suspect = sum(each.is_suspect for each in missing)
    print(f"AIS missing: {sum(each.is_known for each in missing)} known, {suspect} suspect")
    for injected_s in INJECTED_S:
        found = [of[injected_s] for of in judged]
        known = [each for each in found if each.is_known]
        errors = [abs(each.offset_s - injected_s) for each in known]
        held = sum(each.low_s <= injected_s <= each.high_s for each in known)
        off = sum(each.is_off for each in found)
        suspect = sum(each.is_suspect for each in found)
        half_s = np.mean([each.high_s - each.offset_s for each in known])
        print(
            f"{injected_s:10.0f}  {len(known):6d} {off:4d} {suspect:8d} {held:5d}  "
            f"{max(errors):8.2f}  {interval(errors)}   +- {half_s:.2f}"
        )
    print(f"took {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
