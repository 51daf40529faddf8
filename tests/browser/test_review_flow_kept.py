"""Nothing a reviewer did is lost or done twice: killed servers, closed tabs, two tabs at once."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
import sqlalchemy as sa
from playwright.sync_api import BrowserContext, Page, Request, Route, expect

from app import schema
from app.auth.authentication import SESSION_COOKIE
from app.config import Settings
from app.db import Database
from app.storage import Storage
from app.tables.identity import Role
from app.tables.reviews import Review
from tests.browser.conftest import Complaints, Installation
from tests.browser.review_page import ReviewPage
from tests.factories import identity
from tests.factories.imagery import photograph
from tests.factories.runs import FIRST_MMSI, make_harbour, make_vessel
from tests.factories.runs import make_run as insert_run
from tests.server_process import ServerProcess

Poses = list[dict[str, Any]]


def reviews_of(api: httpx2.Client, pose: dict[str, Any]) -> list[str]:
    """Ask the server for all grades of a pose, replaced ones too."""
    items = api.get(f"/poses/{pose['id']}/reviews").json()["items"]
    return [review["grade"] for review in items]


def grades_sent(context: BrowserContext, event: str = "requestfinished") -> list[str]:
    """Collect the idempotency keys under which grades reach the server from now on."""
    keys: list[str] = []

    def note(request: Request) -> None:
        if request.method == "POST" and request.url.endswith("/reviews"):
            keys.append(request.headers["idempotency-key"])

    context.on(event, note)
    return keys


class Harbour:
    """An installation of its own whose server may be killed: one run, two images, four poses."""

    def __init__(self, folder: Path) -> None:
        settings = Settings(
            data_dir=folder,
            database_url=f"sqlite:///{folder / 'quaymark.db'}",
            storage_url=str(folder / "files"),
        )
        self.database = Database(settings.database_url)
        schema.upgrade(self.database)
        storage = Storage(settings.storage_url)
        with self.database.writing() as session:
            harbour = make_harbour(session, images=2)
            for seed, image in enumerate(harbour.images):
                image.sha256 = storage.put(photograph(seed, image.width_px, image.height_px)).sha256
            self.run_id = insert_run(session, harbour, [2, 2]).id
            for vessel in range(2):
                make_vessel(session, FIRST_MMSI + vessel)
            self.cookie = identity.make_login_session(
                session, identity.make_user(session, Role.ADMIN)
            )
        self.server = ServerProcess(settings, folder / "server.log")

    def grades(self) -> list[tuple[int, str]]:
        """Return what is stored: every review's pose and grade, replaced ones too."""
        with self.database.reading() as session:
            rows = session.execute(sa.select(Review.pose_id, Review.grade).order_by(Review.id))
            return [(pose_id, grade.value) for pose_id, grade in rows]


@pytest.fixture
def harbour(tmp_path: Path) -> Iterator[Harbour]:
    """Give an installation whose server dies in the test."""
    made = Harbour(tmp_path)
    yield made
    made.server.stop()
    made.database.dispose()


def test_a_server_killed_between_key_and_answer_has_the_grade_once(
    harbour: Harbour, stranger: Page, complaints: Complaints
) -> None:
    """The server hears a key press and is killed before it answers; restarted, it has it once."""
    complaints.expect("ERR_")
    stranger.context.add_cookies(
        [{"name": SESSION_COOKIE, "value": harbour.cookie, "url": harbour.server.url}]
    )
    review = ReviewPage(stranger)
    stranger.goto(f"{harbour.server.url}/runs/{harbour.run_id}/review")
    review.wait()
    first = review.pose_id
    harbour.server.freeze()
    with stranger.expect_request("**/reviews"):
        review.press("3")
    assert review.pose_id != first, "the next pose does not wait for the server"
    harbour.server.kill()
    expect(review.sync).to_have_attribute("data-state", "offline")
    review.press("1")
    harbour.server.start()
    review.expect_all_saved()
    assert [grade for _, grade in harbour.grades()] == ["bad", "good"]


