"""The pages of evaluation: what they show, and that their addresses show the same again."""

from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from app.tables.reviews import Grade, MissedReason
from tests.factories.many import complete_many, grade_many, make_large_run, miss_many
from tests.integration.conftest import MakeUser

Browser = Callable[[User], TestClient]
PAGES = ("/evaluation", "/evaluation/progress", "/evaluation/reviews", "/evaluation/matching")


@pytest.mark.parametrize("path", PAGES)
def test_an_empty_installation_says_what_to_do(path: str, admin: User, browser_of: Browser) -> None:
    """Without a run each page is whole and leads to the next step; empty filters are none."""
    answer = browser_of(admin).get(f"{path}?run_id=&from=&to=")
    assert answer.status_code == 200
    assert any(words in answer.text for words in ("Start a run", "start one", "See the runs"))


def test_the_matching_page_shows_both_columns(
    database: Database, admin: User, browser_of: Browser
) -> None:
    """Ours with its denominators beside the paper's, links to CSV and JSON with the filters."""
    with database.writing() as session:
        run, image_ids, pose_ids = make_large_run(session, images=2, poses=3)
        verdicts = [(Grade.GOOD, ()), (Grade.GOOD, ()), (Grade.WRONG, ("cost_function",))]
        grade_many(session, pose_ids, verdicts, admin.id)
        complete_many(session, run.id, image_ids)
        miss_many(session, run.id, image_ids[0], {MissedReason.NO_AIS: 1})
    text = browser_of(admin).get(f"/evaluation/matching?run_id={run.id}").text
    for words in ("50.00 %", "66.67 %", "70.56", "94.47", "Visible vessels: 4", "Annotations: 3"):
        assert words in text
    assert f'href="/api/v1/evaluation/matching?run_id={run.id}&amp;format=csv"' in text


def test_progress_is_ones_own_and_everybodys(
    database: Database, admin: User, make_user: MakeUser, browser_of: Browser
) -> None:
    """A reviewer sees their own count and the total, and nobody else by name."""
    reviewer = make_user(Role.REVIEWER)
    with database.writing() as session:
        run, _, pose_ids = make_large_run(session, images=2, poses=8)
        grade_many(session, pose_ids[:3], [(Grade.GOOD, ())] * 3, admin.id)
        grade_many(session, pose_ids[3:5], [(Grade.GOOD, ())] * 2, reviewer.id)
    text = browser_of(reviewer).get(f"/evaluation/progress?run_id={run.id}").text
    assert "5 of 8 poses graded" in text
    assert "poses you graded, of 5" in text
    assert admin.email not in text
