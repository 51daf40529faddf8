"""How fast people can review: the next pose, the submitted verdict, one client and four.

3,753 poses on SQLite, a real web process, keep-alive connections, verdicts durable before they are
answered. The same number of tasks was given to Label Studio 1.23 on such a machine: next 31 ms,
submit 50 ms, 20 a second alone and 19 with four clients, list of 100 314 ms, export 5.3 s. A bare
durable commit beside each submit tells how busy disk and machine are now.
"""

import statistics
import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import sqlalchemy as sa

from app.exports import service as exports
from app.garbage import set_startup_aside
from app.tables.exports import Export
from app.tables.runs import Pose
from benchmarks.workbench import BareCommits, Workbench, show, show_load, taken_ms, workbench
from tests.factories.runs import make_harbour, make_run

POSES = 3753
ALONE = 300
CLIENTS = 4
EACH_S = 8.0
PEER = {"next": 31.0, "lease": 31.0, "submit": 50.0, "list": 314.0, "export": 5300.0}
PEER_RATE_OF_FOUR = 19.0


def main() -> None:
    """Run the benchmark and print medians, rates and how they stand to the peer's."""
    with workbench(worker=False) as bench:
        with bench.database.writing() as session:
            harbour = make_harbour(session, images=POSES)
            run_id = make_run(session, harbour, [1] * POSES).id
            ids = list(session.scalars(sa.select(Pose.id).order_by(Pose.id)))
        medians = _alone(bench, run_id, ids)
        rate, errors = _together(bench, ids)
        medians["export"] = taken_ms(lambda: _export(bench, run_id))
    print(f"{'export of all (COCO)':<44} {medians['export']:.0f} ms")
    for name, peer in PEER.items():
        print(f"{name}: {peer / medians[name]:.1f} times as fast as the peer's {peer:.0f} ms")
    print(f"{CLIENTS} clients: {rate:.0f} verdicts a second, {errors} errors", end="; ")
    print(f"{rate / PEER_RATE_OF_FOUR:.1f} times the peer's {PEER_RATE_OF_FOUR:.0f}")
    show_load()


def _alone(bench: Workbench, run_id: int, ids: list[int]) -> dict[str, float]:
    ungraded = {"run_id": run_id, "grade": "ungraded", "limit": 1}
    bare = BareCommits(bench.settings)
    nexts, leases, submits, commits = [], [], [], []
    with bench.client() as client:
        queue = client.post("/api/v1/review-queues", json={"run_id": run_id}).json()
        lease = f"/api/v1/review-queues/{queue['id']}/next"
        for pose_id in ids[:ALONE]:
            leases.append(taken_ms(lambda: client.post(lease)))
            nexts.append(taken_ms(lambda: client.get("/api/v1/poses", params=ungraded)))
            submits.append(taken_ms(lambda pose_id=pose_id: _submit(client, pose_id)))
            commits.append(taken_ms(bare.commit_one))
        listed = [
            taken_ms(lambda: client.get("/api/v1/poses", params={"run_id": run_id, "limit": 100}))
            for _ in range(20)
        ]
    bare.close()
    show("next (listed)", nexts)
    show("next (leased from a queue, durable)", leases)
    show("submit (durable)", submits)
    show("bare commit of one row", commits)
    show("list of 100", listed)
    return {
        "next": statistics.median(nexts),
        "lease": statistics.median(leases),
        "submit": statistics.median(submits),
        "list": statistics.median(listed),
    }


def _submit(client: httpx.Client, pose_id: int) -> int:
    body = {"grade": "ok", "reasons": ["heading"], "seconds": 1.5}
    status = client.post(f"/api/v1/poses/{pose_id}/reviews", json=body).status_code
    return int(status)


def _together(bench: Workbench, ids: list[int]) -> tuple[float, int]:
    """Return verdicts a second of all clients together, and how many went wrong."""
    until = time.perf_counter() + EACH_S

    def work(number: int) -> tuple[int, int]:
        done = errors = 0
        with bench.client() as client:
            for pose_id in ids[ALONE + number :: CLIENTS]:
                if time.perf_counter() > until:
                    break
                errors += _submit(client, pose_id) != 201
                done += 1
        return done, errors

    begun = time.perf_counter()
    with ThreadPoolExecutor(CLIENTS) as pool:
        results = list(pool.map(work, range(CLIENTS)))
    taken_s = time.perf_counter() - begun
    return sum(done for done, _ in results) / taken_s, sum(errors for _, errors in results)


def _export(bench: Workbench, run_id: int) -> None:
    asked = Export(format="coco", filters={"run_id": run_id}, site_ids=None, anonymise=True)
    with bench.database.writing() as session:
        asked.workflow_id = "bench"
        session.add(asked)
        session.flush()
        export_id = asked.id
    set_startup_aside()  # as in a worker
    exports.make_file(bench.database, bench.storage, export_id)


if __name__ == "__main__":
    main()
