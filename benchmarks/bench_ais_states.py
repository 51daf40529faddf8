"""How far vessel states are from where vessels were: reports held out of real traffic, estimated.

Each prompt report of a moving vessel is left out and estimated from the others. Dead reckoning
starts from the latest report at least as old as the row says. Hermite has the reports just before
and after, nothing else left out, and falls into the row of the earlier one's age: where Danish
traffic falls silent for over a minute there are two dozen of these, and their 95 % says little: it
lies between the second and the third largest error.
`spec` is what was measured before Quaymark was built.

Honesty: squared errors in units of the state's covariance have a median of 1.39 if the covariance
is right, and 68 and 95 % of them lie within its ellipses. Held-out reports share most of the
receiver's own error with the others, so this is judged by what bridging adds (`bridging`), and by
the whole covariance (`whole`), which must be the larger.

Other recordings: `python -m benchmarks.bench_ais_states FILE...`.
"""

import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from datetime import UTC, datetime, timedelta
from math import cos, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.ais.recording import Recording
from app.domain.ais import MPS_PER_KN, FixTimeSource, PositionReport
from app.domain.ais_bulk import ACCURACIES, AIS_CLASSES, SOURCES, PositionTable
from app.domain.arrays import FloatArray
from app.domain.local_metres import moved, offset_m
from app.domain.track_headings import heading_at
from app.domain.track_places import turn_deg
from app.domain.tracks import TrackMethod, TrackSettings, state_at
from app.domain.vessel_state import HeadingSource, VesselState

RECORDINGS = Path(__file__).resolve().parents[2] / "shared/real/ais"
RECORDING = RECORDINGS / "dma_5min_2013-11-12_pghp.nmea.gz"
UNSTEADY = RECORDINGS / "stonesoup_SolentAIS_20160112_130211.csv"
LARGEST_BYTES = 1 << 30
MOVING_KN = 0.5
HISTORY = 12  # reports before the latest that a method may look at
AGES_S = ((2, 10), (10, 30), (30, 60), (60, 180))
SPEC_M = {
    TrackMethod.HEADING_DR: ((1.8, 11.7), (3.8, 14.8), (8.7, 37.6), (15.7, 88.5)),
    TrackMethod.COG_DR: ((1.2, 11.1), (2.4, 13.8), (5.7, 35.6), (9.4, 87.1)),
    TrackMethod.HERMITE: ((0.7, 9.8), (0.9, 8.7), (1.3, 10.9), (1.5, 11.6)),
}
# Squared length, in sigmas, of the ellipses that hold 68 and 95 % of a plane's Gaussian.
ELLIPSES = (2.28, 5.99)
RECEIVERS_NOISE_M = 0.5  # from fix to fix, in both directions


class Error(NamedTuple):
    """One estimate against the report held out, m, and its squared length in sigmas."""

    m: float
    bridging: float
    whole: float


def tracks_of(path: Path) -> list[list[PositionReport]]:
    """Return the moving vessels' prompt (or tabled) reports, one of each moment, oldest first."""
    by_vessel: dict[int, dict[datetime, PositionReport]] = defaultdict(dict)
    kept = {FixTimeSource.PROMPT, FixTimeSource.STATED}
    for report in positions_of(path):
        if report.fix_time_source in kept and (report.sog_kn or 0.0) >= MOVING_KN:
            by_vessel[report.mmsi][report.fix_time] = report
    return [[track[at] for at in sorted(track)] for track in by_vessel.values()]


def positions_of(path: Path) -> Iterator[PositionReport]:
    """Yield the positions of a recording, tables of them row by row."""
    with path.open("rb") as stream:
        for decoded in Recording(stream, max_bytes=LARGEST_BYTES).reports():
            if isinstance(decoded, PositionReport):
                yield decoded
            elif isinstance(decoded, PositionTable):
                columns = (getattr(decoded, field.name).tolist() for field in fields(decoded))
                for row in zip(*columns, strict=True):
                    yield _report(*row)


def _report(
    mmsi: int, fix_us: int, received_us: int, lat_deg: float, lon_deg: float, *others: float
) -> PositionReport:
    """Return a row of a table as a report."""
    *motion, message_type, ais_class, accuracy, source = others
    return PositionReport(
        mmsi,
        _moment(fix_us),
        _moment(received_us),
        lat_deg,
        lon_deg,
        *(None if np.isnan(value) else value for value in motion),
        int(message_type),
        AIS_CLASSES[int(ais_class)],
        ACCURACIES[int(accuracy)],
        SOURCES[int(source)],
    )


def _moment(us_since_1970: int) -> datetime:
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=us_since_1970)


