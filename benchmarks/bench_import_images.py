"""Photographs a second of a bulk import, beside copying and hashing the same files.

The yardstick reads each file, computes its SHA-256 and writes a copy, and promises nothing about a
power cut. The imports, from the shell and over REST, do the same, check every photograph, read its
EXIF, flush all to the disk, keep a row of each and commit them as one batch. They take turns,
because a machine's speed drifts by the minute. `IMAGES=400` in the environment makes it short.
"""

import hashlib
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from app.db import Database
from app.tables.sites import Camera
from benchmarks.uploads import Announced, Uploads
from benchmarks.workbench import ROOT, SHARED, Workbench, show_load, workbench
from tests.factories.imagery import photograph
from tests.factories.sites import make_camera, make_site

IMAGES = int(os.environ.get("IMAGES", "4000"))
IMAGE_BYTES = 500_000
PACK_BYTES = 12 << 20
ANNOUNCED_AT_ONCE = 1_000
CONNECTIONS = 3
ROUNDS = 3
AIM = 0.5
SIZE = (2560, 1920)


def main() -> None:
    """Run the benchmark and print rates and ratios."""
    ratios: dict[str, list[float]] = {"shell": [], "REST": []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = _make_files(folder / "card")
        for number in range(ROUNDS):
            copying_s = _taken_s(lambda: _copy_and_hash(files, folder / "copy"))
            shutil.rmtree(folder / "copy")
            shell_s = _shell_s(folder / "card")
            rest_s = _rest_s(files)
            ratios["shell"].append(copying_s / shell_s)
            ratios["REST"].append(copying_s / rest_s)
            print(
                f"round {number + 1}: copying and hashing {copying_s:.1f} s, shell {shell_s:.1f} s,"
                f" REST {rest_s:.1f} s for {len(files)} images"
            )
    for path, found in ratios.items():
        ratio = statistics.median(found)
        verdict = "met" if ratio >= AIM else "MISSED"
        print(f"{path}: {ratio:.2f} of the speed of copying and hashing (aim {AIM}: {verdict})")
    show_load()


def _make_files(folder: Path) -> list[Path]:
    """Write photographs of about half a megabyte, no two alike."""
    folder.mkdir()
    real = SHARED / "real/bonk/image/00139255c1d7dd9c.jpg"
    picture = real.read_bytes() if real.exists() else photograph(1, *SIZE)
    rng = np.random.default_rng(1)
    files = []
    for number in range(IMAGES):
        # A comment makes the bytes differ and brings the file to its size.
        padding = rng.bytes(max(8, IMAGE_BYTES - len(picture)))
        comments = b"".join(
            b"\xff\xfe" + (len(part) + 2).to_bytes(2) + part
            for part in (padding[at : at + 60_000] for at in range(0, len(padding), 60_000))
        )
        file = folder / f"20260701_{number // 3600:02}{number // 60 % 60:02}{number % 60:02}.jpg"
        file.write_bytes(picture[:2] + comments + picture[2:])
        files.append(file)
    return files


def _copy_and_hash(files: list[Path], target: Path) -> None:
    target.mkdir()
    for file in files:
        data = file.read_bytes()
        hashlib.sha256(data).hexdigest()
        (target / file.name).write_bytes(data)


def _camera(database: Database) -> Camera:
    with database.writing() as session:
        return make_camera(session, make_site(session), width_px=SIZE[0], height_px=SIZE[1])


def _shell_s(card: Path) -> float:
    with workbench(worker=False) as bench:
        camera = _camera(bench.database)
        environment = os.environ | {"QUAYMARK_DATA_DIR": str(bench.settings.data_dir)}
        command = [str(Path(sys.executable).with_name("quaymark")), "import", "images"]

        def run() -> None:
            subprocess.run(
                [*command, str(camera.id), str(card)],
                cwd=ROOT,
                env=environment,
                check=True,
                stdout=subprocess.DEVNULL,
            )

        return _taken_s(run)


def _rest_s(files: list[Path]) -> float:
    with workbench(worker=False) as bench:
        camera = _camera(bench.database)
        return _taken_s(lambda: _send(bench, camera.id, files))


def _send(bench: Workbench, camera_id: int, files: list[Path]) -> None:
    """Send a batch as a quick script does: packs over a few connections kept alive."""
    batch = Uploads(bench.url, bench.token)
    address = batch.begin(camera_id)
    with ThreadPoolExecutor(CONNECTIONS) as pool:
        under_way = []
        for begin in range(0, len(files), ANNOUNCED_AT_ONCE):
            # While these are announced, those before them are on their way.
            announced = batch.announce(address, files[begin : begin + ANNOUNCED_AT_ONCE])
            under_way += [
                pool.submit(batch.send, address, pack) for pack in _packs(announced, PACK_BYTES)
            ]
        for each in under_way:
            each.result()
    assert batch.commit(address) == len(files)


def _packs(files: list[Announced], most_bytes: int) -> Iterator[list[Announced]]:
    pack: list[Announced] = []
    for file in files:
        if pack and sum(each.size_bytes for each in pack) + file.size_bytes > most_bytes:
            yield pack
            pack = []
        pack.append(file)
    if pack:
        yield pack


def _taken_s(do: Callable[[], None]) -> float:
    begun = time.perf_counter()
    do()
    return time.perf_counter() - begun


if __name__ == "__main__":
    main()
