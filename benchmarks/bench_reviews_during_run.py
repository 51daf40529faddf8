"""How long storing a review takes while a run is writing, beside the same without a run (SQLite).

A real web process and a real worker on real photographs; one keep-alive connection posts verdicts.
Each verdict has a bare durable commit of one row beside it, on the same file in the same moment:
the ratio of the two tells what is ours, and what is the disk's and the busy machine's.
"""

import itertools
import statistics

import httpx

from app.tables.runs import RunStatus
from benchmarks.workbench import (
    SHARED,
    BareCommits,
    Workbench,
    p95,
    show,
    show_load,
    taken_ms,
    workbench,
)
from tests.factories.norderelbe import Published, make_norderelbe

IMAGES = 150
AIM_P95_MS = 20.0


def main() -> None:
    """Run the benchmark and print both distributions."""
    if not SHARED.is_dir():
        print("needs ../shared: real photographs and weights")
        return
    with workbench(worker=True) as bench:
        viewport_id, _ = make_norderelbe(
            bench.database, bench.storage, Published.read(SHARED), IMAGES
        )
        _measure(bench, viewport_id)
    show_load()


def _measure(bench: Workbench, viewport_id: int) -> None:
    bare = BareCommits(bench.settings)
    with bench.client() as client:
        first = bench.finish(bench.start_run(viewport_id, score_threshold=0.25)).id
        poses = client.get("/api/v1/poses", params={"run_id": first, "limit": 1000}).json()
        ids = [pose["id"] for pose in poses["items"]]
        quiet = [_pair(client, bare, pose_id) for pose_id in ids]
        second = bench.start_run(viewport_id, score_threshold=0.26)
        while bench.run(second).status is RunStatus.QUEUED:
            pass
        busy = []
        for pose_id in itertools.cycle(ids):
            busy.append(_pair(client, bare, pose_id))
            if len(busy) % 20 == 0 and bench.run(second).status is not RunStatus.RUNNING:
                break
    bare.close()
    for label, pairs in (("without a run", quiet), ("while a run is writing", busy)):
        reviews, commits = zip(*pairs, strict=True)
        show(f"review {label}", reviews)
        show(f"bare commit {label}", commits)
        median = statistics.median(reviews) / statistics.median(commits)
        print(f"  ratio of medians {median:.2f}, of p95 {p95(reviews) / p95(commits):.2f}")
    slower = statistics.median(r for r, _ in busy) / statistics.median(r for r, _ in quiet)
    print(f"a run makes reviews {slower:.2f} times slower")
    found = p95([review for review, _ in busy])
    verdict = "met" if found < AIM_P95_MS else "MISSED"
    print(f"aim: p95 under {AIM_P95_MS:.0f} ms while a run is writing: {verdict}")


def _pair(client: httpx.Client, bare: BareCommits, pose_id: int) -> tuple[float, float]:
    def grade() -> None:
        answer = client.post(f"/api/v1/poses/{pose_id}/reviews", json={"grade": "good"})
        assert answer.status_code == 201, answer.text

    return taken_ms(grade), taken_ms(bare.commit_one)


if __name__ == "__main__":
    main()