def held_out(
    track: Sequence[PositionReport], method: TrackMethod, ages_s: tuple[int, int]
) -> Iterator[tuple[PositionReport, list[PositionReport]]]:
    """Yield reports with those that a method may estimate them from."""
    for index in range(1, len(track) - 1):
        target = track[index]
        starts = [index - 1] if method is TrackMethod.HERMITE else range(index - 1, -1, -1)
        for start in starts:
            age_s = (target.fix_time - track[start].fix_time).total_seconds()
            if ages_s[0] <= age_s < ages_s[1]:
                after = [track[index + 1]] if method is TrackMethod.HERMITE else []
                yield target, [*track[max(0, start - HISTORY) : start + 1], *after]
                break


def errors(
    tracks: Sequence[Sequence[PositionReport]], method: TrackMethod, ages_s: tuple[int, int]
) -> Iterator[Error]:
    """Yield the errors of all held-out reports in a row."""
    settings = TrackSettings(method, max_age_s=float(ages_s[1]))
    with_headings = any(report.heading_deg is not None for track in tracks for report in track)
    for track in tracks:
        for target, reports in held_out(track, method, ages_s):
            start = next(r for r in reversed(reports) if r.fix_time < target.fix_time)
            if with_headings and start.heading_deg is None:
                continue  # the same reports for all methods
            state = state_at(reports, [], target.fix_time, settings)
            if isinstance(state, VesselState):
                yield error_of(state, target)


def error_of(state: VesselState, target: PositionReport) -> Error:
    """Compare a state, its dead reckoning applied, with the report that was held out."""
    way_m = state.speed_kn * MPS_PER_KN * state.age_s
    heading = radians(state.heading_deg)
    place = moved(state.lat_deg, state.lon_deg, way_m * sin(heading), way_m * cos(heading))
    off = np.array(offset_m(target.lat_deg, target.lon_deg, *place))
    east, east_north, north = state.position_covariance_m2
    whole = np.array([[east, east_north], [east_north, north]])
    fix_m2 = target.position_sigma_m**2 - RECEIVERS_NOISE_M**2
    smallest = float(np.linalg.eigvalsh(whole)[0])
    bridging = whole - min(fix_m2, smallest - RECEIVERS_NOISE_M**2) * np.eye(2)
    return Error(
        float(np.hypot(*off)),
        float(off @ np.linalg.solve(bridging, off)),
        float(off @ np.linalg.solve(whole, off)),
    )


def print_table(path: Path) -> None:
    """Print the errors of all methods by age."""
    tracks = tracks_of(path)
    print(f"{path.name}: {len(tracks)} moving vessels, {sum(map(len, tracks))} reports")
    print("   error, m (median / 95 %)    spec           bridging: median, in 68, 95 %    whole")
    for method in TrackMethod:
        for row, ages_s in enumerate(AGES_S):
            found = np.array(list(errors(tracks, method, ages_s)))
            if len(found):
                spec = SPEC_M[method][row] if method in SPEC_M and path == RECORDING else None
                print(line(f"{method} {ages_s[0]}-{ages_s[1]} s", found, spec))


def line(label: str, found: FloatArray, spec: tuple[float, float] | None) -> str:
    """Return one row: errors, what was measured before, and how honest the covariances are."""
    error, bridging, whole = found.T
    before = "" if spec is None else f"{spec[0]:.1f} / {spec[1]:.1f}"
    within = [100 * np.mean(bridging <= limit) for limit in ELLIPSES]
    return (
        f"   {label:<20}{len(error):6} {np.median(error):5.1f} /{np.percentile(error, 95):6.1f}  "
        f"{before:<12}  {np.median(bridging):6.2f} {within[0]:5.0f} {within[1]:4.0f}    "
        f"{np.median(whole):6.2f} {100 * np.mean(whole <= ELLIPSES[1]):4.0f}"
    )


def print_headings(path: Path) -> None:
    """Print how far headings made without their field are from it, where there is one."""
    tracks = tracks_of(path)
    found: dict[HeadingSource, list[tuple[float, float]]] = defaultdict(list)
    for track in tracks:
        blind = [replace(report, heading_deg=None) for report in track]
        for index in range(1, len(track) - 1):
            truth = track[index].heading_deg
            made = heading_at(blind[:index], blind[index + 1 :], track[index].fix_time)
            if truth is not None and made is not None:
                off_deg = abs(turn_deg(truth, made.deg))
                found[made.source].append((off_deg, made.sigma_deg))
    print("   heading without its field, deg: median / 95 %, share within one sigma")
    for source, pairs in found.items():
        off_deg, sigma_deg = np.array(pairs).T
        print(
            f"   {source:<20}{len(pairs):6} {np.median(off_deg):5.1f} /"
            f"{np.percentile(off_deg, 95):6.1f}  {100 * np.mean(off_deg <= sigma_deg):5.0f} %"
        )


def main() -> None:
    """Print the tables of the recordings named, or of freighters (`spec`) and of pilot boats."""
    for path in [Path(name) for name in sys.argv[1:]] or [RECORDING, UNSTEADY]:
        print_table(path)
        print_headings(path)


if __name__ == "__main__":
    main()
