"""Distinct AIS messages from a file to committed rows, beside pyais on the same file.

pyais alone only reads and decodes; the import also checks every sentence, dates it, drops repeats,
keeps the accounting and stores the rows. Both run as processes of their own, in turns, so that a
busy machine slows both; the ratio of medians counts. Memory is the largest that a process ever
took, at growing sizes. By default a quarter of a million, to be done in minutes; give the number
of thousands for more: `python benchmarks/bench_ais_import.py 1000`.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from app import schema
from app.db import Database
from benchmarks.ais_recording import Wrapping, write_recording
from benchmarks.workbench import ROOT, show_load
from tests.postgres import PostgresCluster

THOUSANDS = 250
WRAPPINGS: tuple[Wrapping, ...] = ("tag block", "pghp", "suffix")
ROUNDS = 3
AIM_RATIO, AIM_TWO = 0.5, 1.6

PYAIS = """
import sys
from pyais import FileReaderStream
decoded = 0
for message in FileReaderStream(sys.argv[1]):
    message.decode()
    decoded += 1
"""
IMPORT = """
import json, sys
from pathlib import Path
from app.ais.service import import_ais_file
from app.db import Database
from app.storage import Storage
source = Path(sys.argv[1])
imported = import_ais_file(
    Database(sys.argv[2]), Storage(sys.argv[3]), source, site_id=None, file_name=source.name,
    max_bytes=1 << 33,
)
told = imported.file.accounting["messages"]
"""
TIMED = """
import json, time
from pathlib import Path
begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
{work}
print(json.dumps([
    time.perf_counter() - begun_s,
    time.process_time() - begun_cpu_s,
    int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) / 1024,
]))
"""


class Bench:
    """A folder with recordings, and fresh databases for each import."""

    def __init__(self, folder: Path, cluster: PostgresCluster) -> None:
        self._folder, self._cluster = folder, cluster
        self._made = 0

    def recording(self, thousands: int, wrapping: Wrapping = "tag block", seed: int = 0) -> Path:
        """Return a recording of so many thousand messages."""
        path = self._folder / f"{wrapping.replace(' ', '_')}_{thousands}_{seed}.nmea"
        if not path.exists():
            write_recording(path, thousands * 1_000, wrapping, seed)
        return path

    def fresh(self, kind: str) -> list[str]:
        """Return the addresses of an empty database and of a file store."""
        self._made += 1
        name = f"bench{self._made}"
        is_sqlite = kind == "SQLite"
        url = f"sqlite:///{self._folder}/{name}.db" if is_sqlite else self._cluster.create(name)
        database = Database(url)
        schema.upgrade(database)
        database.dispose()
        return [url, str(self._folder / f"{name}_files")]


def started(work: str, arguments: Sequence[str]) -> subprocess.Popen[str]:
    """Start a process that does a work and tells its seconds, CPU seconds and MiB."""
    command = [sys.executable, "-c", TIMED.format(work=work), *arguments]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)


def ended(process: subprocess.Popen[str]) -> tuple[float, float, float]:
    """Return what a process told."""
    told, _ = process.communicate()
    assert process.returncode == 0
    wall_s, cpu_s, mib = json.loads(told)
    return wall_s, cpu_s, mib


def beside_pyais(bench: Bench, thousands: int) -> None:
    """Print the import's speed on both databases in share of pyais's."""
    for wrapping in WRAPPINGS:
        path = str(bench.recording(thousands, wrapping))
        taken: dict[str, list[tuple[float, float, float]]] = {}
        for _ in range(ROUNDS):
            taken.setdefault("pyais", []).append(ended(started(PYAIS, [path])))
            for kind in ("SQLite", "Postgres"):
                process = started(IMPORT, [path, *bench.fresh(kind)])
                taken.setdefault(kind, []).append(ended(process))
        wall_s = {of: statistics.median(one[0] for one in each) for of, each in taken.items()}
        cpu_s = {of: statistics.median(one[1] for one in each) for of, each in taken.items()}
        for of in taken:
            line = f"{wrapping:<10} {of:<9}{thousands / wall_s[of]:7.1f} thousand a second"
            line += f", {1e3 * cpu_s[of] / thousands:5.1f} us CPU a message"
            if of != "pyais":
                ratio = wall_s["pyais"] / wall_s[of]
                met = "met" if ratio >= AIM_RATIO else "MISSED"
                line += f"; {ratio:.2f} of pyais (CPU {cpu_s['pyais'] / cpu_s[of]:.2f}): {met}"
            print(line)


def memory(bench: Bench, thousands: int) -> None:
    """Print the memory of imports of growing size."""
    for some in (thousands // 10, thousands, 2 * thousands):
        path = str(bench.recording(some))
        *_, mib = ended(started(IMPORT, [path, *bench.fresh("SQLite")]))
        print(f"memory of an import of {some:>5} thousand messages: {mib:.0f} MiB")


def two_processes(bench: Bench, thousands: int) -> None:
    """Print how much faster two processes import two files than one does."""
    files = [str(bench.recording(thousands // 2, seed=seed)) for seed in (1, 2)]
    for kind in ("SQLite", "Postgres"):
        gains = []
        for _ in range(ROUNDS):
            database = bench.fresh(kind)
            begun = time.perf_counter()
            for file in files:
                ended(started(IMPORT, [file, *database]))
            one_s = time.perf_counter() - begun
            database = bench.fresh(kind)
            begun = time.perf_counter()
            for process in [started(IMPORT, [file, *database]) for file in files]:
                ended(process)
            gains.append(one_s / (time.perf_counter() - begun))
        gain = statistics.median(gains)
        met = "met" if gain >= AIM_TWO else "MISSED"
        print(f"{kind}: two processes {gain:.2f} times one (aim {AIM_TWO}): {met}")


def main() -> None:
    """Run all of it."""
    thousands = int(sys.argv[1]) if len(sys.argv) > 1 else THOUSANDS
    with tempfile.TemporaryDirectory() as folder, PostgresCluster() as cluster:
        bench = Bench(Path(folder), cluster)
        beside_pyais(bench, thousands)
        memory(bench, thousands)
        two_processes(bench, thousands)
    show_load()


if __name__ == "__main__":
    main()
