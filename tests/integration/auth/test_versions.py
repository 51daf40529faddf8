"""No edit undoes another's: every route that edits asks for the version, or says here why not."""

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.db import Database
from tests.factories import identity
from tests.factories.world import make_world
from tests.integration.auth.test_who_may import calls_of, send

OWN = "a mark, a key or an opinion of one's own"
BYTES = "a part of a file on its way in, known by its place"
FIRST = "the first set needs no version; replacing one does"
TABLE = "a file that is taken whole, before anything is made of it"
JUDGED = "what experts agreed on one pose, put whole in the place of what was"
WITHOUT = {
    "/api/v1/decisions/{decision_name}": OWN,
    "/api/v1/poses/{pose_id}/bookmark": OWN,
    "/api/v1/images/{image_id}/bookmark": OWN,
    "/api/v1/me/keys": OWN,
    "/api/v1/imports/{import_id:int}/files/{import_file_id:int}": BYTES,
    "/api/v1/viewports/{viewport_id:int}/keypoints": FIRST,
    "/api/v1/viewports/{viewport_id:int}/keypoints.csv": FIRST,
    "/api/v1/viewports/{viewport_id:int}/keypoints.geojson": FIRST,
    "/api/v1/imports/{import_id:int}/times-table": TABLE,
    "/api/v1/calibration-sets/{set_id}/poses/{pose_id}": JUDGED,
}
SWITCHES = ("/pause", "/resume", "/on", "/off")
# Nobody edits these, so they have no version: they are made, and go.
UNVERSIONED = (
    *("/tokens/", "/invitations/", "/sessions", "/identity", "/water-levels", "/images/"),
    *("/imports/", "/models/", "/runs/", "/decisions/", "/review-queues/", "/corrections"),
    *("/comments/", "/calibration-sets/", "/bookmark", "/ais/files/", "/ground-truth/files/"),
)


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # no SQL is asked here
def test_a_stale_edit_is_412_and_one_without_a_version_428(
    app: FastAPI, client: TestClient, database: Database
) -> None:
    """Edits demand `If-Match`; removals and switches heed it where it is sent."""
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        person = identity.make_user(session, "viewer")
    ids |= {"user_id": person.id, "token_id": 1, "session_id": 1, "invitation_id": 1}
    wrong = []
    for call in calls_of(app):
        if not call.is_rest:
            continue
        if call.method in {"PUT", "PATCH"} and call.path not in WITHOUT:
            missing = send(client, app, call, ids, version=None).status_code
            stale = send(client, app, call, ids, version=99).status_code
            if (missing, stale) != (428, 412):
                wrong.append((call.method, call.path, missing, stale))
        is_switch = call.method == "POST" and call.path.endswith(SWITCHES)
        if is_switch or (call.method == "DELETE" and not _is_unversioned(call.path)):
            stale = send(client, app, call, ids, version=99).status_code
            if stale != 412:
                wrong.append((call.method, call.path, stale))
    assert wrong == []


def _is_unversioned(path: str) -> bool:
    return any(part in path for part in UNVERSIONED)
