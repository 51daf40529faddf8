"""Evaluation as people see it: figures that fill by themselves, and practice by keys alone."""

import re

import httpx2
import pytest
from playwright.sync_api import Page, expect

from tests.browser.axe import findings
from tests.browser.conftest import MakeRun


@pytest.fixture(scope="module")
def run_id(make_run: MakeRun) -> int:
    """Give a run of this module's own."""
    return make_run("Evaluated")


def test_the_progress_fills_while_others_grade(page: Page, api: httpx2.Client, run_id: int) -> None:
    """A grade given elsewhere shows on an open page without anybody touching it."""
    page.goto(f"/evaluation/progress?run_id={run_id}")
    graded = page.locator("[data-progress=left]").first
    expect(graded).to_have_text(re.compile(r"^0 of \d+ poses graded$"))
    first = api.get("/poses", params={"run_id": run_id}).json()["items"][0]
    api.post(f"/poses/{first['id']}/reviews", json={"grade": "good"}).raise_for_status()
    expect(graded).to_have_text(re.compile(r"^1 of \d+ poses graded$"), timeout=30_000)


def test_a_wanted_width_answers_while_it_is_typed(page: Page, run_id: int) -> None:
    """Typing another width changes the number of grades needed, and the address keeps it."""
    page.goto(f"/evaluation/reviews?run_id={run_id}")
    needed = page.get_by_role("region", name="How many more grades")
    expect(needed).to_contain_text("± 3 % points")
    page.get_by_label("Wanted: ± % points").fill("10")
    expect(needed).to_contain_text("± 10 % points", timeout=30_000)
    expect(page).to_have_url(re.compile("half_width=10"))


def test_the_table_is_split_otherwise_by_a_click(page: Page, run_id: int) -> None:
    """Another property is a link, so that its address shows the same again."""
    page.goto(f"/evaluation/reviews?run_id={run_id}")
    page.get_by_role("navigation", name="Split by").get_by_role("link", name="Range").click()
    expect(page.get_by_role("columnheader", name="Range")).to_be_visible()
    page.reload()
    expect(page.get_by_role("columnheader", name="Range")).to_be_visible()


def test_practice_goes_by_keys_alone(page: Page, api: httpx2.Client, run_id: int) -> None:
    """A digit grades, the judgement is told, Enter goes on, the result waits at the end."""
    body = {"run_id": run_id, "name": "By keys", "from_truth": True, "size": 2}
    made = api.post("/calibration-sets", json=body)
    made.raise_for_status()
    page.goto(f"/calibration-sets/{made.json()['id']}/practice")
    for _ in range(made.json()["poses"]):
        expect(page.get_by_role("heading", name="Your grade")).to_be_visible()
        page.keyboard.press("1")
        expect(page.get_by_role("status")).to_contain_text("Judged")
        page.keyboard.down("Space")
        expect(page.locator(".practice__drawing")).not_to_be_visible()
        page.keyboard.up("Space")
        expect(page.locator(".practice__drawing")).to_be_visible()
        page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Attempt 1")).to_be_visible()
    expect(page.locator("main")).to_contain_text(f"{made.json()['poses']} answered")


def test_axe_finds_nothing(page: Page, run_id: int) -> None:
    """Figures, tables, drawings and the guideline have names, contrast and an order."""
    ask = f"?run_id={run_id}"
    for path in (
        f"/evaluation{ask}",
        f"/evaluation/progress{ask}",
        f"/evaluation/reviews{ask}&by=range",
        f"/evaluation/matching{ask}",
        "/guideline",
        "/calibration-sets",
    ):
        page.goto(path)
        assert findings(page) == [], path
