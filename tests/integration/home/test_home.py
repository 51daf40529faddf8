"""The first page: the checklist as data come in, and where a reviewer goes on."""

from collections.abc import Callable
from datetime import timedelta

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app import disk_room
from app.db import Database, now
from app.tables.detection import Model, ModelStatus
from app.tables.exports import Export, ExportStatus
from app.tables.feeds import AisFeed
from app.tables.identity import Role, User
from app.tables.queues import ReviewQueueItem
from app.tables.reviews import Grade, Review
from app.tables.runs import Run, RunStatus
from tests.factories.sites import make_site
from tests.factories.world import make_world
from tests.integration.conftest import MakeUser

Browse = Callable[[User], TestClient]


def test_a_newcomer_is_led_to_the_first_open_step(
    browser_of: Browse, admin: User, database: Database
) -> None:
    """Nothing is done at first; a site ticks the first step and leads to its camera."""
    browser = browser_of(admin)
    assert "0 of 11 done" in browser.get("/").text
    with database.writing() as session:
        site = make_site(session, name="Mine")
    shown = browser.get("/").text
    assert "1 of 11 done" in shown
    assert f'href="/sites/{site.id}/cameras/new"' in shown


def test_what_needs_help_stands_on_the_first_page(
    browser_of: Browse, admin: User, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that fills up and a feed that fell silent are seen without being looked for."""
    browser = browser_of(admin)
    assert "are left on the disk" not in browser.get("/").text
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        session.execute(
            sa.update(AisFeed).values(enabled=True, started_at=now() - timedelta(days=3))
        )
    monkeypatch.setattr(disk_room, "SCARCE_BYTES", 1 << 60)
    monkeypatch.setattr(disk_room, "SCARCE_SHARE", 1.0)
    shown = browser.get("/").text
    assert "are left on the disk" in shown
    assert f'/ais/feeds/{ids["feed_id"]}">' in shown


def test_the_checklist_goes_when_all_is_done(
    browser_of: Browse, admin: User, database: Database
) -> None:
    """With a graded pose and an export only the work is left on the page."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        session.execute(sa.update(Export).values(status=ExportStatus.SUCCEEDED))
        session.execute(sa.update(Run).values(status=RunStatus.SUCCEEDED))
        session.execute(sa.update(Model).values(status=ModelStatus.READY))
    browser = browser_of(admin)
    assert "10 of 11 done" in browser.get("/").text
    with database.writing() as session:
        session.add(
            Review(pose_id=ids["pose_id"], grade=Grade.GOOD, reasons=[], guideline_version="1")
        )
    shown = browser.get("/").text
    assert "of 11 done" not in shown
    assert "Nothing is left to review" in shown


@pytest.mark.parametrize("was_there", [True, False])
def test_a_reviewer_goes_on_where_they_were(
    browser_of: Browse, make_user: MakeUser, database: Database, *, was_there: bool
) -> None:
    """Who worked in a queue is led back into it; who did not, to the newest ungraded run."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        session.execute(sa.delete(Review))
    reviewer = make_user(Role.REVIEWER, ids["site_id"])
    if was_there:
        with database.writing() as session:
            session.add(
                ReviewQueueItem(
                    queue_id=ids["queue_id"],
                    position=99,
                    image_id=ids["image_id"],
                    pose_id=ids["pose_id"],
                    user_id=reviewer.id,
                    done_at=now(),
                )
            )
            session.add(
                ReviewQueueItem(
                    queue_id=ids["queue_id"],
                    position=100,
                    image_id=ids["image_id"],
                    pose_id=ids["pose_id"],
                )
            )
    shown = browser_of(reviewer).get("/").text
    assert "left" in shown
    where = f"/runs/{ids['run_id']}/review"
    if was_there:
        assert f'href="{where}?queue={ids["queue_id"]}"' in shown
        assert "Continue reviewing" in shown
    else:
        assert f'href="{where}"' in shown
    assert "checklist" not in shown


def test_a_viewer_and_a_stranger_are_led_on(
    browser_of: Browse, make_user: MakeUser, database: Database, anonymous_browser: TestClient
) -> None:
    """Who has nothing to do here is led to the sites, who is nobody to the sign-in page."""
    with database.writing() as session:
        site = make_site(session)
    viewer = browser_of(make_user(Role.VIEWER, site.id))
    assert viewer.get("/").headers["location"] == "/sites"
    assert anonymous_browser.get("/").headers["location"] == "/sign-in"
