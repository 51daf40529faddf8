"""How fast and in how much memory poses are exported, beside orjson writing the same from memory.

A million poses (`POSES` in the environment for fewer), on SQLite and, where
`QUAYMARK_BENCH_POSTGRES` names a database that may be filled, on Postgres. Each export runs in a
process of its own, whose peak of memory the system tells; the CPU time is that of both processes
where a second one writes. orjson gets the same lines as
dictionaries in the same process: its rate is what no export can beat.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import orjson

from app import schema
from app.db import Database
from app.exports.making import write_export
from app.garbage import set_startup_aside
from app.tables.exports import Export
from benchmarks.poses_in_bulk import fill
from benchmarks.workbench import show_load

POSES = int(os.environ.get("POSES", "1000000"))
FEW = 10_000
FORMATS = ("ndjson", "coco", "csv", "parquet")
ROUNDS = 3
IN_MEMORY = 100_000


def main() -> None:
    """Fill databases with few and with many poses, export them, and print rates and memory."""
    urls = {}
    with tempfile.TemporaryDirectory() as folder:
        for count in (FEW, POSES):
            urls[f"SQLite, {count} poses"] = _filled(f"sqlite:///{folder}/{count}.db", count)
        postgres = os.environ.get("QUAYMARK_BENCH_POSTGRES")
        if postgres:
            urls[f"Postgres, {POSES} poses"] = _filled(postgres, POSES)
        memory: dict[str, list[float]] = {}
        for name, url in urls.items():
            for form in FORMATS:
                rates, peaks = zip(
                    *(_measured(url, form, folder) for _ in range(ROUNDS)), strict=True
                )
                wall, cpu, bare = (statistics.median(each) for each in zip(*rates, strict=True))
                peak = statistics.median(peaks)
                memory.setdefault(form, []).append(peak)
                print(
                    f"{name:<26} {form:<8} {wall:8.0f} poses a second, {cpu:8.0f} a CPU second; "
                    f"orjson {bare:8.0f} a CPU second; peak {peak:5.0f} MB"
                )
        for form, peaks_mb in memory.items():
            print(f"{form}: {peaks_mb[1] - peaks_mb[0]:+.0f} MB from {FEW} to {POSES} poses")
        _incremental(urls[f"SQLite, {POSES} poses"])
    show_load()


def _filled(url: str, poses: int) -> str:
    database = Database(url)
    schema.upgrade(database)
    begun = time.perf_counter()
    with database.writing() as session:
        fill(session, poses)
    with database.engine.connect() as connection:
        connection.exec_driver_sql("ANALYZE")
        connection.commit()
    database.dispose()
    print(f"{poses} poses made in {time.perf_counter() - begun:.0f} s")
    return url


def _measured(url: str, form: str, folder: str) -> tuple[tuple[float, float, float], float]:
    """Return (rate, rate by CPU time, orjson's rate by CPU time) and the peak of memory, MB."""
    command = [sys.executable, "-m", "benchmarks.bench_exports", url, form, f"{folder}/out"]
    told = orjson.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return (told["rate"], told["cpu_rate"], told["orjson_rate"]), told["peak_mb"]


def _export(url: str, form: str, out: Path) -> None:
    """Export in this process and print what it took as JSON."""
    database = Database(url)
    asked = Export(format=form, filters={}, site_ids=None, anonymise=True)
    set_startup_aside()  # as in a worker
    begun, cpu = time.perf_counter(), time.process_time()
    with out.open("wb") as target:
        count = write_export(database, asked, target).count
    taken_s, cpu_s = time.perf_counter() - begun, time.process_time() - cpu
    of_children = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s += of_children.ru_utime + of_children.ru_stime
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        orjson.dumps(
            {
                "rate": count / taken_s,
                "cpu_rate": count / cpu_s,
                "orjson_rate": _bare(database, form),
                "peak_mb": peak_mb,
            }
        ).decode()
    )


def _bare(database: Database, form: str) -> float:
    """Return how many of the same lines orjson writes in a CPU second from memory."""
    wanted = "coco" if form == "coco" else "ndjson"
    asked = Export(format=wanted, filters={}, site_ids=None, anonymise=True)
    with tempfile.TemporaryFile() as target:
        write_export(database, asked, target)
        target.seek(0)
        lines = (line.rstrip(b",\n") for line in target if b'"heading_source"' in line)
        rows = [orjson.loads(line) for line, _ in zip(lines, range(IN_MEMORY), strict=False)]
    begun = time.process_time()
    with tempfile.TemporaryFile() as target:
        for row in rows:
            target.write(orjson.dumps(row))
    return len(rows) / (time.process_time() - begun)


def _incremental(url: str) -> None:
    """Print what a nightly pull costs that finds nothing new."""
    database = Database(url)
    asked = Export(
        format="ndjson",
        filters={"updated_since": "2026-07-01T00:00:00Z"},
        site_ids=None,
        anonymise=True,
    )
    with tempfile.TemporaryFile() as target:
        write_export(database, asked, target)
        begun = time.process_time()
        write_export(database, asked, target)
    print(f"nothing changed since: {(time.process_time() - begun) * 1000:.1f} ms of CPU time")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _export(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
    else:
        main()
