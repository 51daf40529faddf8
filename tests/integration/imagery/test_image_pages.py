"""Pages of cameras with their photographs."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from app.tables.sites import Camera
from tests.factories.imagery import make_image
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser

Browse = Callable[[User], TestClient]
MORNING = datetime(2026, 11, 22, 8, tzinfo=UTC)


def test_a_camera_pages_through_its_images_in_order_of_time(
    browser_of: Browse, admin: User, database: Database, camera: Camera
) -> None:
    """Sixty images a page, by time whatever the order of upload; the filter narrows them."""
    with database.writing() as session:
        ids = [
            make_image(session, camera, None, MORNING + timedelta(minutes=minute)).id
            for minute in reversed(range(70))
        ]
    ids.reverse()
    browser = browser_of(admin)
    first = browser.get(f"/cameras/{camera.id}").text
    assert [f"/images/{number}" in first for number in (ids[0], ids[59], ids[60])] == [
        True,
        True,
        False,
    ]
    assert "2026-11-22 09:00:00 CET" in first
    second = browser.get(f"/cameras/{camera.id}?after={ids[59]}").text
    assert f'href="/images/{ids[60]}"' in second
    assert f'href="/images/{ids[59]}"' not in second
    narrow = browser.get(f"/cameras/{camera.id}?begin=2026-11-22T09:05:00Z").text
    assert "5 of 5 images" in narrow
    wrong = browser.get(f"/cameras/{camera.id}?begin=tomorrow").text
    assert 'id="field-begin-error"' in wrong
    assert 'value="tomorrow"' in wrong


def test_coverage_counts_images_by_day_and_hour(
    browser_of: Browse, admin: User, database: Database, camera: Camera
) -> None:
    """Hours are UTC on both databases; deleted images do not count."""
    with database.writing() as session:
        for second in range(3):
            make_image(session, camera, None, MORNING + timedelta(seconds=second))
        make_image(session, camera, None, MORNING + timedelta(hours=15, minutes=59))
        make_image(session, camera, None, MORNING.replace(day=23), deleted_at=MORNING)
    text = browser_of(admin).get(f"/cameras/{camera.id}").text
    assert "2026-11-22 08:00 UTC: 3 images" in text
    assert "2026-11-22 23:00 UTC: 1 images" in text
    assert "2026-11-23 08:00 UTC" not in text


def test_an_image_leads_to_its_neighbours_and_can_be_hidden(
    browser_of: Browse, admin: User, database: Database, camera: Camera
) -> None:
    """Earlier and later follow the time; a hidden image is gone, and its neighbours meet."""
    with database.writing() as session:
        images = [
            make_image(session, camera, None, MORNING + timedelta(hours=hour)).id
            for hour in range(3)
        ]
    browser = browser_of(admin)
    middle = browser.get(f"/images/{images[1]}").text
    assert f'href="/images/{images[0]}"' in middle
    assert f'href="/images/{images[2]}"' in middle
    assert browser.post(f"/images/{images[1]}/delete").status_code == 303
    assert browser.get(f"/images/{images[1]}").status_code == 404
    assert f'href="/images/{images[2]}"' in browser.get(f"/images/{images[0]}").text


def test_a_stranger_sees_no_image(
    browser_of: Browse, make_user: MakeUser, database: Database, camera: Camera
) -> None:
    """Pages of another site's images give 404, hiding them too."""
    with database.writing() as session:
        image = make_image(session, camera)
        own = make_site(session)
    browser = browser_of(make_user(Role.OPERATOR, own.id))
    assert browser.get(f"/images/{image.id}").status_code == 404
    assert browser.post(f"/images/{image.id}/delete").status_code == 404
    assert browser.get(f"/cameras/{camera.id}").status_code == 404
