"""How well headings are found where AIS has none: nobody carries a compass, and many creep.

Harbours as for poses, without any heading in the recording, at the usual speed and at less than a
third of it: then courses are unsteady, and the way from place to place has to tell. Printed are
the errors of the states' headings and of the poses', by their source, over vessels that move; and
how many of the vessels that could be matched got a pose.
"""

import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from app.domain.fusion import Preset
from app.domain.vessel_state import HeadingSource
from app.simulation.settings import TrafficSettings
from benchmarks.bench_accuracy import SeedResult, judge, print_headings

SEEDS = range(3000, 3012)
MOST_DEG = 8.0  # of the median error
NO_COMPASS = replace(
    TrafficSettings(), class_a_without_heading_share=1.0, class_b_without_heading_share=1.0
)
SPEEDS = {
    "at the usual speed": NO_COMPASS,
    "creeping": replace(NO_COMPASS, speed_factor=0.3, spacing_s=60.0),
}


def report(label: str, results: list[SeedResult]) -> None:
    """Print one table, and whether medians over all poses are as small as they should be."""
    matched, matchable = (
        sum(getattr(r, name) for r in results) for name in ("matched", "matchable")
    )
    print(f"{label}: {matched} poses of {matchable} matchable vessels")
    print_headings(results)
    for source in (HeadingSource.COURSE, HeadingSource.TRACK):
        errors = [pose for of in results for _, pose in of.headings[source]]
        if errors:
            median = float(np.median(errors))
            verdict = "met" if median <= MOST_DEG else "MISSED"
            print(f"   {source}: median {median:.1f} deg of {len(errors)} poses: {verdict}")


def main() -> None:
    """Judge harbours at both speeds."""
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        for label, traffic in SPEEDS.items():
            judged = list(pool.map(partial(judge, traffic=traffic), SEEDS))
            report(label, [of[Preset.WATERLINE] for of in judged])
    print(f"took {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
