"""Which way of matching finds the vessel that a detection shows, and how often it is wrong.

Harbours of judging hulls with a quarter of the vessels silent, false positives, convoys and gaps in
the AIS; cameras registered by PnP, states decoded from the recording. All methods get the same
detections and the same states at the image's time. A match is right when the detection's silhouette
is that vessel's; recall counts the vessels with AIS that are at least half visible. A vessel's
identity is its MMSI in every image, so IDF1 is 2 right / (matches + vessels).
"""

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from app.domain.fusion import FusionSettings, MatchingMethod, SeenImage, fuse_series
from app.domain.tracks import TrackMethod, TrackSettings
from app.simulation.harbour import make_harbour
from app.simulation.settings import DetectorSettings, HarbourSettings, TrafficSettings
from app.simulation.ship_plans import Fleet
from benchmarks.bench_accuracy import SeedResult, heard, interval, judge_frame, registered, states

SEEDS = range(2000, 2012)
IMAGES = 40
SETTINGS = HarbourSettings(
    traffic=replace(TrafficSettings(), no_ais_share=0.25, gap_share=0.2, spacing_s=22.0),
    detector=replace(DetectorSettings(), false_positives_per_image=0.5),
    fleet=Fleet.JUDGING,
)
TRACKING = TrackSettings(method=TrackMethod.HERMITE)
METHODS = {
    "paper, cost at most 0.5": FusionSettings(),
    "paper, cost at most 0.25": FusionSettings(maximum_cost=0.25),
    "Lu 2021: distance and bearing": FusionSettings(matching=MatchingMethod.LU_2021),
    "ground plane (2022, 2024)": FusionSettings(matching=MatchingMethod.GROUND_PLANE),
    "Huang 2021: tracks, metres": FusionSettings(matching=MatchingMethod.HUANG_2021),
    "Qu 2022: tracks, arrival": FusionSettings(matching=MatchingMethod.QU_2022),
    "likelihood (ours)": FusionSettings(matching=MatchingMethod.LIKELIHOOD),
    "track votes (ours)": FusionSettings(matching=MatchingMethod.TRACK_VOTES),
}


def judge(seed: int) -> dict[str, SeedResult]:
    """Match one harbour's images in every way."""
    harbour = make_harbour(seed, IMAGES, settings=SETTINGS)
    cameras = registered(harbour)
    positions, statics = heard(harbour)
    results = {name: SeedResult() for name in METHODS}
    for viewport, camera in cameras.items():
        frames = [frame for frame in harbour.frames if frame.viewport.name == viewport]
        known = [list(states(frame, positions, statics, TRACKING)) for frame in frames]
        level_m = harbour.site.water_level_m
        images = [
            SeenImage(frame.detections, there, level_m, frame.captured_at.timestamp())
            for frame, there in zip(frames, known, strict=True)
        ]
        for name, settings in METHODS.items():
            fused = fuse_series(camera, harbour.frame, images, settings)
            for frame, there, of_frame in zip(frames, known, fused, strict=True):
                judge_frame(frame, there, of_frame.poses, results[name])
    return results


def row(label: str, of: Sequence[SeedResult]) -> str:
    """Return a line of the table: sums, and figures with their intervals over seeds."""
    rights, wrongs = [result.matched for result in of], [result.wrong for result in of]
    precision = [100 * r / max(1, r + w) for r, w in zip(rights, wrongs, strict=True)]
    recall = [100 * result.matched / max(1, result.matchable) for result in of]
    idf1 = [
        200 * result.matched / max(1, result.matched + result.wrong + result.matchable)
        for result in of
    ]
    figures = "".join(f"{interval(values):<28}" for values in (wrongs, precision, recall, idf1))
    return f"{label:<32}{sum(rights):>6}{sum(wrongs):>6}   {figures}"


def fewer(of: Sequence[SeedResult], than: Sequence[SeedResult]) -> str:
    """Return the ratio of wrong matches with its interval: seeds drawn anew, both together."""
    wrong = np.array([[a.wrong, b.wrong] for a, b in zip(of, than, strict=True)], dtype=np.float64)
    drawn = wrong[np.random.default_rng(0).integers(len(wrong), size=(2000, len(wrong)))].sum(1)
    low, high = np.percentile(drawn[:, 0] / np.maximum(drawn[:, 1], 1), [2.5, 97.5])
    ours, theirs = wrong.sum(0)
    return f"{ours / max(theirs, 1):.2f} [{low:.2f}, {high:.2f}]"


def main() -> None:
    """Judge all seeds and print one table."""
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        judged = list(pool.map(judge, SEEDS))
    print(f"{len(judged)} seeds of {IMAGES} images; 25 % silent vessels, gaps, false positives")
    names = ("wrong a harbour", "precision, %", "recall, %", "IDF1, %")
    print(f"{'':<32}{'right':>6}{'wrong':>6}   " + "".join(f"{name:<28}" for name in names))
    for name in METHODS:
        print(row(name, [of[name] for of in judged]))
    paper, *_, likelihood, votes = ([of[name] for of in judged] for name in METHODS)
    for name, ours in (("likelihood", likelihood), ("track votes", votes)):
        print(f"wrong matches of {name} in share of the paper's: {fewer(ours, paper)}")
    print(f"took {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
