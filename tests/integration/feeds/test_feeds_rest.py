"""Live feeds over REST: set up, changed, stopped, removed; addresses inside are refused."""

from collections.abc import Callable

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database
from app.tables.feeds import AisFeed
from app.tables.identity import AuditEntry, Role
from app.tables.sites import Site
from tests.factories.sites import make_site
from tests.integration.conftest import MakeUser

FEEDS = "/api/v1/ais/feeds"
ANYWHERE = "0.0.0.0"  # noqa: S104  what a feed is told, nothing is bound


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Allow one network inside, as an installation beside its receiver does."""
    return settings.model_copy(update={"feed_allowed_networks": ["127.0.0.8/32"]})


@pytest.fixture
def site(database: Database) -> Site:
    """Give a site."""
    with database.writing() as session:
        return make_site(session)


def tcp(site: Site, **changes: object) -> dict[str, object]:
    """Return the body that sets up a feed from an allowed address."""
    return {
        "site_id": site.id,
        "name": "Lighthouse",
        "kind": "tcp",
        "host": "127.0.0.8",
        "port": 5631,
        **changes,
    }


def test_a_feeds_life(client: TestClient, database: Database, site: Site) -> None:
    """A feed is made once, listed, changed by those who saw the last version, stopped, removed."""
    key = {"Idempotency-Key": "one"}
    made = client.post(FEEDS, json=tcp(site), headers=key)
    assert made.status_code == 201
    assert client.post(FEEDS, json=tcp(site), headers=key).json()["id"] == made.json()["id"]
    place = made.headers["Location"]
    feed = made.json()
    assert (feed["state"], feed["enabled"], feed["alarm"]) == ("waiting", True, False)
    assert feed["accounting"]["lines"]["total"] == 0
    listed = client.get(FEEDS, params={"site_id": site.id}).json()["items"]
    assert [item["id"] for item in listed] == [feed["id"]]

    assert client.patch(place, json={"port": 5632}).status_code == 428
    match = {"If-Match": made.headers["ETag"]}
    changed = client.patch(place, json={"port": 5632, "enabled": False}, headers=match)
    assert (changed.json()["port"], changed.json()["state"]) == (5632, "stopped")
    assert client.patch(place, json={"port": 5633}, headers=match).status_code == 412

    assert client.delete(place).status_code == 204
    assert client.get(place).status_code == 404
    assert client.get(FEEDS).json()["items"] == []
    assert client.post(FEEDS, json=tcp(site)).status_code == 201, "the name is free again"
    with database.reading() as session:
        assert session.get(AisFeed, feed["id"]) is not None, "its reports say they came from it"
        actions = session.scalars(
            sa.select(AuditEntry.action).filter_by(entity="feed").order_by(AuditEntry.id)
        ).all()
    assert actions == ["create", "update", "delete", "create"]


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "localhost", "169.254.169.254", "10.1.2.3", "2130706433", "[::ffff:127.0.0.1]"],
)
def test_an_address_inside_is_refused(client: TestClient, site: Site, host: str) -> None:
    """A feed to this machine, its network or a cloud's metadata answers 422 naming the field."""
    refused = client.post(FEEDS, json=tcp(site, host=host))
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "host"
    made = client.post(FEEDS, json=tcp(site))
    moved = client.patch(
        made.headers["Location"], json={"host": host}, headers={"If-Match": made.headers["ETag"]}
    )
    assert moved.status_code == 422


def test_what_cannot_be_is_said(client: TestClient, site: Site) -> None:
    """Wrong fields answer 422, and a name or port in use 409, each naming the field."""
    for changes, field in (
        ({"host": "a b"}, "host"),
        ({"host": "ais.example.org:5631"}, "host"),
        ({"port": 0}, "port"),
        ({"silent_after_s": 0}, "silent_after_s"),
        ({"kind": "udp", "host": ANYWHERE, "allowed_senders": ["somebody"]}, "allowed_senders.0"),
    ):
        refused = client.post(FEEDS, json=tcp(site, **changes))
        assert refused.status_code == 422, changes
        assert refused.json()["errors"][0]["field"] == field
    for changes in ({"kind": "udp", "host": "ais.example.org"}, {"allowed_senders": ["192.0.2.7"]}):
        assert client.post(FEEDS, json=tcp(site, **changes)).status_code == 422

    udp = tcp(site, name="First", kind="udp", host=ANYWHERE, port=10110)
    assert client.post(FEEDS, json=udp).status_code == 201
    for changes, field in (({"name": "Second"}, "port"), ({"port": 10111}, "name")):
        taken = client.post(FEEDS, json=udp | changes)
        assert taken.status_code == 409
        assert taken.json()["errors"][0]["field"] == field


def test_feeds_are_their_sites(
    site: Site,
    database: Database,
    make_user: MakeUser,
    client_of: Callable[..., TestClient],
    client: TestClient,
) -> None:
    """A viewer sees a feed and may not touch it; to others of another site it does not exist."""
    place = client.post(FEEDS, json=tcp(site)).headers["Location"]
    with database.writing() as session:
        other = make_site(session)
    viewer = client_of(make_user(Role.VIEWER, site.id))
    assert viewer.get(place).status_code == 200
    stop = {"json": {"enabled": False}, "headers": {"If-Match": '"1"'}}
    assert viewer.patch(place, **stop).status_code == 403
    stranger = client_of(make_user(Role.OPERATOR, other.id))
    assert stranger.get(FEEDS).json()["items"] == []
    for answer in (stranger.get(place), stranger.patch(place, **stop), stranger.delete(place)):
        assert answer.status_code == 404
    assert stranger.post(FEEDS, json=tcp(site)).status_code == 404
