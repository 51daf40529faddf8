"""Images a second of a run, beside a bare loop of decoding and ONNX Runtime on the same files.

The run is the whole of it: a real worker that decodes, detects, reads AIS, matches, fuses and
stores every row durably on SQLite. The loop only decodes in full, letterboxes and runs the same
model with as many threads, with the same memory and thread settings as the worker (with the
libraries' defaults it is the slower of the two). They take turns, because a machine's speed drifts
by the minute. A run over images whose detections are known shows what fusing again costs.
"""

import statistics
import time
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
import sqlalchemy as sa

from app.tables.imagery import Image
from app.tables.runs import Run
from benchmarks.workbench import SHARED, Workbench, show_load, workbench
from tests.factories.norderelbe import Published, make_norderelbe
from worker.inference.image import decode_image

IMAGES = 60
ROUNDS = 3
INPUT_PX = 416
AIM = 1.25


def main() -> None:
    """Run the benchmark and print rates and ratios."""
    if not SHARED.is_dir():
        print("needs ../shared: real photographs and weights")
        return
    published = Published.read(SHARED)
    with workbench(worker=True) as bench:
        viewport_id, _ = make_norderelbe(bench.database, bench.storage, published, IMAGES)
        paths = _paths(bench)
        session = _session(published.weights)
        _rate(bench.finish(bench.start_run(viewport_id, score_threshold=0.2)))  # warm
        loops, runs, again = [], [], []
        for number in range(ROUNDS):
            threshold = 0.25 + number / 100
            loops.append(_loop_rate(session, paths))
            runs.append(
                _rate(bench.finish(bench.start_run(viewport_id, score_threshold=threshold)))
            )
            again.append(
                _rate(
                    bench.finish(
                        bench.start_run(viewport_id, score_threshold=threshold, maximum_cost=0.4)
                    )
                )
            )
    for label, rates in (
        ("bare loop", loops),
        ("run", runs),
        ("run with known detections", again),
    ):
        shown = ", ".join(f"{rate:.1f}" for rate in rates)
        print(f"{label:<26} {statistics.median(rates):6.1f} images/s  (rounds: {shown})")
    ratio = statistics.median(loop / run for loop, run in zip(loops, runs, strict=True))
    print(f"a run takes {ratio:.2f} times as long as the bare loop")
    print(f"aim: at most {AIM:.2f} times: {'met' if ratio <= AIM else 'MISSED'}")
    show_load()


def _paths(bench: Workbench) -> list[Path]:
    with bench.database.reading() as session:
        hashes = session.scalars(sa.select(Image.sha256).order_by(Image.id)).all()
    return [path for sha256 in hashes if (path := bench.storage.local_path(sha256))]


def _session(weights: bytes) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(weights, options, providers=["CPUExecutionProvider"])


def _loop_rate(session: onnxruntime.InferenceSession, paths: list[Path]) -> float:
    name = session.get_inputs()[0].name
    begun = time.perf_counter()
    for path in paths:
        image = decode_image(path.read_bytes())
        ratio = INPUT_PX / max(image.shape[:2])
        small = cv2.resize(image, None, fx=ratio, fy=ratio)
        canvas = np.full((INPUT_PX, INPUT_PX, 3), 114, np.uint8)
        canvas[: small.shape[0], : small.shape[1]] = small
        tensor = np.ascontiguousarray(canvas.transpose(2, 0, 1)[None], dtype=np.float32)
        session.run(None, {name: tensor})
    return len(paths) / (time.perf_counter() - begun)


def _rate(run: Run) -> float:
    assert run.started_at is not None
    assert run.finished_at is not None
    return run.image_count / (run.finished_at - run.started_at).total_seconds()


if __name__ == "__main__":
    main()
