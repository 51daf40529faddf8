"""The page of exports."""

import html
import json
import re
import shlex
from collections.abc import Callable

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.exports import repository, service
from app.exports.filters import ExportFilters, ExportOptions
from app.exports.preview import look
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
    """A form sent leads to the export's page, which shows the wait and then what to download."""
    browser = browser_of(make_user("reviewer"))
    form = {"format": "coco", "run_id": str(run_id), "grade": ["good", "ok"]}
    sent = browser.post("/exports", data=form)
    (export,) = exports(database)
    here = f"/exports/{export.id}"
    assert (sent.status_code, sent.headers["location"]) == (303, here)
    assert export.filters == {"run_id": run_id, "grade": ["good", "ok"]}
    assert export.anonymise
    for place in ("/exports", here):
        assert f"/api/v1/exports/{export.id}/download" not in browser.get(place).text
    make(export.id)
    assert f"/api/v1/exports/{export.id}/download" in browser.get("/exports").text
    done = browser.get(here).text
    (export,) = exports(database)
    assert str(export.sha256) in done
    assert f"-C - -o quaymark-export-{export.id}.json" in done
    stranger = browser_of(make_user("viewer"))
    assert stranger.get(here).status_code == 404


def test_an_export_is_looked_at_before_it_is_made(
    database: Database,
    run_id: int,
    make: Make,
    client: TestClient,
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Counts, grades, first poses, the size and a command; of very many the first."""
    browser = browser_of(make_user("reviewer"))
    wanted = f"format=csv&run_id={run_id}&grade=ungraded&range_max_m=5000"
    untidy = browser.get(f"/exports/preview?{wanted}&camera_id=&mmsi=")
    address = untidy.headers["location"]
    assert address == f"/exports/preview?run_id={run_id}&grade=ungraded&range_max_m=5000&format=csv"
    shown = browser.get(address).text
    (command,) = re.findall(r'<pre[^>]* id="curl-request">(.*?)</pre>', shown, re.DOTALL)
    words = shlex.split(html.unescape(command).replace("\\\n", ""))
    body = json.loads(words[words.index("-d") + 1])
    asked = client.post("/api/v1/exports", json=body).json()
    make(asked["id"])
    made = client.get(f"/api/v1/exports/{asked['id']}").json()
    filters, options = ExportFilters.model_validate(body["filters"]), ExportOptions()
    with database.reading() as session:
        held = look(session, service.Request("csv", filters, options, None, anonymise=True))
    assert (held.poses, held.images, held.vessels) == (3, 2, 2)
    assert held.grades["ungraded"] == 3
    assert held.size_bytes == made["size_bytes"]
    assert [row["vessel"] for row in held.rows if row["vessel"] in shown] == [
        row["vessel"] for row in held.rows
    ]
    monkeypatch.setattr("app.exports.preview.LOOKED_AT", 2)
    of_more = " ".join(browser.get(address).text.split())
    assert "more than 2" in of_more
    assert "Only the first 2 poses" in of_more
    nothing = browser.get("/exports/preview?range_min_m=900000&format=bop").text
    assert "No pose fits" in nothing
    assert browser.get("/exports/preview?format=xlsx").status_code == 422


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
