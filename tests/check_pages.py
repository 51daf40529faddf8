"""HTML check of every page: as an empty installation has it, as a full one, and after errors.

The routes are those of the application, so a page that is added is checked by itself; a place in a
path that nothing here fills fails the check. Forms are sent empty, and what they answer is checked
too. The pages go through html-validate in one call.

Run as a script: `python -m tests.check_pages`; exit 1 names each page and what is wrong with it.
"""

import json
import logging
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from datetime import timedelta
from pathlib import Path

import sqlalchemy as sa
from fastapi import FastAPI

from app.ais import uploads
from app.ais.service import import_ais_file
from app.auth.declared import routes_of
from app.config import Settings
from app.db import Database
from app.domain.grading import GUIDELINE_VERSION
from app.logs import configure_logs
from app.main import API, create_app
from app.registration import service as registration
from app.registration.schemas import KeypointsIn, RegistrationIn
from app.schema import upgrade
from app.storage import Storage
from app.tables.ais_uploads import AisUpload
from app.tables.identity import ApiToken, Role
from app.tables.registration import RegistrationMethod
from app.tables.reviews import Grade, Review
from tests.factories import ais
from tests.factories.identity import make_token, make_user
from tests.factories.imagery import NOON, make_image
from tests.factories.scene import make_scene
from tests.factories.world import make_world

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of the test client's own dependencies
    from starlette.testclient import TestClient

ROOT = Path(__file__).resolve().parents[1]
PLACE = re.compile(r"\{(\w+)(?::\w+)?\}")
NO_PAGES = (
    "/static",
    "/admin/audit/csv",
    "/healthz",
    "/readyz",
    "/metrics",
    "/sign-in/provider",  # leads to an identity provider and back
    f"{API}/",
)
# Pages that ask about something named in their query.
QUERIES = {
    "/deletions/ask": "?entity=feed&id={feed_id}",
    "/exports/preview": "?run_id={run_id}&format=csv",
}
DOCS = f"{API}/docs"
SIGNED_OUT = "/sign-in"
Pages = dict[str, str]


def page_routes(app: FastAPI, method: str) -> Iterator[str]:
    """Give the paths of the routes that are for people, not for scripts, with their queries."""
    for route in routes_of(app):
        path = route.path or ""
        if method in (route.methods or ()) and (path == DOCS or not path.startswith(NO_PAGES)):
            yield path + QUERIES.get(path, "")


def filled(path: str, ids: Mapping[str, int]) -> str:
    """Return a path with ids in its places. Raises SystemExit for a place without an id."""
    missing = {name for name in PLACE.findall(path) if name not in ids}
    if missing:
        sys.exit(f"{path}: nothing fills {missing}; teach tests/factories/world.py what it is")
    return PLACE.sub(lambda match: str(ids[match[1]]), path)


def fill(database: Database, storage: Storage) -> dict[str, int]:
    """Store some of everything; return ids by their names in paths."""
    with database.writing() as session:
        somebody = make_user(session, Role.REVIEWER)
        make_token(session, somebody)
        ids = make_world(session, "Elbe", ais.MMSI) | {"user_id": somebody.id}
        ids["token_id"] = session.scalars(sa.select(sa.func.max(ApiToken.id))).one()
        make_world(session, "Weser", 211_000_002)
        session.add(
            Review(
                pose_id=ids["pose_id"],
                grade=Grade.OK,
                reasons=["heading"],
                guideline_version=GUIDELINE_VERSION,
            )
        )
        scene = make_scene(session)
        keypoints = KeypointsIn.model_validate({"keypoints": scene.keypoints})
        registration.replace_keypoints(session, scene.viewport, keypoints)
        for hours in range(30):
            moment = NOON + timedelta(hours=hours)
            make_image(session, scene.viewport.camera, scene.viewport, moment)
    for method in (RegistrationMethod.PNP, RegistrationMethod.HOMOGRAPHY_PCA):
        registration.register(database, scene.viewport.id, RegistrationIn(method=method))
    with tempfile.TemporaryFile() as recording:
        recording.write(ais.table(50))
        imported = import_ais_file(
            database, storage, recording, site_id=ids["site_id"], file_name="heard.csv"
        )
    return ids | {
        "upload_id": upload_of(database, storage, ids["site_id"]),
        "camera_id": scene.viewport.camera_id,
        "viewport_id": scene.viewport.id,
        "file_id": imported.file.id,
    }


