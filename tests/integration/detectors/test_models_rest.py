"""Models come in over REST: looked at before they are stored, tried by a worker, never trusted."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from sqlalchemy import func, select
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.config import Settings
from app.db import Database
from app.detectors.families import FAMILIES
from app.main import create_app
from app.tables.detection import DetectionSet, Model, ModelStatus
from app.tables.identity import Role, User
from tests.factories.detectors import crashing, make_model, with_external_data
from tests.factories.onnx_models import yolox_like
from tests.factories.random_networks import Network, Output, build
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser
from tests.worker_process import WorkerProcess, wait_until
from worker.inference.families import FAMILIES as RUNNABLE_FAMILIES

Clients = Callable[..., TestClient]


def send(client: TestClient, data: bytes, name: str = "nano", **form: object) -> Any:
    """Upload a model; returns the response."""
    return client.post(
        "/api/v1/models", files={"file": ("model.onnx", data)}, data={"name": name, **form}
    )


def tried(client: TestClient, location: str) -> dict[str, Any]:
    """Wait until a worker has tried a model, and return it."""
    wait_until(
        lambda: client.get(location).json()["status"] != "probing",
        within_s=300,  # five runtimes are started one after the other
        what="the probe",
    )
    body: dict[str, Any] = client.get(location).json()
    return body


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)  # workers take their time
@pytest.mark.slow
def test_models_are_tried_by_the_worker(
    client: TestClient, worker: WorkerProcess, shared_dir: Path
) -> None:
    """Real weights get ready; what does not fit or crashes the runtime is refused; all live on."""
    weights = (shared_dir / "models/yolox_nano.onnx").read_bytes()
    detr = [Output("logits", (1, 100, 92)), Output("pred_boxes", (1, 100, 4))]
    uploads = {
        "real": weights,
        "crashing": crashing(),
        "one channel": yolox_like(input_shape=(1, 1, 64, 64)),
        "other output": yolox_like(output_shape=(1, 100, 85)),
        "unnamed": build(Network(detr)),
    }
    locations = {}
    for name, data in uploads.items():
        family = {} if name == "unnamed" else {"family": "yolox"}
        answer = send(client, data, name, **family)
        assert answer.status_code == 202
        assert answer.json()["status"] == "probing"
        locations[name] = answer.headers["location"]

    real = tried(client, locations["real"])
    assert (real["status"], real["reason"]) == ("ready", None)
    assert (real["signature"]["width_px"], real["signature"]["class_count"]) == (416, 80)
    crashed = tried(client, locations["crashing"])
    assert crashed["status"] == "refused"
    assert "the runtime crashed while it loaded the model (SIGFPE)" in crashed["reason"]
    narrow = tried(client, locations["one channel"])
    assert narrow["status"] == "refused"
    assert "[1, 1, 64, 64]: expected is one float32 input [1, 3, height" in narrow["reason"]
    other = tried(client, locations["other output"])
    assert other["status"] == "refused"
    assert "expected is one float32 output [1, 84, 5 + classes]" in other["reason"]
    unnamed = tried(client, locations["unnamed"])
    assert (unnamed["status"], unnamed["family"]) == ("ready", "detr")
    assert send(client, uploads["unnamed"], "unnamed").status_code == 200
    assert worker.code is None
    ready = client.get("/api/v1/models", params={"status": "ready"}).json()["items"]
    assert [model["name"] for model in ready] == ["real", "unnamed"]


@pytest.mark.parametrize(
    ("data", "status"),
    [
        (b"\x80\x04\x95\x1b\x00\x00\x00\x00\x00\x00\x00", 415),
        (b"PK\x03\x04" + bytes(100), 415),
        (b"<!doctype html><p>log in first", 415),
        (b"", 415),
        (bytes(100), 415),
        (with_external_data("../../etc/passwd"), 422),
        (with_external_data("weights.bin"), 422),
        (with_external_data("/dev/zero"), 422),
    ],
    ids=["pickle", "zip", "html", "empty", "zeros", "dots", "sibling", "device"],
)
def test_what_is_no_safe_model_is_refused_at_once(
    client: TestClient, database: Database, settings: Settings, data: bytes, status: int
) -> None:
    """Other content is 415, tensors in other files 422; no row, no file, no job."""
    answer = send(client, data)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    if status == 422:
        assert answer.json()["errors"][0]["field"] == "file"
        assert "external data" in answer.json()["detail"]
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(Model)) == 0
    assert not Path(settings.storage_url).exists()


def test_too_large_a_model(settings: Settings, make_user: MakeUser, client_of: Clients) -> None:
    """Beyond the limit the answer is 413."""
    small = create_app(settings.model_copy(update={"max_model_bytes": 10_000}))
    with TestClient(small, headers=client_of(make_user()).headers) as client:
        assert send(client, yolox_like()).status_code == 413


def test_the_same_model_again(app: FastAPI, client: TestClient) -> None:
    """Sent 25 times at once it is one model: one 202, else 200."""
    data = yolox_like()

    def upload(_: int) -> tuple[int, int]:
        answer = send(TestClient(app, headers=client.headers), data)
        return answer.status_code, answer.json()["id"]

    with ThreadPoolExecutor(25) as pool:
        answers = list(pool.map(upload, range(25)))
    assert sorted(status for status, _ in answers) == [200] * 24 + [202]
    assert len({identifier for _, identifier in answers}) == 1
    assert len(client.get("/api/v1/models").json()["items"]) == 1


def test_names_and_contents_stand_for_each_other(client: TestClient) -> None:
    """A taken name, a file under a second name, a strange family or name: each is refused."""
    assert send(client, yolox_like()).status_code == 202
    taken = send(client, yolox_like(class_names=["ship"]))
    assert (taken.status_code, "name 'nano' already" in taken.json()["detail"]) == (409, True)
    twice = send(client, yolox_like(), "other")
    assert (twice.status_code, "model 'nano'" in twice.json()["detail"]) == (409, True)
    for form, field in (({"family": "resnet"}, "family"), ({"name": " "}, "name")):
        answer = send(client, yolox_like(class_names=["a"]), **form)
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == field


def test_removing_a_model(client: TestClient, database: Database) -> None:
    """An unused model goes, and what it found waits with it; an unknown one is 404."""
    with database.writing() as session:
        model = make_model(session)
        session.add(
            DetectionSet(image_sha256="0" * 64, model_sha256=model.sha256, settings_sha256="1" * 64)
        )
    assert client.delete(f"/api/v1/models/{model.id}").status_code == 204
    assert client.get(f"/api/v1/models/{model.id}").status_code == 404
    assert client.delete(f"/api/v1/models/{model.id}").status_code == 404
    with database.reading() as session:
        assert session.scalar(select(func.count()).select_from(DetectionSet)) == 1


def test_who_may_add_models(
    make_user: MakeUser, client_of: Clients, database: Database, admin: User
) -> None:
    """A model runs for all sites: one site's operator may read models, not add or remove them."""
    with database.writing() as session:
        site = make_site(session)
        model = make_model(session)
    operator = client_of(make_user(Role.OPERATOR, site.id))
    assert operator.get(f"/api/v1/models/{model.id}").status_code == 200
    assert send(operator, yolox_like()).status_code == 403
    assert operator.delete(f"/api/v1/models/{model.id}").status_code == 403
    assert send(client_of(admin, Scope.READ), yolox_like()).status_code == 403


def test_the_web_knows_the_worker_s_families() -> None:
    """The families that an upload may name are those that a worker can open."""
    assert set(FAMILIES) == set(RUNNABLE_FAMILIES)


def test_pages_of_models(
    browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """The list, the form's errors and a refused model's reason are shown to people."""
    browser = browser_of(admin)
    assert "No models yet" in browser.get("/models").text
    pickle = {"file": ("x.pt", b"\x80\x04\x95abc")}
    refused = browser.post("/models", files=pickle, data={"name": "x"})
    assert refused.status_code == 415
    assert "a Python pickle" in refused.text
    with database.writing() as session:
        model = make_model(session, status=ModelStatus.REFUSED)
        model.reason = "it has <two> inputs"
    shown = browser.get(f"/models/{model.id}").text
    assert "Refused: it has &lt;two&gt; inputs" in shown
    added = browser.post("/models", files={"file": ("m", yolox_like())}, data={"name": "mine"})
    assert added.status_code == 303
    assert "A worker is about to try this model" in browser.get(added.headers["location"]).text
    assert browser.post(f"{added.headers['location']}/delete").headers["location"] == "/deletions"
