"""The report of a site: its figures, its gaps, and what it does not tell."""

from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from app.tables.reviews import Grade
from app.tables.runs import ReferenceRun
from tests.factories.imagery import make_image
from tests.factories.runs import FIRST_MMSI, make_harbour, make_pose, make_review, make_run
from tests.factories.sites import make_camera
from tests.integration.conftest import MakeUser

Browser = Callable[[User], TestClient]


def test_a_report_is_of_the_reference_and_names_its_gaps(
    database: Database, admin: User, make_user: MakeUser, browser_of: Browser
) -> None:
    """Counts are of the reference run, all runs on request; gaps are said, no vessel named."""
    with database.writing() as session:
        harbour = make_harbour(session, images=2, shows_pseudonyms=True)
        old = make_run(session, harbour, (0, 0), name="old")
        make_run(session, harbour, (1, 1), name="new")
        make_review(session, make_pose(session, old, harbour.images[0]), admin.id, Grade.GOOD)
        session.add(ReferenceRun(site_id=harbour.site.id, run_id=old.id))
        for _ in range(7):
            make_image(session, make_camera(session, harbour.site))
        elsewhere = make_harbour(session)
        site_id, sha256 = harbour.site.id, harbour.model.sha256
    viewer = browser_of(make_user(Role.VIEWER, site_id=site_id))
    text = viewer.get(f"/sites/{site_id}/report").text
    assert "the reference run old" in text
    assert "1 of 1 poses graded" in text
    assert sha256 in text
    assert text.count("Missing:") == 6
    assert "3 other cameras" in text  # one page has room for six lines
    assert str(FIRST_MMSI) not in text
    assert "1 of 3 poses graded" in viewer.get(f"/sites/{site_id}/report?runs=all").text
    later = viewer.get(f"/sites/{site_id}/report?from=2099-01-01T00:00").text
    assert "there is no image of this period" in later
    assert viewer.get(f"/sites/{elsewhere.site.id}/report").status_code == 404


@pytest.mark.parametrize("query", ["from=2026-01-02&to=2026-01-01", "runs=none", "from=nonsense"])
def test_a_period_that_cannot_be_is_refused(
    query: str, database: Database, admin: User, browser_of: Browser
) -> None:
    """Nonsense in the address is an error of the asker's."""
    with database.writing() as session:
        site_id = make_harbour(session).site.id
    assert browser_of(admin).get(f"/sites/{site_id}/report?{query}").status_code == 422