def test_an_answer_lost_on_the_way_doubles_nothing(
    page: Page, poses: Poses, api: httpx2.Client, run_id: int, complaints: Complaints
) -> None:
    """The server stores a grade but its answer is lost; the second try finds it done."""
    complaints.expect("ERR_FAILED")
    keys = grades_sent(page.context, "request")
    lost: list[int] = []

    def lose_first_answer(route: Route) -> None:
        answer = route.fetch()
        lost.append(answer.status)
        route.abort() if len(lost) == 1 else route.fulfill(response=answer)

    review = ReviewPage(page)
    review.open(run_id)
    page.route("**/api/v1/poses/*/reviews", lose_first_answer)
    with page.expect_event("requestfailed"):
        review.press("2")
    review.expect_all_saved()
    assert len(keys) == 2
    assert len(set(keys)) == 1
    assert reviews_of(api, poses[0]) == ["ok"]


def test_a_tab_closed_right_after_the_key_loses_nothing(
    page: Page, poses: Poses, api: httpx2.Client, run_id: int
) -> None:
    """A key is pressed and the tab closed in the same breath: the grade is there on return."""
    review = ReviewPage(page)
    review.open(run_id)
    page.keyboard.press("3")
    page.close()
    again = ReviewPage(page.context.new_page())
    again.open(run_id)
    again.expect_graded(1)
    again.expect_all_saved()
    assert again.pose_id == poses[1]["id"]
    assert reviews_of(api, poses[0]) == ["bad"]


def test_undo_and_reasons_wait_for_the_network_in_their_order(
    page: Page, poses: Poses, api: httpx2.Client, run_id: int, complaints: Complaints
) -> None:
    """Without network one grades, gives a reason and undoes; back online all of it has happened."""
    complaints.expect("ERR_INTERNET_DISCONNECTED")
    review = ReviewPage(page)
    review.open(run_id)
    page.context.set_offline(offline=True)
    review.press("2", "w")  # heading
    review.press("3", "Backspace")
    expect(review.sync).to_contain_text("kept here")
    page.context.set_offline(offline=False)
    review.expect_all_saved()
    first = api.get(f"/poses/{poses[0]['id']}").json()["review"]
    assert (first["grade"], first["reasons"]) == ("ok", ["heading"])
    assert api.get(f"/poses/{poses[1]['id']}").json()["review"] is None


def test_two_tabs_send_each_grade_once(
    page: Page, poses: Poses, api: httpx2.Client, run_id: int, complaints: Complaints
) -> None:
    """Two tabs of one reviewer hold different poses, and each grade is there a single time."""
    complaints.expect("ERR_INTERNET_DISCONNECTED")
    context = page.context
    keys = grades_sent(context)
    one, other = ReviewPage(page), ReviewPage(context.new_page())
    one.open(run_id)
    other.open(run_id)
    held = [one.pose_id, other.pose_id]
    assert held[0] != held[1]
    context.set_offline(offline=True)
    one.press("1")
    other.press("2")
    expect(one.sync).to_contain_text("kept here")
    context.set_offline(offline=False)
    one.expect_all_saved()
    other.expect_all_saved()
    # A tab whose answer is slow may send a grade once more, under the same key.
    assert len(set(keys)) == 2
    graded = {pose["id"]: reviews_of(api, pose) for pose in poses if pose["id"] in held}
    assert graded == {held[0]: ["good"], held[1]: ["ok"]}


def test_somebody_elses_sign_in_does_not_get_ones_grades(
    page: Page,
    poses: Poses,
    api: httpx2.Client,
    complaints: Complaints,
    installation: Installation,
    run_id: int,
) -> None:
    """When another person signs in meanwhile, the grade waits until its own reviewer is back."""
    complaints.expect("401")
    context = page.context
    review = ReviewPage(page)
    review.open(run_id)
    own = context.cookies()
    context.clear_cookies()
    review.press("2")
    expect(review.sync).to_have_attribute("data-state", "signed-out")
    with installation.database.writing() as session:
        stranger = identity.make_user(session, Role.ADMIN)
        cookie = identity.make_login_session(session, stranger)
    context.add_cookies([{"name": SESSION_COOKIE, "value": cookie, "url": installation.url}])
    page.evaluate("() => window.dispatchEvent(new Event('focus'))")
    expect(review.sync).to_contain_text("Signed in as somebody else")
    assert reviews_of(api, poses[0]) == []
    context.clear_cookies()
    context.add_cookies(own)
    page.evaluate("() => window.dispatchEvent(new Event('focus'))")
    review.expect_all_saved()
    assert reviews_of(api, poses[0]) == ["ok"]
