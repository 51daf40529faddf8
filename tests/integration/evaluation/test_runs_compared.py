"""Two runs side by side: over REST, on their page, and against the site's reference."""

from collections.abc import Callable
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import AuditEntry, Role, User
from app.tables.reviews import Grade
from app.tables.runs import Match, Run
from tests.factories.runs import FIRST_MMSI, Harbour, make_harbour, make_pose, make_review, make_run
from tests.integration.conftest import MakeUser

COMPARED, CHANGES = "/api/v1/evaluation/runs", "/api/v1/evaluation/runs/changes"
Browser = Callable[[User], TestClient]


@pytest.fixture
def pair(database: Database, admin: User) -> tuple[Harbour, int, int]:
    """Give an older run and one that differs from it in known ways, over three shared images.

    Image 0: vessel 0 moved and turned. Image 1: vessel 0 became vessel 5. Image 2: vessel 0 gone;
    a fourth image is of the new run alone.
    """
    with database.writing() as session:
        harbour = make_harbour(session, images=4)
        old = make_run(session, harbour, (0, 0, 0), name="old")
        new = make_run(
            session, harbour, (0, 0, 0, 1), name="new", parameters={"score_threshold": 0.5}
        )
        images = harbour.images
        first = make_pose(session, old, images[0])
        moved = make_pose(session, new, images[0], lat_deg=53.5426, heading_deg=100.0)
        second = make_pose(session, old, images[1])
        other = make_pose(session, new, images[1], FIRST_MMSI + 5)
        make_pose(session, old, images[2])
        make_pose(session, new, images[2], FIRST_MMSI + 7, person_made=True)
        for pose, grade in (
            (first, Grade.GOOD),
            (second, Grade.WRONG),
            (moved, Grade.OK),
            (other, Grade.GOOD),
        ):
            make_review(session, pose, admin.id, grade)
        return harbour, old.id, new.id


