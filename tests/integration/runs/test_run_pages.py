"""The pages of runs: the form, the list, one run."""

from collections.abc import Callable

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.tables.detection import Detection, DetectionSet
from app.tables.identity import User
from app.tables.runs import Run, RunImage, RunStatus
from tests.factories.ais import make_position
from tests.factories.imagery import NOON
from tests.factories.runs import Harbour, make_harbour, make_run


@pytest.fixture
def harbour(database: Database) -> Harbour:
    """Give a viewport with three images, ready to be run."""
    with database.writing() as session:
        return make_harbour(session, images=3)


@pytest.fixture
def operator(
    browser_of: Callable[[User], TestClient], make_user: Callable[..., User]
) -> TestClient:
    """Give an operator's browser."""
    return browser_of(make_user("operator"))


def form_of(harbour: Harbour, **changes: str) -> dict[str, str]:
    """Return the form as a browser sends it."""
    return {
        "viewport_id": str(harbour.viewport.id),
        "detector": harbour.model.name,
        "preset": "paper",
        "name": "",
        "score_threshold": "",
        "maximum_cost": "",
    } | changes


def test_the_form_starts_a_run_and_shows_it(
    database: Database, harbour: Harbour, operator: TestClient
) -> None:
    """Empty numbers are defaults; the run's own page follows."""
    assert harbour.model.name in operator.get("/runs/new").text
    sent = operator.post(
        "/runs", data=form_of(harbour, name=" calm sea ", maximum_cost="0.4", track_method="cog_dr")
    )
    with database.reading() as session:
        run = session.scalars(sa.select(Run)).one()
    assert (sent.status_code, sent.headers["location"]) == (303, f"/runs/{run.id}")
    assert (run.name, run.parameters["maximum_cost"]) == ("calm sea", 0.4)
    assert run.parameters["score_threshold"] == 0.25
    assert run.parameters["track_method"] == "cog_dr"
    assert "calm sea" in operator.get(f"/runs/{run.id}").text


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"score_threshold": "2"}, "must lie between 0 and 1"),
        ({"maximum_cost": "cheap"}, "valid number"),
        ({"maximum_cost": "Infinity"}, "at most"),
        ({"preset": "waterline", "maximum_cost": "0.3"}, "no effect with matching likelihood"),
        ({"detector": "nobody"}, "is not ready"),
        ({"preset": "magic"}, "must be one of"),
    ],
)
def test_a_wrong_form_comes_back_as_it_was_entered(
    database: Database,
    harbour: Harbour,
    operator: TestClient,
    changes: dict[str, str],
    told: str,
) -> None:
    """The mistake is told on the form, what was entered stands, and nothing is started."""
    answer = operator.post("/runs", data=form_of(harbour, name="calm sea", **changes))
    assert answer.status_code == 422
    assert told in answer.text
    assert 'value="calm sea"' in answer.text
    with database.reading() as session:
        assert session.scalars(sa.select(Run)).all() == []


def test_one_run_shows_what_became_of_it(
    database: Database, harbour: Harbour, operator: TestClient
) -> None:
    """Failed images stand by name with their reason, hostile names as text."""
    with database.writing() as session:
        session.merge(harbour.images[1]).file_name = "<img src=x onerror=alert(1)>.jpg"
        run = make_run(session, harbour, [2, 0, 1])
        row = session.scalars(
            sa.select(RunImage).where(RunImage.run_id == run.id, RunImage.position == 1)
        ).one()
        row.error = "the image cannot be decoded"
    shown = operator.get(f"/runs/{run.id}").text
    assert "the image cannot be decoded" in shown
    assert "<img src=x" not in shown
    assert operator.get(f"/runs/{2**40}").status_code == 404


def test_a_run_without_poses_says_why(
    database: Database, harbour: Harbour, operator: TestClient
) -> None:
    """Nothing detected, nothing heard at that time, nothing heard near: each leads to its mend."""
    with database.writing() as session:
        run = make_run(session, harbour, [0, 0, 0])
        session.execute(sa.update(RunImage).values(captured_at=NOON))
    assert "No vessel was detected" in operator.get(f"/runs/{run.id}").text
    with database.writing() as session:
        found = DetectionSet(
            image_sha256=harbour.images[0].sha256,
            model_sha256=harbour.model.sha256,
            settings_sha256="0" * 64,
        )
        session.add(found)
        session.flush()
        box = {"x1_px": 10.0, "y1_px": 12.0, "x2_px": 40.5, "y2_px": 30.0}
        session.add(Detection(detection_set_id=found.id, score=0.5, class_id=8, **box))
        of_run = RunImage.run_id == run.id
        session.execute(sa.update(RunImage).where(of_run).values(detection_set_id=found.id))
    shown = operator.get(f"/runs/{run.id}").text
    assert "AIS has nothing of the time" in shown
    assert f"/cameras/{harbour.camera.id}/clock" in shown
    assert "its page says why" in operator.get("/").text
    with database.writing() as session:
        make_position(session, harbour.site, NOON)
    assert "No detection was matched" in operator.get(f"/runs/{run.id}").text


def test_the_list_is_of_ones_own_sites(
    database: Database,
    harbour: Harbour,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
) -> None:
    """A viewer of one site sees its runs, and no way to start one."""
    with database.writing() as session:
        make_run(session, harbour, [1], name="ours")
        make_run(session, make_harbour(session), [1], name="theirs", status=RunStatus.FAILED)
    viewer = browser_of(make_user("viewer", harbour.site.id))
    shown = viewer.get("/runs").text
    assert "ours" in shown
    assert "theirs" not in shown
    assert "/runs/new" not in shown
    assert viewer.post("/runs", data=form_of(harbour)).status_code == 403
