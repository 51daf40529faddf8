"""Whether ways of matching hold where things are worse than their settings say.

Each row turns one thing of traffic drawn by another generator than the harbour's: errors beyond
what AIS and registrations admit, crowds, lone false positives, other cameras. All methods get the
same detections and states. A match is right when the detection shows that vessel.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np

from app.domain.fusion_settings import FusionSettings
from app.domain.likelihood import Odds
from app.domain.pairing import match_images
from benchmarks.bench_matching import METHODS
from benchmarks.rough_traffic import Rough, RoughTraffic, rough_traffic

SEEDS = range(6)
_BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999, 1.1)
_USUAL = Rough()
STRESSES: Mapping[str, Rough] = {
    "as usual": _USUAL,
    "AIS off by 12 m": replace(_USUAL, bias_sigma_m=12.0),
    "headings off by 12 deg": replace(_USUAL, heading_bias_deg=12.0),
    "camera turned by 0.2 deg": replace(_USUAL, camera_turn_deg=0.2),
    "water 1.5 m off": replace(_USUAL, level_error_m=1.5),
    "clock 2 s off": replace(_USUAL, clock_s=2.0),
    "dense": replace(_USUAL, vessels=16.0),
    "dense, half silent": replace(_USUAL, vessels=16.0, silent_share=0.5),
    "all silent": replace(_USUAL, silent_share=1.0),
    "85 % silent": replace(_USUAL, silent_share=0.85),
    "none silent": replace(_USUAL, silent_share=0.0, false_positives=0.05),
    "nothing detected": replace(_USUAL, miss_share=1.0),
    "30 % missed": replace(_USUAL, miss_share=0.3),
    "60 % missed, 3 false": replace(_USUAL, miss_share=0.6, false_positives=3.0),
    "wide view (95 deg)": replace(_USUAL, field_of_view_deg=95.0, nearest_m=60.0),
    "narrow view (12 deg)": replace(
        _USUAL, field_of_view_deg=12.0, nearest_m=500.0, farthest_m=2500.0
    ),
    "low camera (10 m)": replace(_USUAL, camera_height_m=10.0),
    "loose boxes": replace(_USUAL, edge_sigma_px=4.0, edge_sigma_share=0.05),
    "sizes wrong, 20 %": replace(_USUAL, wrong_size_share=0.2),
    "convoys": replace(_USUAL, convoy_share=0.6),
    "all at once": replace(
        _USUAL, bias_sigma_m=8.0, heading_bias_deg=6.0, camera_turn_deg=0.12, level_error_m=1.0,
        clock_s=1.0, vessels=9.0, miss_share=0.2, edge_sigma_share=0.03,
    ),
    "series (3 s)": replace(_USUAL, gap_s=3.0, vessels=9.0),
    "series, poor AIS": replace(_USUAL, gap_s=3.0, vessels=9.0, bias_sigma_m=12.0),
    "series, dense, half silent": replace(
        _USUAL, gap_s=3.0, vessels=16.0, silent_share=0.5, miss_share=0.2
    ),
}  # fmt: skip


@dataclass
class Tally:
    """Matches right and wrong, and vessels that could be matched."""

    right: int = 0
    wrong: int = 0
    matchable: int = 0
    # What a match was said to be worth, and whether it was right.
    stated: list[tuple[float, bool]] = field(default_factory=list)

    @property
    def idf1(self) -> float:
        """Twice the right ones in the share of matches and vessels, percent."""
        return 200 * self.right / max(1, self.right + self.wrong + self.matchable)


def tally(traffic: RoughTraffic, settings: FusionSettings) -> Tally:
    """Match all images of a camera in one way."""
    result = Tally()
    images = [image.seen for image in traffic.images]
    matched = match_images(traffic.camera, traffic.frame, images, settings)
    for image, found in zip(traffic.images, matched, strict=True):
        right = set()
        for pair in found.pairs:
            name = pair.candidate.state.identifier
            is_right = image.shows[pair.detection_index] == name
            if isinstance(pair.cost, Odds):
                result.stated.append((pair.cost.probability, is_right))
            if is_right:
                right.add(name)
            else:
                result.wrong += 1
        result.right += len(right & image.matchable)
        result.matchable += len(image.matchable)
    return result


def judge(rough: Rough, methods: Mapping[str, FusionSettings], seed: int) -> dict[str, Tally]:
    """Match one seed's traffic in every way."""
    traffic = rough_traffic(seed, rough)
    return {name: tally(traffic, settings) for name, settings in methods.items()}


def main(methods: Mapping[str, FusionSettings] = METHODS, seeds: Sequence[int] = SEEDS) -> None:
    """Print for each stress what each method makes of it: right, wrong, IDF1."""
    print(f"{len(seeds)} seeds; right/wrong and IDF1 in % of each method:")
    for number, name in enumerate(methods, 1):
        print(f"  {number} {name}")
    print(f"{'':<28}{'vessels':>8}" + "".join(f"{n:>17}" for n in range(1, len(methods) + 1)))
    everything: dict[str, list[Tally]] = {name: [] for name in methods}
    with ProcessPoolExecutor(2) as pool:
        for label, rough in STRESSES.items():
            judged = list(pool.map(partial(judge, rough, methods), seeds))
            sums = [summed([of[name] for of in judged]) for name in methods]
            cells = "".join(f"{f'{one.right}/{one.wrong} {one.idf1:5.1f}':>17}" for one in sums)
            print(f"{label:<28}{sums[0].matchable:>8}{cells}", flush=True)
            for name, one in zip(methods, sums, strict=True):
                everything[name].append(one)
    for name, tallies in everything.items():
        if tallies[0].stated:
            print_reliability(name, summed(tallies))


def summed(tallies: Sequence[Tally]) -> Tally:
    """Add up the tallies of seeds."""
    return Tally(
        sum(one.right for one in tallies),
        sum(one.wrong for one in tallies),
        sum(one.matchable for one in tallies),
        [said for one in tallies for said in one.stated],
    )


def print_reliability(label: str, tally: Tally) -> None:
    """Print how often matches of about the same stated probability are right."""
    print(f"reliability of {label}, all rows: stated, right (matches)")
    said = np.array([(probability, right) for probability, right in tally.stated])
    for low, high in pairwise(_BINS):
        here = said[(said[:, 0] >= low) & (said[:, 0] < high)]
        if len(here):
            stated, right = here.mean(axis=0)
            print(f"  {stated:6.3f} {right:6.3f} ({len(here)})")


if __name__ == "__main__":
    main()
