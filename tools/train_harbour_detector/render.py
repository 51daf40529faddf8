"""Render scenes to train on: one file for each seed, images 640x480 with their boxes.

Harbours differ in everything the simulation draws, and here also in date, hour, density of traffic
and number of moored ships. Every third seed is rendered twice as large and reduced as the
letterbox will do it, so that the network meets both grains. No AIS is sent: nobody would read it.
"""

import argparse
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from app.simulation.harbour import make_harbour
from app.simulation.settings import HarbourSettings, TrafficSettings
from app.simulation.ship_plans import Fleet
from tools.train_harbour_detector.targets import boxes_of

WIDTH_PX, HEIGHT_PX = 640, 480
_IMAGES_PER_SESSION = 4


def render_seed(seed: int, images: int, folder: Path) -> Path:
    """Render one harbour of the training fleet; a file that exists is not made again."""
    path = folder / f"harbour_{seed:06d}.npz"
    if path.exists():
        return path
    cv2.setNumThreads(1)  # the processes are as many as the cores
    rng = np.random.default_rng([seed, 77])
    enlarged = 2 if seed % 3 == 0 else 1
    traffic = TrafficSettings(
        spacing_s=float(rng.uniform(16, 40)), moored_vessels=int(rng.integers(1, 6)),
        no_ais_share=1.0, moored_with_ais_share=0.0,
    )  # fmt: skip
    settings = replace(
        HarbourSettings(), traffic=traffic, images_per_session=_IMAGES_PER_SESSION,
        fleet=Fleet.TRAINING,
    )  # fmt: skip
    start = datetime(2026, 3, 20, 4, tzinfo=UTC) + timedelta(
        days=int(rng.integers(0, 180)), minutes=int(rng.integers(0, 270))
    )
    harbour = make_harbour(
        seed, images, WIDTH_PX * enlarged, HEIGHT_PX * enlarged, start=start, settings=settings
    )
    pictures, boxes, owners = [], [], []
    for number, frame in enumerate(harbour.frames):
        seen = frame.observe()
        picture = seen.image
        if enlarged > 1:
            picture = cv2.resize(picture, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_LINEAR)
        found = boxes_of(seen.truth, WIDTH_PX * enlarged)
        found[:, :4] /= enlarged
        pictures.append(picture)
        boxes.append(found)
        owners.append(np.full(len(found), number))
    unfinished = path.with_suffix(".part.npz")
    np.savez(
        unfinished, images=np.stack(pictures), boxes=np.concatenate(boxes),
        image_of_box=np.concatenate(owners),
    )  # fmt: skip
    unfinished.rename(path)
    return path


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for the files")
    parser.add_argument("--seeds", type=int, nargs=2, required=True, metavar=("FIRST", "END"))
    parser.add_argument("--images", type=int, default=16, help="images of each harbour")
    parser.add_argument("--processes", type=int, default=2)
    wanted = parser.parse_args()
    wanted.out.mkdir(parents=True, exist_ok=True)
    job = partial(render_seed, images=wanted.images, folder=wanted.out)
    # Fresh processes: a forked OpenCV may hang on threads that do not exist in the child.
    with get_context("spawn").Pool(wanted.processes) as pool:
        for path in pool.imap(job, range(*wanted.seeds)):
            print(path, flush=True)


if __name__ == "__main__":
    _main()
