"""Images a second of a run, beside a bare loop of decoding and ONNX Runtime on the same files.

The run is the whole of it: a real worker that decodes, detects, reads AIS, matches, fuses and
stores every row durably on SQLite. The loop only decodes in full, letterboxes and runs the same
model on all cores, with the same memory and thread settings as the worker (with the libraries'
defaults it is the slower of the two), and as patiently (workers are nice). They take
turns, because a machine's speed drifts by the minute. A run decodes and detects beside fusing and
storing, so it needs a second core to keep up by the clock; CPU time says what it costs where other
programs want the cores too, less what the worker takes for looking for work meanwhile. Runs are
done with whole photographs, with photographs decoded smaller, and over images whose detections are
known, which shows what fusing again costs.
`quaymark bench pipeline` does 60 images in 3 rounds; the environment may say other IMAGES, ROUNDS.
"""

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import onnxruntime
import sqlalchemy as sa

from app.tables.imagery import Image
from benchmarks.workbench import SHARED, Workbench, show_load, workbench
from tests.factories.norderelbe import Published, make_norderelbe
from worker.inference.image import decode_image
from worker.main import NICENESS

IMAGES = int(os.environ.get("IMAGES", "60"))
ROUNDS = int(os.environ.get("ROUNDS", "3"))
INPUT_PX = 416
IDLE_S = 5.0
AIMS = {"run": 0.95, "run, decoded at 1/4": 1.3}


class Taken(NamedTuple):
    """Images a second, by the clock and by CPU time."""

    a_second: float
    a_cpu_second: float


def main() -> None:
    """Run the benchmark and print rates and ratios."""
    if not SHARED.is_dir():
        print("needs ../shared: real photographs and weights")
        return
    published = Published.read(SHARED)
    with workbench(worker=True) as bench:
        os.nice(NICENESS)
        viewport_id, _ = make_norderelbe(bench.database, bench.storage, published, IMAGES)
        paths = _paths(bench)
        session = _session(published.weights)
        idle = _idle_share(bench)

        def run(**parameters: object) -> Callable[[], Taken]:
            return lambda: _run(bench, viewport_id, parameters, idle)

        _run(bench, viewport_id, {"score_threshold": 0.2}, 0.0)  # warm
        rounds: list[dict[str, Taken]] = []
        for number in range(ROUNDS):
            threshold = 0.25 + number / 100  # another one: boxes are found anew
            ways = {
                "bare loop": lambda: _loop(session, paths),
                "run": run(score_threshold=threshold, decoding_divisor=1),
                "run, decoded at 1/2": run(score_threshold=threshold, decoding_divisor=2),
                "run, decoded at 1/4": run(score_threshold=threshold, decoding_divisor=4),
                "run, detections known": run(
                    score_threshold=threshold, decoding_divisor=1, border_tolerance_px=2.5
                ),
            }
            rounds.append({name: way() for name, way in ways.items()})
    _show(rounds)
    show_load()


def _show(rounds: list[dict[str, Taken]]) -> None:
    for name in rounds[0]:
        rates = [one[name].a_second for one in rounds]
        clock = statistics.median(one[name].a_second / one["bare loop"].a_second for one in rounds)
        cpu = statistics.median(
            one[name].a_cpu_second / one["bare loop"].a_cpu_second for one in rounds
        )
        aim = ""
        if name in AIMS:
            aim = f"; aim {AIMS[name]:.2f}: {'met' if clock >= AIMS[name] else 'MISSED'}"
        print(
            f"{name:<22} {statistics.median(rates):6.1f} images/s, {clock:.2f} of the bare loop "
            f"by the clock, {cpu:.2f} by CPU{aim}"
        )


def _paths(bench: Workbench) -> list[Path]:
    with bench.database.reading() as session:
        hashes = session.scalars(sa.select(Image.sha256).order_by(Image.id)).all()
    return [path for sha256 in hashes if (path := bench.storage.local_path(sha256))]


def _session(weights: bytes) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(weights, options, providers=["CPUExecutionProvider"])


def _loop(session: onnxruntime.InferenceSession, paths: list[Path]) -> Taken:
    name = session.get_inputs()[0].name
    begun, begun_cpu = time.perf_counter(), time.process_time()
    for path in paths:
        image = decode_image(path.read_bytes())
        ratio = INPUT_PX / max(image.shape[:2])
        small = cv2.resize(image, None, fx=ratio, fy=ratio)
        canvas = np.full((INPUT_PX, INPUT_PX, 3), 114, np.uint8)
        canvas[: small.shape[0], : small.shape[1]] = small
        tensor = np.ascontiguousarray(canvas.transpose(2, 0, 1)[None], dtype=np.float32)
        session.run(None, {name: tensor})
    count = len(paths)
    return Taken(count / (time.perf_counter() - begun), count / (time.process_time() - begun_cpu))


def _idle_share(bench: Workbench) -> float:
    """Return the share of a core that a worker without work takes."""
    begun, begun_cpu = time.perf_counter(), bench.worker_cpu_s()
    time.sleep(IDLE_S)
    return (bench.worker_cpu_s() - begun_cpu) / (time.perf_counter() - begun)


def _run(bench: Workbench, viewport_id: int, parameters: dict[str, object], idle: float) -> Taken:
    begun_cpu = bench.worker_cpu_s()
    run = bench.finish(bench.start_run(viewport_id, **parameters))
    cpu_s = bench.worker_cpu_s() - begun_cpu
    assert run.started_at is not None
    assert run.finished_at is not None
    clock_s = (run.finished_at - run.started_at).total_seconds()
    return Taken(run.image_count / clock_s, run.image_count / (cpu_s - idle * clock_s))


if __name__ == "__main__":
    main()
