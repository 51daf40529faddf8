"""How far the poses of an estimator are from the truth, over harbours of many seeds.

Everything is as in a run: cameras registered by PnP from clicked keypoints, states decoded from the
NMEA recording, simulated detections, matching and fusion. Hulls are of the fleet kept for judging.
Figures are medians of a seed's errors; their mean over seeds has a 95 % interval by bootstrap. The
second table has preset `waterline`'s headings beside those its states came with, by their source.
"""

import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from app.domain.ais import PositionReport, StaticReport
from app.domain.camera import Camera
from app.domain.fusion import FusedPose, FusionSettings, Preset, SeenImage, fuse_series
from app.domain.fusion_settings import MATCHING_OF
from app.domain.keypoints import keypoints_in
from app.domain.metrics import Box, BoxPose, PoseError, best_covered, pose_error
from app.domain.nmea import NmeaDecoder, decode_lines
from app.domain.registration import register_pnp
from app.domain.track_places import turn_deg
from app.domain.tracks import TrackMethod, TrackSettings, state_at
from app.domain.vessel_state import HeadingSource, VesselState
from app.evaluation.service import LEAST_VISIBLE
from app.simulation.harbour import Frame, Harbour, make_harbour
from app.simulation.settings import HarbourSettings, TrafficSettings
from app.simulation.ship_plans import Fleet
from app.simulation.truth import VesselTruth

SEEDS = range(1000, 1012)
IMAGES = 40
TRAFFIC = TrafficSettings()
BOOTSTRAPS = 2000


@dataclass
class SeedResult:
    """What came of one harbour."""

    matchable: int = 0
    matched: int = 0
    wrong: int = 0
    errors: list[PoseError] = field(default_factory=list)
    # By source: how far the state's heading and the pose's are from the truth, deg.
    headings: dict[HeadingSource, list[tuple[float, float]]] = field(
        default_factory=lambda: defaultdict(list)
    )


def judge(seed: int, traffic: TrafficSettings = TRAFFIC) -> dict[Preset, SeedResult]:
    """Fuse one harbour's images with every preset and compare each pose with the truth."""
    settings = HarbourSettings(traffic=traffic, fleet=Fleet.JUDGING)
    harbour = make_harbour(seed, IMAGES, settings=settings)
    cameras = registered(harbour)
    positions, statics = heard(harbour)
    results = {preset: SeedResult() for preset in Preset}
    for preset, result in results.items():
        # The paper looks back only; others know what was heard after the image.
        method = TrackMethod.HEADING_DR if preset is Preset.PAPER else TrackMethod.HERMITE
        tracking = TrackSettings(method=method)
        for name, camera in cameras.items():
            frames = [frame for frame in harbour.frames if frame.viewport.name == name]
            known = [list(states(frame, positions, statics, tracking)) for frame in frames]
            images = [
                SeenImage(
                    frame.detections,
                    there,
                    harbour.site.water_level_m,
                    frame.captured_at.timestamp(),
                )
                for frame, there in zip(frames, known, strict=True)
            ]
            how = FusionSettings(preset=preset, matching=MATCHING_OF[preset])
            fused = fuse_series(camera, harbour.frame, images, how)
            for frame, there, of_frame in zip(frames, known, fused, strict=True):
                judge_frame(frame, there, of_frame.poses, result)
    return results


def registered(harbour: Harbour) -> dict[str, Camera]:
    """Register every viewport from its clicked keypoints."""
    places = {landmark.name: landmark.place for landmark in harbour.landmarks}
    cameras = {}
    for viewport in harbour.camera.viewports:
        seen = [(places[k.landmark], (k.u_px, k.v_px)) for k in viewport.keypoints]
        keypoints = keypoints_in(harbour.frame, seen)
        solution = register_pnp(harbour.frame, harbour.camera.intrinsics, keypoints)
        assert solution.camera is not None
        cameras[viewport.name] = solution.camera
    return cameras


def heard(
    harbour: Harbour,
) -> tuple[dict[int, list[PositionReport]], dict[int, list[StaticReport]]]:
    """Decode the harbour's recording."""
    positions: dict[int, list[PositionReport]] = defaultdict(list)
    statics: dict[int, list[StaticReport]] = defaultdict(list)
    for report in decode_lines(harbour.nmea_lines(), NmeaDecoder()):
        if isinstance(report, PositionReport):
            positions[report.mmsi].append(report)
        else:
            statics[report.mmsi].append(report)
    for reports in positions.values():
        reports.sort(key=lambda report: report.fix_time)
    return positions, statics


