"""Pages of live feeds: how a feed stands, the form, and what is refused."""

from collections.abc import Callable
from datetime import timedelta

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database, now
from app.feeds.accounts import empty_account
from app.tables.feeds import AisFeed, AisFeedStatus, FeedCondition
from app.tables.identity import User
from app.tables.operation import Lease, WorkerHeartbeat
from app.tables.sites import Site
from tests.factories.sites import make_site


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Allow this machine, as an installation beside its receiver does."""
    return settings.model_copy(
        update={
            "feed_allowed_networks": ["127.0.0.0/8"],
            "metrics_allowed_addresses": ["testclient"],
        }
    )


@pytest.fixture
def browser(browser_of: Callable[[User], TestClient], admin: User) -> TestClient:
    """Give an administrator's browser."""
    return browser_of(admin)


@pytest.fixture
def site(database: Database) -> Site:
    """Give a site."""
    with database.writing() as session:
        return make_site(session)


def entered(site: Site, **changes: str) -> dict[str, str]:
    """Return what somebody fills in."""
    return {
        "site_id": str(site.id),
        "name": "Lighthouse",
        "kind": "tcp",
        "host": "127.0.0.1",
        "port": "5631",
        "allowed_senders": "",
        "silent_after_s": "30",
        **changes,
    }


def held(database: Database, feed_id: int, *, last_message_s: float) -> None:
    """Write what a worker writes that holds a feed and heard of a vessel so long ago."""
    moment = now()
    heard = moment - timedelta(seconds=last_message_s)
    with database.writing() as session:
        feed = session.get(AisFeed, feed_id)
        assert feed is not None
        feed.started_at = moment - timedelta(hours=1)
        session.add(WorkerHeartbeat(executor_id="w", host="quay", pid=4711, code_version="1"))
        session.add(
            Lease(name=f"feed:{feed_id}", holder="w", epoch=1, taken_at=moment, renewed_at=moment)
        )
        session.add(
            AisFeedStatus(
                feed_id=feed_id,
                condition=FeedCondition.CONNECTED,
                condition_since=feed.started_at,
                connections=3,
                last_message_at=heard,
                rate_per_s=12.5,
                last_error="The other side closed the connection.",
                last_error_at=heard,
                accounting=empty_account(),
            )
        )


def test_a_feed_is_set_up_stopped_and_removed(browser: TestClient, site: Site) -> None:
    """The form makes a feed, its page stops and starts it, and removes it."""
    made = browser.post("/ais/feeds", data=entered(site))
    assert made.status_code == 303
    place = made.headers["Location"]
    assert "Waiting" in browser.get(place).text
    stopped = browser.post(place, data={"version": "1", "enabled": "false"})
    assert stopped.status_code == 303
    assert "Stopped" in browser.get(place).text
    assert browser.post(place, data={"version": "1", "enabled": "true"}).status_code == 412
    assert browser.post(f"{place}/remove").headers["Location"] == "/deletions"
    assert browser.get(place).status_code == 404


def test_the_form_says_what_is_wrong(browser: TestClient, site: Site) -> None:
    """An address inside is refused at its field, and what was entered stays."""
    refused = browser.post("/ais/feeds", data=entered(site, host="169.254.169.254"))
    assert refused.status_code == 422
    assert "QUAYMARK_FEED_ALLOWED_NETWORKS" in refused.text
    assert 'value="169.254.169.254"' in refused.text
    assert browser.post("/ais/feeds", data=entered(site, host="")).status_code == 422


def test_a_receiver_two_days_off_is_told_where_coverage_is_looked_at(
    browser: TestClient, database: Database, site: Site
) -> None:
    """Its reports stand at its own times, so the page says why images of now have none."""
    place = browser.post("/ais/feeds", data=entered(site)).headers["Location"]
    held(database, int(place.rpartition("/")[2]), last_message_s=1)
    coverage = f"/sites/{site.id}/coverage"
    assert "Clock suspect" not in browser.get(coverage).text
    with database.writing() as session:
        session.scalars(sa.select(AisFeedStatus)).one().receiver_lag_s = 48 * 3600.0
    assert "48.0 h behind" in browser.get(coverage).text
    assert "clock is suspect" in browser.get(place).text


@pytest.mark.parametrize("last_message_s", [2, 40])
def test_silence_is_an_alarm_wherever_it_matters(
    browser: TestClient, client: TestClient, database: Database, site: Site, last_message_s: float
) -> None:
    """A feed silent for too long alarms on its page, the site's, the list of sites, in metrics."""
    place = browser.post("/ais/feeds", data=entered(site)).headers["Location"]
    feed_id = int(place.rpartition("/")[2])
    held(database, feed_id, last_message_s=last_message_s)
    is_silent = last_message_s > 30
    state = client.get(f"/api/v1{place}").json()
    assert state["state"] == ("silent" if is_silent else "connected")
    assert (state["alarm"], state["worker"]) == (is_silent, "quay, process 4711")
    assert state["rate_per_s"] == (0 if is_silent else 12.5)
    for page in (place, "/ais/feeds", f"/sites/{site.id}", "/sites"):
        text = browser.get(page).text
        assert ("No AIS message by the feed" in text) == is_silent, page
    metrics = client.get("/metrics").text
    label = f'feed="{feed_id}",name="Lighthouse",site="{site.id}"'
    assert f"quaymark_feed_silent{{{label}}} {float(is_silent)}" in metrics
    assert f"quaymark_feed_connected{{{label}}} 1.0" in metrics
