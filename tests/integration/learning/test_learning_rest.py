"""Learning from a site's reviews: proposed with its worth, applied by a person, undone."""

from collections.abc import Callable
from datetime import timedelta

import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database
from app.tables.detection import Detection, DetectionSet
from app.tables.identity import AuditEntry, User
from app.tables.imagery import Image
from app.tables.reviews import Grade, MissedReason
from app.tables.runs import Match, Pose, Run, RunImage
from tests.factories.imagery import NOON
from tests.factories.many import complete_many, grade_many, make_large_run, miss_many
from tests.factories.runs import make_registration

IMAGES = 48
WRONG = (Grade.WRONG, ("missing_ais",))


def graded_site(database: Database, reviewer: User, complete: int = IMAGES) -> tuple[int, int]:
    """Store a run of matching likelihood, two poses an image of which every sixth is wrong.

    Two more boxes an image show vessels without AIS, one vessel an image is overlooked. Returns the
    ids of the site and the viewport.
    """
    with database.writing() as session:
        run, image_ids, pose_ids = make_large_run(session, images=IMAGES, poses=2 * IMAGES)
        run.parameters = {"matching": "likelihood", "score_threshold": 0.25}
        verdicts = [WRONG if n % 6 == 0 else (Grade.GOOD, ()) for n in range(len(pose_ids))]
        grade_many(session, pose_ids, verdicts, reviewer.id)
        complete_many(session, run.id, image_ids[:complete])
        for number, image_id in enumerate(image_ids):
            miss_many(
                session, run.id, image_id, {MissedReason.NO_AIS: 2, MissedReason.NOT_DETECTED: 1}
            )
            image = session.get_one(Image, image_id)
            # Eight images an occasion.
            image.captured_at = NOON + timedelta(hours=2 * (number // 8), minutes=number % 8)
        _tell_sets(session, run)
        for number, pose_id in enumerate(pose_ids):
            match = session.get_one(Pose, pose_id).match
            wrong = number % 6 == 0
            match.cost = -0.5 if wrong else -9.0
            match.cost_terms = {"probability": 0.6 if wrong else 0.999}
        return run.site_id, run.viewport_id


def _tell_sets(session: sa.orm.Session, run: Run) -> None:
    """Say which detections each image had, and add two that no pose is of."""
    rows = session.execute(
        sa.select(Pose.image_id, Detection.detection_set_id)
        .join(Match, Match.id == Pose.match_id)
        .join(Detection, Detection.id == Match.detection_id)
        .where(Pose.run_id == run.id)
    )
    for image_id, set_id in dict(rows.all()).items():
        session.get_one(RunImage, (run.id, image_id)).detection_set_id = set_id
        box = {"y1_px": 5.0, "x2_px": 60.0, "y2_px": 12.0, "score": 0.4, "class_id": 8}
        found = session.get_one(DetectionSet, set_id)
        found.detections += [Detection(x1_px=50.0, **box), Detection(x1_px=45.0, **box)]


def test_what_reviews_teach_is_applied_and_undone(
    client: TestClient, browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """A proposal tells shares and gain; applied it counts for new runs, undone no more."""
    site_id, viewport_id = graded_site(database, admin)
    address = f"/api/v1/sites/{site_id}/learning"

    proposal = client.get(address).json()

    assert (proposal["images"], proposal["occasions"]) == (48, 6)
    assert not any(proposal["missing"].values())
    # 80 right, 16 wrong for want of AIS, 96 marked without AIS, 48 overlooked.
    assert proposal["silent_share"]["of"] == 240
    assert abs(proposal["silent_share"]["share"] - 112 / 240) < 1e-9
    assert 1.8 < proposal["fitted"]["unidentified_per_image"] < 2.4
    assert 0.6 < proposal["fitted"]["detected_share"] < 0.68
    gain = proposal["gain"]
    assert (gain["now"]["wrong"], gain["fitted"]["wrong"], gain["fitted"]["right"]) == (16, 0, 80)
    assert gain["loss_change"][2] < 0
    assert proposal["may_be_applied"]

    sets = f"/api/v1/sites/{site_id}/learnt-settings"
    assert client.post(sets, json={"key": "of another proposal"}).status_code == 409
    made = client.post(sets, json={"key": proposal["key"]})
    assert made.status_code == 201
    assert len(made.json()["basis"]["image_ids"]) == 48
    assert client.post(sets, json={"key": proposal["key"]}).status_code == 409
    with database.writing() as session:
        make_registration(session, session.get_one(Run, 1).viewport)
    fitted = proposal["fitted"]["unidentified_per_image"]
    assert unidentified(client, viewport_id, "waterline") == fitted
    assert unidentified(client, viewport_id, "paper") == 1.0
    assert unidentified(client, viewport_id, "waterline", unidentified_per_image=0.3) == 0.3

    page = browser_of(admin).get(f"/sites/{site_id}/learning").text
    assert "48 complete images" in page
    undo = f"/api/v1/learnt-settings/{made.json()['id']}/undo"
    assert client.post(undo).json()["undone_at"]
    assert client.post(undo).status_code == 409
    assert unidentified(client, viewport_id, "waterline") == 1.0
    assert [row["number"] for row in client.get(sets).json()["items"]] == [1]
    with database.reading() as session:
        entries = session.scalars(
            sa.select(AuditEntry.action).where(AuditEntry.entity == "learnt settings")
        ).all()
    assert entries == ["apply", "undo"]


def unidentified(client: TestClient, viewport_id: int, preset: str, **parameters: float) -> float:
    """Start a run and return one of the settings it took."""
    body = {"viewport_id": viewport_id, "preset": preset, "parameters": parameters}
    answer = client.post("/api/v1/runs", json=body)
    assert answer.status_code == 201, answer.text
    return float(answer.json()["parameters"]["unidentified_per_image"])


def test_too_few_grades_teach_nothing_yet(
    client: TestClient, browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """With few complete images the page says how many more; nothing can be applied."""
    site_id, _ = graded_site(database, admin, complete=10)
    proposal = client.get(f"/api/v1/sites/{site_id}/learning").json()
    assert (proposal["missing"]["images"], proposal["missing"]["occasions"]) == (20, 2)
    assert proposal["fitted"] is None
    form = {"key": proposal["key"]}
    browser = browser_of(admin)
    refused = browser.post(f"/sites/{site_id}/learnt-settings", data=form)
    assert refused.status_code == 409
    assert "20 more complete images" in refused.text
