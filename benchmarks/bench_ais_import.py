"""Distinct AIS messages from a file to committed rows, beside pyais on the same file.

pyais is measured twice: as it reads and assembles sentences (`FileReaderStream` and no more), and
as it also decodes them. The import does all of that, checks every sentence, dates it, drops
repeats, keeps the accounting and stores the rows. Each runs as a process of its own, in turns, so
that a busy machine slows all; the ratios of medians count, of the clock's time and of CPU time
(which on Postgres is the client's alone). Memory is the largest that a process ever took, at
growing sizes. Two processes gain by what is not exclusive: the share of its CPU time for which an
import keeps others from writing is printed beside. By default a quarter of a million messages, to
be done in minutes; give the number of thousands for more: `bench_ais_import.py 1000`.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from app import schema
from app.db import Database
from benchmarks.ais_recording import Wrapping, write_recording
from benchmarks.workbench import ROOT, show_load
from tests.postgres import PostgresCluster

THOUSANDS = 250
WRAPPINGS: tuple[Wrapping, ...] = ("tag block", "pghp", "suffix")
ROUNDS = 3
KINDS = ("SQLite", "Postgres")
AIM_RATIO, AIM_TWO = 0.5, 1.6

READING = "import sys\nfrom pyais import FileReaderStream"
READ = """
for message in FileReaderStream(sys.argv[1]):
    pass
"""
DECODE = READ.replace("pass", "message.decode()")
IMPORTING = """
import sys, time
from contextlib import contextmanager
from pathlib import Path
from app.ais import importing
from app.ais.service import import_ais_file
from app.db import Database
from app.storage import Storage
turn_to_write = importing.turn_to_write
@contextmanager
def timed_turn(database):
    global exclusive_s
    with turn_to_write(database):
        begun_cpu_s = time.process_time()
        yield
        exclusive_s += time.process_time() - begun_cpu_s
importing.turn_to_write = timed_turn
"""
IMPORT = """
database, storage = Database(sys.argv[1]), Storage(sys.argv[2])
for source in map(Path, sys.argv[3:]):
    import_ais_file(
        database, storage, source, site_id=None, file_name=source.name, max_bytes=1 << 33
    )
"""
TIMED = """
{loading}
import json, time
from pathlib import Path
exclusive_s = 0.0
begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
{work}
print(json.dumps([
    time.perf_counter() - begun_s,
    time.process_time() - begun_cpu_s,
    int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) / 1024,
    exclusive_s,
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
    """Start a process that does a work and tells what it took, without loading the modules."""
    loading = IMPORTING if work == IMPORT else READING
    command = [sys.executable, "-c", TIMED.format(loading=loading, work=work), *arguments]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)


class Taken(NamedTuple):
    """What a work took: seconds, CPU seconds, MiB, and the CPU seconds of its turns to write."""

    wall_s: float
    cpu_s: float
    mib: float
    exclusive_s: float


def ended(process: subprocess.Popen[str]) -> Taken:
    """Return what a process told."""
    told, _ = process.communicate()
    assert process.returncode == 0
    return Taken(*json.loads(told))


def beside_pyais(bench: Bench, thousands: int) -> None:
    """Print the import's speed on both databases in share of pyais's."""
    for wrapping in WRAPPINGS:
        path = str(bench.recording(thousands, wrapping))
        taken: dict[str, list[Taken]] = {}
        for _ in range(ROUNDS):
            taken.setdefault("pyais reads", []).append(ended(started(READ, [path])))
            taken.setdefault("pyais decodes", []).append(ended(started(DECODE, [path])))
            for kind in KINDS:
                process = started(IMPORT, [*bench.fresh(kind), path])
                taken.setdefault(kind, []).append(ended(process))
        wall_s = {of: statistics.median(one.wall_s for one in each) for of, each in taken.items()}
        cpu_s = {of: statistics.median(one.cpu_s for one in each) for of, each in taken.items()}
        for of in taken:
            line = f"{wrapping:<10} {of:<14}{thousands / wall_s[of]:7.1f} thousand a second"
            line += f", {1e3 * cpu_s[of] / thousands:5.1f} us CPU a message"
            if of in KINDS:
                for peer in ("pyais decodes", "pyais reads"):
                    ratio = wall_s[peer] / wall_s[of]
                    met = "met" if ratio >= AIM_RATIO else "MISSED"
                    line += f"; {ratio:.2f} of what {peer} (CPU {cpu_s[peer] / cpu_s[of]:.2f}): "
                    line += met
            print(line)


def memory(bench: Bench, thousands: int) -> None:
    """Print the memory of imports of growing size."""
    for some in (thousands // 10, thousands, 2 * thousands):
        path = str(bench.recording(some))
        taken = ended(started(IMPORT, [*bench.fresh("SQLite"), path]))
        print(f"memory of an import of {some:>5} thousand messages: {taken.mib:.0f} MiB")


def two_processes(bench: Bench, thousands: int) -> None:
    """Print how much faster two processes import two files than one does."""
    files = [str(bench.recording(thousands // 2, seed=seed)) for seed in (1, 2)]
    for kind in KINDS:
        gains, shares = [], []
        for _ in range(ROUNDS):
            database = bench.fresh(kind)
            alone = ended(started(IMPORT, [*database, *files]))
            shares.append(alone.exclusive_s / alone.cpu_s)
            database = bench.fresh(kind)
            both = [started(IMPORT, [*database, file]) for file in files]
            gains.append(alone.wall_s / max(ended(process).wall_s for process in both))
        gain = statistics.median(gains)
        met = "met" if gain >= AIM_TWO else "MISSED"
        share = f"{statistics.median(shares):.0%} of its CPU time exclusive"
        if kind == "Postgres":
            share = "nothing exclusive"
        print(f"{kind}: two processes {gain:.2f} times one (aim {AIM_TWO}): {met}; {share}")


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