def upload_of(database: Database, storage: Storage, site_id: int) -> int:
    """Send a recording that waits to be looked at; return its id."""
    with tempfile.TemporaryFile() as recording:
        recording.write(ais.table(60))
        upload = uploads.stage(
            database,
            storage,
            Settings(),
            recording,
            file_name="waiting.csv",
            site_id=site_id,
            user_id=None,
        )
    assert isinstance(upload, AisUpload)
    return upload.id


def visit(client: TestClient, app: FastAPI, state: str, ids: Mapping[str, int] | None) -> Pages:
    """Fetch every page; without ids only those whose paths have no places."""
    pages = {}
    for route in page_routes(app, "GET"):
        if ids is None and PLACE.search(route):
            continue
        path = filled(route, ids or {})
        answer = client.get(path)
        if answer.is_redirect:
            continue
        if answer.status_code != 200:
            sys.exit(f"{path} ({state}): answered {answer.status_code}")
        pages[f"{path} ({state})"] = answer.text
    return pages


def send_empty_forms(client: TestClient, app: FastAPI, ids: Mapping[str, int]) -> Pages:
    """Send every form without a field; return the pages that say what is missing."""
    pages = {}
    for route in page_routes(app, "POST"):
        path = filled(route, ids)
        answer = client.post(path)
        if answer.status_code >= 500:
            sys.exit(f"{path} (empty form): answered {answer.status_code}")
        if answer.headers.get("content-type", "").startswith("text/html"):
            pages[f"{path} (empty form)"] = answer.text
    return pages


def collect(settings: Settings) -> Pages:
    """Start the application and return all its pages by their paths and states."""
    database = Database(settings.database_url)
    upgrade(database)
    with database.writing() as session:
        token = make_token(session, make_user(session, email="admin@harbour.example"))
    app = create_app(settings)
    headers = {"Accept": "text/html"}
    with TestClient(app, follow_redirects=False, headers=headers) as anonymous:
        person = TestClient(
            app,
            follow_redirects=False,
            headers=headers | {"Authorization": f"Bearer {token}"},
        )
        pages = {f"{SIGNED_OUT} (signed out)": anonymous.get(SIGNED_OUT).text}
        pages |= visit(person, app, "empty", None)
        ids = fill(database, Storage(settings.storage_url))
        pages |= visit(person, app, "full", ids)
        pages["/nowhere (not found)"] = person.get("/nowhere").text
        pages |= send_empty_forms(person, app, ids)
    database.dispose()
    return pages


def complaints(pages: Pages, folder: Path) -> list[str]:
    """Return what html-validate says about the pages, a line for each finding."""
    names = {}
    for number, (name, html) in enumerate(pages.items()):
        file = folder / f"{number:03d}.html"
        file.write_text(html)
        names[str(file)] = name
    done = subprocess.run(
        ["npm", "run", "--silent", "html-validate", "--", "--formatter=json", *names],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if not done.stdout.startswith("["):
        sys.exit(f"html-validate failed: {done.stderr or done.stdout}")
    return [
        f"{names[result['filePath']]}: {finding['line']}:{finding['column']} "
        f"{finding['message']} ({finding['ruleId']})"
        for result in json.loads(done.stdout)
        for finding in result["messages"]
    ]


def main() -> int:
    """Print what is wrong; return the exit code."""
    configure_logs(logging.ERROR)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pages = collect(
            Settings(
                data_dir=folder / "data",
                database_url="",
                storage_url="",
                public_url="http://testserver",
                smtp_host="mail.example",
                smtp_sender="quaymark@harbour.example",
            )
        )
        found = complaints(pages, folder)
    print(*found, sep="\n", end="\n" if found else "")  # noqa: T201  a script
    print(f"{len(pages)} pages, {len(found)} findings")  # noqa: T201  as above
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
