"""Queues: one click begins, two people never hold the same, images are worked through as well."""

from typing import Any

import httpx2
import sqlalchemy as sa
from playwright.sync_api import Browser, Page, expect

from app.auth.authentication import SESSION_COOKIE
from app.tables.identity import Role
from app.tables.queues import ReviewQueue, ReviewQueueItem
from tests.browser.axe import findings
from tests.browser.conftest import Complaints, Installation
from tests.browser.review_page import ReviewPage
from tests.factories import identity
from tests.worker_process import wait_until

Poses = list[dict[str, Any]]


def test_review_begins_with_one_click_on_the_run(page: Page, run_id: int, poses: Poses) -> None:
    """The run's page leads to the first ungraded pose, with nothing to choose on the way."""
    page.goto(f"/runs/{run_id}")
    page.get_by_role("link", name="Review the poses").click()
    review = ReviewPage(page)
    review.wait()
    assert review.pose_id == poses[0]["id"]
    review.press("1")
    review.expect_graded(1)


def test_two_reviewers_never_hold_the_same(
    page: Page,
    browser: Browser,
    installation: Installation,
    run_id: int,
    complaints: Complaints,
) -> None:
    """A second reviewer of the same run gets other poses; what the first leaves comes to them."""
    one = ReviewPage(page)
    one.open(run_id)
    with installation.database.writing() as session:
        user = identity.make_user(session, Role.REVIEWER)
        cookie = identity.make_login_session(session, user)
    context = browser.new_context(
        base_url=installation.url, viewport={"width": 1440, "height": 900}
    )
    complaints.listen(context)
    context.add_cookies([{"name": SESSION_COOKIE, "value": cookie, "url": installation.url}])
    other = ReviewPage(context.new_page())
    other.open(run_id)
    first = one.pose_id
    assert other.pose_id != first
    page.goto("/runs")
    other.page.goto("/runs")
    wait_until(lambda: _free(installation, run_id), what="the leases to be given back")
    other.open(run_id)
    assert other.pose_id == first
    context.close()


def _free(installation: Installation, run_id: int) -> bool:
    """Whether nobody holds an item of the run's queues."""
    held = (
        sa.select(sa.func.count())
        .select_from(ReviewQueueItem)
        .join(ReviewQueue, ReviewQueue.id == ReviewQueueItem.queue_id)
        .where(
            ReviewQueue.run_id == run_id,
            ReviewQueueItem.leased_until.is_not(None),
            ReviewQueueItem.done_at.is_(None),
        )
    )
    with installation.database.reading() as session:
        return session.scalar(held) == 0


def test_a_late_grade_is_told_calmly_as_a_second_opinion(
    page: Page, api: httpx2.Client, poses: Poses, run_id: int
) -> None:
    """Somebody else graded the shown pose first: the grade is kept, and the page says how."""
    review = ReviewPage(page)
    review.open(run_id)
    api.post(f"/poses/{poses[0]['id']}/reviews", json={"grade": "bad"}).raise_for_status()
    review.press("1")
    expect(page.get_by_text("kept as a second opinion")).to_be_visible()
    review.expect_all_saved()
    grades = [
        (entry["grade"], entry["second_opinion"])
        for entry in api.get(f"/poses/{poses[0]['id']}/reviews").json()["items"]
    ]
    assert grades == [("bad", False), ("good", True)]


def test_a_queue_of_images_leads_through_all_of_them(
    page: Page, api: httpx2.Client, poses: Poses, run_id: int
) -> None:
    """A seeded sample of images, with and without poses, until each is said to be complete."""
    page.goto(f"/runs/{run_id}/queues")
    assert findings(page) == []
    page.get_by_label("Of", exact=True).select_option("image")
    page.get_by_label("Sample").fill("4")
    page.get_by_label("Seed").fill("7")
    page.get_by_role("button", name="Make it and begin").click()
    review = ReviewPage(page)
    review.wait()
    assert page.title().startswith("Review")
    queue = api.get("/review-queues", params={"run_id": run_id}).json()["items"][0]
    assert (queue["sample"], queue["seed"], queue["unit"]) == (4, 7, "image")
    bar = page.locator("[data-part=graded]")
    for count in range(1, 5):
        for _ in poses:
            if page.locator("[data-part=place]").inner_text().startswith("Whole image"):
                break
            review.press("1")
        review.press("Enter")
        expect(bar).to_contain_text(f"{count} of 4 images complete")
    expect(page.get_by_text("All done here.")).to_be_visible()
    review.expect_all_saved()
    progress = api.get(f"/review-queues/{queue['id']}/progress").json()
    assert (progress["done"], progress["remaining"]) == (4, 0)


def test_a_wrong_queue_names_the_field_and_the_fix(
    page: Page, run_id: int, complaints: Complaints
) -> None:
    """A sample that is no number comes back with its field marked, and what was entered kept."""
    complaints.expect("422")
    page.goto(f"/runs/{run_id}/queues")
    page.get_by_label("Sample").fill("many")
    page.get_by_label("Order").select_option("random")
    with page.expect_response(lambda answer: answer.status == 422):
        page.get_by_role("button", name="Make it and begin").click()
    expect(page.get_by_label("Sample")).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_text("give a whole number from 1")).to_be_visible()
    expect(page.get_by_label("Order")).to_have_value("random")


def test_the_figures_stand_beside_the_work(page: Page, run_id: int) -> None:
    """S shows the share of Good with its interval and how many more grades a precision needs."""
    review = ReviewPage(page)
    review.open(run_id)
    review.press("1", "1", "2")
    review.expect_all_saved()
    review.press("s")
    figures = page.get_by_role("region", name="Figures of the run")
    expect(figures).to_contain_text("2 of 3")
    expect(figures).to_contain_text("3 of 3")
    expect(figures).to_contain_text("needs about")
    review.press("g")
    expect(page.get_by_role("dialog", name="Guideline")).to_be_visible()
