"""Rules of retention say what they would take, and take no more."""

from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
from starlette.testclient import TestClient

from app.config import Settings
from app.db import Database, now
from app.retention import service
from app.storage import Storage
from app.tables.ais import AisPosition
from app.tables.identity import User
from app.tables.reviews import Grade, Review
from app.tables.runs import Pose
from tests.factories.imagery import make_image
from tests.factories.runs import make_harbour, make_pose, make_run


def test_a_rule_takes_old_images_that_nobody_judged_and_spare_positions(
    client: TestClient, database: Database, settings: Settings
) -> None:
    """The dry run names the count; applied, judged images, new ones and needed reports stay."""
    old = now() - timedelta(days=100)
    with database.writing() as session:
        harbour = make_harbour(session, images=0)
        images = [
            make_image(session, harbour.camera, harbour.viewport, moment)
            for moment in (old, old + timedelta(hours=2), now())
        ]
        run = make_run(session, harbour)
        judged = make_pose(session, run, images[1])
        session.add(Review(pose_id=judged.id, grade=Grade.OK, reasons=[], guideline_version=1))
        for moment in (old, old + timedelta(hours=2, minutes=3), now()):
            session.add(
                AisPosition(
                    site_id=harbour.site.id,
                    mmsi=211_000_001,
                    fix_time=moment,
                    received_at=moment,
                    lat_deg=53.5,
                    lon_deg=9.9,
                )
            )
    rules = f"/api/v1/sites/{harbour.site.id}/retention-rules"
    of_images = client.post(rules, json={"kind": "images", "keep_days": 30}).json()
    of_ais = client.post(rules, json={"kind": "ais_positions", "keep_days": 30}).json()
    assert (of_images["would_go"], of_ais["would_go"], of_images["is_active"]) == (1, 1, False)
    storage = Storage(settings.storage_url)
    assert service.apply_all(database, storage) == 0  # switched off
    for rule in (of_images, of_ais):
        assert client.post(f"/api/v1/retention-rules/{rule['id']}/on").status_code == 200

    assert service.apply_all(database, storage) == 2
    assert service.apply_all(database, storage) == 0

    left = [item["id"] for item in client.get("/api/v1/images").json()["items"]]
    assert left == [images[1].id, images[2].id]
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count(AisPosition.id))) == 2
        assert list(session.scalars(sa.select(Pose.id))) == [judged.id]
    deletion = client.get("/api/v1/deletions").json()["items"][0]
    assert "older than 30 days" in deletion["label"]
    assert client.post(f"/api/v1/deletions/{deletion['id']}/restore").status_code == 204
    assert client.delete(f"/api/v1/retention-rules/{of_ais['id']}").status_code == 204


def test_the_page_adds_and_switches_rules(
    browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """A wrong number is named; a rule begins switched off and is switched on."""
    with database.writing() as session:
        harbour = make_harbour(session)
    browser = browser_of(admin)
    rules = f"/sites/{harbour.site.id}/retention-rules"
    assert browser.post(rules, data={"kind": "previews", "keep_days": "0"}).status_code == 422
    made = browser.post(rules, data={"kind": "previews", "keep_days": "7"})
    assert made.status_code == 303
    with database.reading() as session:
        rule_id = service.rules(session, harbour.site.id)[0].id
    shown = browser.get(made.headers["location"]).text
    assert "Switch on" in shown
    browser.post(f"/retention-rules/{rule_id}/on")
    assert "Switch off" in browser.get(made.headers["location"]).text