def states(
    frame: Frame,
    positions: dict[int, list[PositionReport]],
    statics: dict[int, list[StaticReport]],
    tracking: TrackSettings,
) -> Iterator[VesselState]:
    """Give the state of every vessel at the time of an image."""
    for mmsi, reports in positions.items():
        state = state_at(reports, statics.get(mmsi, []), frame.captured_at, tracking)
        if isinstance(state, VesselState):
            yield state


def judge_frame(
    frame: Frame, vessel_states: list[VesselState], poses: list[FusedPose], result: SeedResult
) -> None:
    """Add one image's poses to the result."""
    right: set[int] = set()
    for pose in poses:
        box = frame.detections[pose.detection_index]
        true = under((box.x1_px, box.y1_px, box.x2_px, box.y2_px), frame.truth)
        state = vessel_states[pose.state_index]
        mmsi = int(state.identifier)
        if true is None or true.mmsi != mmsi:
            result.wrong += 1
            continue
        right.add(mmsi)
        result.errors.append(pose_error(BoxPose.of(pose), BoxPose.of(true)))
        result.headings[state.heading_source].append(
            (
                abs(turn_deg(true.heading_deg, state.heading_deg)),
                abs(turn_deg(true.heading_deg, pose.heading_deg)),
            )
        )
    matchable = {
        truth.mmsi
        for truth in frame.truth
        if truth.mmsi and truth.visible_fraction >= LEAST_VISIBLE
    }
    result.matchable += len(matchable)
    result.matched += len(matchable & right)


def under(box_px: Box, truths: Sequence[VesselTruth]) -> VesselTruth | None:
    """Return the vessel whose silhouette a detection covers best."""
    shown = [truth for truth in truths if truth.box_px is not None]
    best = best_covered(box_px, [truth.box_px for truth in shown if truth.box_px is not None])
    return None if best is None else shown[best]


def interval(values: Sequence[float]) -> str:
    """Return a mean over seeds with its 95 % bootstrap interval."""
    rng = np.random.default_rng(0)
    data = np.asarray(values)
    means = rng.choice(data, (BOOTSTRAPS, len(data))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return f"{data.mean():7.2f}  [{low:6.2f}, {high:6.2f}]"


def main() -> None:
    """Judge all seeds and print one table."""
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        judged = list(pool.map(judge, SEEDS))
    print(
        f"{len(judged)} seeds, {IMAGES} images each, judging hulls; mean over seeds, 95 % interval"
    )
    print(f"{'':<28}" + "".join(f"{preset:<28}" for preset in Preset))
    for label, name in (
        ("horizontal error, m", "horizontal_m"),
        ("vertical error, m", "vertical_m"),
        ("heading error, deg", "heading_deg"),
        ("height error, m", "height_m"),
        ("ADD-S, m", "add_s_m"),
    ):
        print(row(f"median {label}", [medians(judged, preset, name) for preset in Preset]))
    rates = [
        [100 * of[preset].matched / of[preset].matchable for of in judged if of[preset].matchable]
        for preset in Preset
    ]
    print(row("matched, % of matchable", rates))
    wrong = [[float(of[preset].wrong) for of in judged] for preset in Preset]
    print(row("wrong matches a harbour", wrong))
    counts = {preset: sum(len(of[preset].errors) for of in judged) for preset in Preset}
    print("poses: " + ", ".join(f"{preset} {count}" for preset, count in counts.items()))
    print_headings([of[Preset.WATERLINE] for of in judged])
    print(f"matchable: with AIS and at least half visible; took {time.monotonic() - begun:.0f} s")


def print_headings(results: Sequence[SeedResult]) -> None:
    """Print the errors of headings as AIS led to expect them and as poses have them."""
    print(f"{'heading of preset waterline':<28}{'state':<28}{'pose':<28}{'pose - state':<28}poses")
    for source in HeadingSource:
        for how, figure in (("median", np.median), ("mean", np.mean)):
            seeds = [
                [float(figure(errors)) for errors in np.transpose(of.headings[source])]
                for of in results
                if of.headings[source]
            ]
            if seeds:
                state, pose = np.transpose(seeds)
                columns = [state.tolist(), pose.tolist(), (pose - state).tolist()]
                count = sum(len(of.headings[source]) for of in results)
                print(f"{row(f'{how} error, {source}, deg', columns)}{count}")


def medians(judged: Sequence[dict[Preset, SeedResult]], preset: Preset, name: str) -> list[float]:
    """Return the median error of each seed."""
    return [
        float(np.median([abs(getattr(error, name)) for error in of[preset].errors]))
        for of in judged
        if of[preset].errors
    ]


def row(label: str, columns: Sequence[Sequence[float]]) -> str:
    """Return one line of the table: a mean with its interval for each preset."""
    return f"{label:<28}" + "".join(f"{interval(values):<28}" for values in columns)


if __name__ == "__main__":
    main()
