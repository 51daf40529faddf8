"""How long storing a review takes while a run is writing, beside the same without a run (SQLite).

A real web process and a real worker on real photographs; one keep-alive connection posts verdicts.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx2

from app import schema
from app.auth.access import Scope
from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.runs import service
from app.storage import Storage
from app.tables.identity import Role
from tests.factories import identity
from tests.factories.norderelbe import Published, make_norderelbe

ROOT = Path(__file__).resolve().parents[1]
IMAGES = 150
AIM_P95_MS = 20.0


def main() -> None:
    """Run the benchmark and print both distributions."""
    shared = ROOT.parent / "shared"
    if not shared.is_dir():
        print("needs ../shared: real photographs and weights")
        return
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"QUAYMARK_DATA_DIR": folder, "QUAYMARK_PORT": "8765"}
        settings = Settings(data_dir=Path(folder), port=8765)
        database = Database(settings.database_url)
        schema.upgrade(database)
        viewport_id, detector = make_norderelbe(
            database, Storage(settings.storage_url), Published.read(shared), IMAGES
        )
        with database.writing() as session:
            person = identity.make_user(session, Role.ADMIN, None)
            token = identity.make_token(session, person, tuple(Scope))
        commands = (
            [str(Path(sys.executable).with_name("quaymark")), "serve"],
            [sys.executable, "-m", "worker"],
        )
        processes = [
            subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.DEVNULL)
            for command in commands
        ]
        try:
            _measure(settings, database, viewport_id, detector, token)
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                process.wait()


def _measure(
    settings: Settings, database: Database, viewport_id: int, detector: str, token: str
) -> None:
    jobs = JobClient(settings.database_url)
    headers = {"Authorization": f"Bearer {token}"}
    with httpx2.Client(base_url=f"http://127.0.0.1:{settings.port}", headers=headers) as client:
        first = _start(database, jobs, viewport_id, detector, 0.25)
        while _run(client, first)["status"] not in {"succeeded", "failed"}:
            time.sleep(0.2)
        poses = client.get("/api/v1/poses", params={"run_id": first, "limit": 1000}).json()
        ids = [pose["id"] for pose in poses["items"]]
        quiet = [_grade(client, pose_id) for pose_id in ids]
        second = _start(database, jobs, viewport_id, detector, 0.26)
        while not _run(client, second)["images_done"]:
            time.sleep(0.05)
        busy: list[float] = []
        while _run(client, second)["status"] == "running":
            busy += [_grade(client, pose_id) for pose_id in ids[:20]]
    _print("without a run", quiet)
    _print("while a run is writing", busy)
    print(f"ratio of medians {statistics.median(busy) / statistics.median(quiet):.2f}")
    verdict = "met" if _p95(busy) < AIM_P95_MS else "MISSED"
    print(f"aim: p95 under {AIM_P95_MS:.0f} ms while a run is writing: {verdict}")


def _start(
    database: Database, jobs: JobClient, viewport_id: int, detector: str, score: float
) -> int:
    with database.writing() as session:
        return service.start_run(
            session,
            jobs,
            viewport_id=viewport_id,
            detector=detector,
            preset="paper",
            parameters={"score_threshold": score},
        ).id


def _run(client: httpx2.Client, run_id: int) -> dict[str, object]:
    for _ in range(300):
        try:
            body: dict[str, object] = client.get(f"/api/v1/runs/{run_id}").json()
        except httpx2.ConnectError:
            time.sleep(0.1)
        else:
            return body
    raise TimeoutError("the web process did not come up")


def _grade(client: httpx2.Client, pose_id: int) -> float:
    begun = time.perf_counter()
    answer = client.post(f"/api/v1/poses/{pose_id}/reviews", json={"grade": "good"})
    taken_ms = (time.perf_counter() - begun) * 1000
    assert answer.status_code == 201, answer.text
    return taken_ms


def _p95(values: list[float]) -> float:
    return sorted(values)[int(len(values) * 0.95)]


def _print(label: str, values: list[float]) -> None:
    median = statistics.median(values)
    print(f"{label}: n {len(values)}, median {median:.1f} ms, p95 {_p95(values):.1f} ms")


if __name__ == "__main__":
    main()
