"""Poses over REST: filters, pages, order, and what a pose tells."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.db import Database, now
from app.tables.identity import User
from app.tables.imagery import Image
from app.tables.reviews import Grade
from app.tables.runs import Pose, VesselStateRow
from tests.factories.runs import (
    CORNERS_PX,
    FIRST_MMSI,
    Harbour,
    make_harbour,
    make_pose,
    make_review,
    make_run,
    make_vessel,
)

POSES = "/api/v1/poses"


def ids(client: TestClient, **params: object) -> list[int]:
    """Return the ids of the listed poses."""
    answer = client.get(POSES, params=params)
    assert answer.status_code == 200, answer.text
    return [pose["id"] for pose in answer.json()["items"]]


def poses_of(database: Database, run_id: int) -> list[Pose]:
    """Return a run's poses in order."""
    with database.reading() as session:
        return list(session.scalars(sa.select(Pose).where(Pose.run_id == run_id).order_by(Pose.id)))


def test_a_pose_tells_what_it_was_made_of(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """A pose shows photograph, vessel, box, state, segments and cost, the same alone as listed."""
    with database.writing() as session:
        run = make_run(session, harbour, [1])
        make_vessel(session, name='<b>"ANNE"</b>')
    listed = client.get(POSES, params={"run_id": run.id}).json()["items"]
    pose = client.get(f"{POSES}/{listed[0]['id']}").json()
    assert listed == [pose]
    image = harbour.images[0]
    assert pose["image"]["sha256"] == image.sha256
    assert pose["image"]["file_url"] == f"/api/v1/images/{image.id}/file?v={image.sha256[:12]}"
    assert pose["vessel"] == {"mmsi": FIRST_MMSI, "name": '<b>"ANNE"</b>', "ship_type": 70}
    assert pose["detection"]["score"] == 0.5
    assert pose["corners_in_image_px"] == CORNERS_PX
    assert pose["segments_px"]["corrected"] == CORNERS_PX[:4]
    assert pose["position"] == {"lat_deg": 53.5425, "lon_deg": 9.984, "height_m": 45.5}
    assert pose["cost_terms"]["width"] == 0.0225
    assert (pose["report_age_s"], pose["speed_kn"]) == (12.0, 5.5)
    assert (pose["report_ids"], pose["track_method"]) == ([1, 2], None)
    assert pose["review"] is None


def test_corners_without_a_projection_stay_empty(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """A corner behind the camera is null, in its place among the eight."""
    corners = [None, *CORNERS_PX[1:]]
    with database.writing() as session:
        run = make_run(session, harbour)
        pose = make_pose(
            session,
            run,
            harbour.images[0],
            corners_in_image_px=corners,
            corrected_segment_px=corners[:4],
        )
        state = session.scalars(sa.select(VesselStateRow)).one()
        state.segments_px = {"reported": [None] * 4, "dead_reckoned": corners[:4]}
    shown = client.get(f"{POSES}/{pose.id}").json()
    assert shown["corners_in_image_px"] == corners
    assert shown["segments_px"] == {
        "reported": [None] * 4,
        "dead_reckoned": corners[:4],
        "corrected": corners[:4],
    }


def test_filters_keep_what_they_name(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """Run, image and vessel narrow the list, each alone and all together."""
    with database.writing() as session:
        first, second = (make_run(session, harbour, [2, 1]) for _ in range(2))
    ours, theirs = poses_of(database, first.id), poses_of(database, second.id)
    assert ids(client) == [pose.id for pose in ours + theirs]
    assert ids(client, run_id=first.id) == [pose.id for pose in ours]
    assert ids(client, image_id=harbour.images[1].id) == [ours[2].id, theirs[2].id]
    assert ids(client, mmsi=FIRST_MMSI + 1) == [ours[1].id, theirs[1].id]
    assert ids(client, run_id=first.id, image_id=harbour.images[0].id, mmsi=FIRST_MMSI) == [
        ours[0].id
    ]
    assert ids(client, run_id=999_999) == []


@pytest.mark.parametrize(
    "params",
    [
        {"run_id": 2**31},
        {"run_id": 0},
        {"image_id": 2**70},
        {"mmsi": 10**9},
        {"mmsi": "'; drop table poses"},
        {"grade": "fine"},
        {"grade": "good) or (1=1"},
        {"limit": 0},
        {"limit": 1001},
        {"cursor": "!"},
    ],
)
def test_a_wrong_filter_is_named(client: TestClient, params: dict[str, object]) -> None:
    """A value no pose could have is a mistake, named, on both databases."""
    answer = client.get(POSES, params=params)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == next(iter(params))


def test_the_grade_filter_means_the_newest_verdict(
    client: TestClient, database: Database, harbour: Harbour, make_user: Callable[..., User]
) -> None:
    """Of two people's verdicts the newest counts; a replaced one never does."""
    ada, ben = make_user("reviewer"), make_user("reviewer")
    with database.writing() as session:
        run = make_run(session, harbour, [3])
    plain, disputed, bettered = poses_of(database, run.id)
    with database.writing() as session:
        make_review(session, disputed, ada.id, Grade.GOOD)
        make_review(session, disputed, ben.id, Grade.BAD)
        make_review(session, bettered, ada.id, Grade.WRONG, replaced_at=now())
        make_review(session, bettered, ada.id, Grade.OK)
    by_grade = {
        grade: ids(client, run_id=run.id, grade=grade)
        for grade in ("good", "ok", "bad", "wrong", "ungraded")
    }
    assert by_grade == {
        "good": [],
        "ok": [bettered.id],
        "bad": [disputed.id],
        "wrong": [],
        "ungraded": [plain.id],
    }
    shown = client.get(POSES, params={"grade": "bad"}).json()["items"]
    assert shown[0]["review"]["grade"] == "bad"


def test_pages_meet_without_gap_or_overlap(client: TestClient, database: Database) -> None:
    """Many pages give every pose once, and the poses of an image stand together throughout."""
    with database.writing() as session:
        harbour = make_harbour(session, images=12)
        other = make_run(session, harbour, [1] * 12)
        run = make_run(session, harbour, [3, 0, 5, 1, 2, 4, 0, 1, 3, 2, 1, 6])
    seen: list[dict[str, Any]] = []
    cursor: str | None = None
    pages = 0
    while pages == 0 or cursor:
        params = {"run_id": run.id, "limit": 5} | ({"cursor": cursor} if cursor else {})
        body = client.get(POSES, params=params).json()
        seen += body["items"]
        cursor = body["next_cursor"]
        pages += 1
    assert pages == 6
    expected = [pose.id for pose in poses_of(database, run.id)]
    assert [pose["id"] for pose in seen] == expected
    assert len(poses_of(database, other.id)) == 12
    images = [pose["image"]["id"] for pose in seen]
    changes = sum(one != next_one for one, next_one in pairwise(images))
    assert changes + 1 == len(set(images)) == 10


def test_poses_of_deleted_images_are_hidden(
    client: TestClient, database: Database, harbour: Harbour
) -> None:
    """A deleted photograph takes its poses out of lists, grading and counts, until it is back."""
    with database.writing() as session:
        run = make_run(session, harbour, [1, 1])
    hidden, shown = poses_of(database, run.id)

    def delete(at: object) -> None:
        with database.writing() as session:
            session.execute(
                sa.update(Image).where(Image.id == harbour.images[0].id).values(deleted_at=at)
            )

    delete(now())
    assert ids(client, run_id=run.id) == [shown.id]
    assert client.get(f"{POSES}/{hidden.id}").status_code == 404
    graded = client.post(f"{POSES}/{hidden.id}/reviews", json={"grade": "good"})
    assert graded.status_code == 404
    delete(None)
    assert ids(client, run_id=run.id) == [hidden.id, shown.id]


def test_another_sites_poses_are_not_there(
    database: Database,
    harbour: Harbour,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Lists leave them out, whatever the filter; their ids are 404 like unknown ones."""
    with database.writing() as session:
        ours = make_run(session, harbour, [1])
        theirs = make_run(session, make_harbour(session), [1])
    mine, foreign = (poses_of(database, run.id)[0].id for run in (ours, theirs))
    neighbour = client_of(make_user("admin", harbour.site.id))
    assert ids(neighbour) == [mine]
    assert ids(neighbour, run_id=theirs.id) == []
    for pose_id in (foreign, 999_999, 2**64, 0, -1):
        assert neighbour.get(f"{POSES}/{pose_id}").status_code == 404
        assert neighbour.get(f"{POSES}/{pose_id}/reviews").status_code == 404
        answer = neighbour.post(f"{POSES}/{pose_id}/reviews", json={"grade": "good"})
        assert answer.status_code == 404