def _figures(answer: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {one["name"]: one for one in answer["figures"]}


def test_only_images_of_both_count_and_changes_are_named(
    client: TestClient, pair: tuple[Harbour, int, int]
) -> None:
    """Counts, shares, settings and changed poses are those of the rows that were put there."""
    _, old_id, new_id = pair
    asked = {"run_id": new_id, "other_run_id": old_id}
    answer = client.get(COMPARED, params=asked).json()
    assert (answer["run"]["images_done"], answer["images_both"]) == (4, 3)
    counts = {one["name"]: (one["run"], one["other"]) for one in answer["counts"]}
    assert counts["poses"] == counts["matches"] == (2, 3)
    acceptable = _figures(answer)["acceptable"]
    assert (acceptable["run"], acceptable["other"], acceptable["difference"]) == (1.0, 0.5, 0.5)
    assert answer["parameters"][0]["differs"]
    differing = {one["name"]: (one["run"], one["other"]) for one in answer["parameters"][:2]}
    assert differing["score_threshold"] == ("0.5", "0.25")
    wanted = {"new": 0, "gone": 1, "other_vessel": 1, "moved": 1, "turned": 1}
    assert (answer["changes"], answer["changed"]) == (wanted, 3)

    first = client.get(CHANGES, params=asked | {"sort": "-moved_m", "limit": 1}).json()
    (moved,) = first["items"]
    assert moved["changes"] == ["moved", "turned"]
    assert moved["moved_m"] == pytest.approx(11.13, abs=0.02)
    rest = client.get(
        CHANGES, params=asked | {"sort": "-moved_m", "cursor": first["next_cursor"]}
    ).json()
    assert [one["changes"] for one in rest["items"]] == [["other_vessel"], ["gone"]]
    assert rest["items"][0]["vessel"] == FIRST_MMSI + 5
    assert rest["next_cursor"] is None
    gone = client.get(CHANGES, params=asked | {"kind": "gone"}).json()["items"]
    assert [one["pose_id"] for one in gone] == [None]
    less = client.get(COMPARED, params=asked | {"moved_m": 12, "turned_deg": 11}).json()
    assert less["changed"] == 2
    lines = client.get(CHANGES, params=asked | {"format": "csv"}).text.splitlines()
    assert len(lines) == 4
    assert "score_threshold" in client.get(COMPARED, params=asked | {"format": "csv"}).text


def test_a_grade_given_later_is_seen_at_once(
    client: TestClient, database: Database, pair: tuple[Harbour, int, int], admin: User
) -> None:
    """What is kept in memory follows from the rows: a new verdict changes the figure."""
    harbour, old_id, new_id = pair
    asked = {"run_id": new_id, "other_run_id": old_id}
    assert _figures(client.get(COMPARED, params=asked).json())["good"]["run_count"] == 2
    with database.writing() as session:
        run = session.get_one(Run, new_id)
        make_review(session, make_pose(session, run, harbour.images[2]), admin.id, Grade.GOOD)
    answer = client.get(COMPARED, params=asked).json()
    assert _figures(answer)["good"]["run_count"] == 3
    assert answer["changes"]["gone"] == 0


def test_the_reference_is_chosen_by_version_and_taken_by_default(
    client: TestClient,
    client_of: Callable[..., TestClient],
    make_user: MakeUser,
    database: Database,
    pair: tuple[Harbour, int, int],
) -> None:
    """Without a reference another run must be named; choosing one needs If-Match and ingest."""
    harbour, old_id, new_id = pair
    place = f"/api/v1/sites/{harbour.site.id}/reference-run"
    missing = client.get(COMPARED, params={"run_id": new_id})
    assert (missing.status_code, missing.json()["errors"][0]["field"]) == (422, "other_run_id")
    assert client.get(place).headers["ETag"] == '"0"'
    assert client.put(place, json={"run_id": old_id}).status_code == 428
    chosen = client.put(place, json={"run_id": old_id}, headers={"If-Match": '"0"'})
    assert (chosen.status_code, chosen.json()["run_id"]) == (200, old_id)
    stale = client.put(place, json={"run_id": new_id}, headers={"If-Match": '"0"'})
    assert stale.status_code == 412
    reviewer = client_of(make_user(Role.REVIEWER, site_id=harbour.site.id))
    refused = reviewer.put(place, json={"run_id": None}, headers=dict(chosen.headers))
    assert refused.status_code == 403
    answer = reviewer.get(COMPARED, params={"run_id": new_id}).json()
    assert (answer["other"]["id"], answer["other"]["is_reference"]) == (old_id, True)
    runs = {one["id"]: one["is_reference"] for one in client.get("/api/v1/runs").json()["items"]}
    assert runs == {old_id: True, new_id: False}
    with database.reading() as session:
        entry = session.scalars(
            sa.select(AuditEntry).where(AuditEntry.entity == "reference run")
        ).one()
    assert (entry.entity_id, entry.site_id) == (old_id, harbour.site.id)


def test_runs_of_other_sites_are_not_there(
    client: TestClient,
    client_of: Callable[..., TestClient],
    make_user: MakeUser,
    database: Database,
    pair: tuple[Harbour, int, int],
) -> None:
    """Neither side of a comparison reaches another site, and a reference is a run of its site."""
    harbour, old_id, new_id = pair
    with database.writing() as session:
        elsewhere = make_harbour(session, images=1)
        foreign_id = make_run(session, elsewhere, (1,)).id
    reader = client_of(make_user(Role.VIEWER, site_id=elsewhere.site.id))
    for asked in (
        {"run_id": new_id, "other_run_id": foreign_id},
        {"run_id": foreign_id, "other_run_id": old_id},
    ):
        assert reader.get(COMPARED, params=asked).status_code == 404
        assert reader.get(CHANGES, params=asked).status_code == 404
    place = f"/api/v1/sites/{harbour.site.id}/reference-run"
    sent = client.put(place, json={"run_id": foreign_id}, headers={"If-Match": '"0"'})
    assert (sent.status_code, sent.json()["errors"][0]["field"]) == (422, "run_id")
    apart = client.get(COMPARED, params={"run_id": foreign_id, "other_run_id": old_id}).json()
    assert (apart["images_both"], apart["figures"], apart["changed"]) == (0, [], 0)


def test_the_page_leads_to_the_review_of_each_changed_pose(
    browser_of: Browser, admin: User, database: Database, pair: tuple[Harbour, int, int]
) -> None:
    """Named the reference by its button, a run is what another is compared with on the page."""
    _, old_id, new_id = pair
    browser = browser_of(admin)
    asked = browser.get(f"/evaluation/runs?run_id={new_id}")
    assert asked.status_code == 200
    assert "has no reference run" in asked.text
    assert browser.post(f"/runs/{old_id}/reference", data={"version": "0"}).status_code == 303
    again = browser.post(f"/runs/{new_id}/reference", data={"version": "0"})
    assert again.status_code == 412
    assert "Take the name back" in browser.get(f"/runs/{old_id}").text
    text = browser.get(f"/evaluation/runs?run_id={new_id}&other_run_id=&kind=").text
    with database.reading() as session:
        poses = session.scalars(sa.select(Match.id).where(Match.run_id == old_id)).all()
    assert len(poses) == 3
    assert text.count(f"/runs/{old_id}/review?pose=") == 3
    assert text.count(f"/runs/{new_id}/review?pose=") == 2
    gone = browser.get(f"/evaluation/runs?run_id={new_id}&kind=gone").text
    assert gone.count("/review?pose=") == 1
