"""The page of exports."""

from collections.abc import Callable

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.exports import repository, service
from app.tables.exports import Export
from app.tables.identity import User
from tests.factories.runs import Harbour, make_run
from tests.integration.exports.conftest import Make


@pytest.fixture
def run_id(database: Database, harbour: Harbour) -> int:
    """Give a run with three poses."""
    with database.writing() as session:
        return make_run(session, harbour, [2, 1]).id


def exports(database: Database) -> list[Export]:
    """Return all exports."""
    with database.reading() as session:
        return list(session.scalars(sa.select(Export).order_by(Export.id)))


def test_the_form_asks_and_the_list_offers_the_file(
    database: Database,
    run_id: int,
    make: Make,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
) -> None:
    """A form sent leads back to the list, which shows the wait and then the download."""
    browser = browser_of(make_user("reviewer"))
    form = {"format": "coco", "run_id": str(run_id), "grade": ["good", "ok"]}
    sent = browser.post("/exports", data=form)
    assert (sent.status_code, sent.headers["location"]) == (303, "/exports")
    (export,) = exports(database)
    assert export.filters == {"run_id": run_id, "grade": ["good", "ok"]}
    assert export.anonymise
    waiting = browser.get("/exports").text
    assert f"/api/v1/exports/{export.id}/download" not in waiting
    make(export.id)
    assert f"/api/v1/exports/{export.id}/download" in browser.get("/exports").text


@pytest.mark.parametrize(
    "form",
    [
        {"format": "xlsx"},
        {"format": "coco", "run_id": "all"},
        {"format": "coco", "grade": "superb"},
    ],
)
def test_a_wrong_form_comes_back_with_a_word(
    database: Database,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
    form: dict[str, str],
) -> None:
    """What no list offers is refused on the page itself, and nothing is asked for."""
    answer = browser_of(make_user("viewer")).post("/exports", data=form)
    assert answer.status_code == 422
    assert "from the list" in answer.text
    assert exports(database) == []


def test_a_viewer_gets_pseudonyms_whatever_the_form_says(
    database: Database,
    run_id: int,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
) -> None:
    """The box for identities is not offered to viewers, and does nothing when sent all the same."""
    form = {"format": "coco", "run_id": str(run_id), "with_identities": "true"}
    viewer, reviewer = (browser_of(make_user(role)) for role in ("viewer", "reviewer"))
    assert "with_identities" not in viewer.get("/exports").text
    assert "with_identities" in reviewer.get("/exports").text
    for browser in (viewer, reviewer):
        assert browser.post("/exports", data=form).status_code == 303
    assert [export.anonymise for export in exports(database)] == [True, False]


def test_a_selection_in_the_url_fills_the_form_in(
    run_id: int, browser_of: Callable[[User], TestClient], make_user: Callable[..., User]
) -> None:
    """Filters have the names they have elsewhere; one that is none is refused."""
    browser = browser_of(make_user("reviewer"))
    opened = browser.get(f"/exports?run_id={run_id}&grade=good&grade=ok&range_max_m=500&split=day")
    assert opened.status_code == 200
    assert 'value="500"' in opened.text
    assert opened.text.count("checked") == 2
    assert browser.get("/exports?run.site.name=1").status_code == 422


def test_an_export_under_way_shows_its_pace_and_can_be_cancelled(
    database: Database,
    run_id: int,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
) -> None:
    """Poses of how many, a second, what remains; a press of the button ends it."""
    browser = browser_of(make_user("reviewer"))
    form = {"format": "kitti", "run_id": str(run_id), "split": "day", "grade": ["good", "ungraded"]}
    browser.post("/exports", data=form)
    (export,) = exports(database)
    with database.writing() as session:
        service.begin(session, export.id)
        repository.advance(session, export.id, 3, 6)
    listed = browser.get("/exports")
    assert listed.status_code == 200, listed.text
    assert "a second" in listed.text
    assert browser.post(f"/exports/{export.id}/cancel").status_code == 303
    assert [each.status.value for each in exports(database)] == ["cancelled"]
