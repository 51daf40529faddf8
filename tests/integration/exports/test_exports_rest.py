"""Exports over REST: asking, watching, downloading, and who may."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from httpx import Response
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.config import Settings
from app.db import Database
from app.errors import StorageFull
from app.exports import repository, service
from app.storage import Storage
from app.tables.exports import Export
from app.tables.identity import Membership, User
from app.tables.runs import Pose
from tests.factories.runs import Harbour, make_harbour, make_run
from tests.integration.exports.conftest import Make
from tests.worker_process import wait_until

EXPORTS = "/api/v1/exports"


@pytest.fixture
def run_id(database: Database, harbour: Harbour) -> int:
    """Give a run with three poses."""
    with database.writing() as session:
        return make_run(session, harbour, [2, 1]).id


def asked(client: TestClient, **body: object) -> int:
    """Ask for an export; returns its id."""
    answer = client.post(EXPORTS, json={"format": "ndjson"} | body)
    assert answer.status_code == 202, answer.text
    return int(answer.json()["id"])


def status(client: TestClient, export_id: int) -> str:
    """Return where an export stands."""
    return str(client.get(f"{EXPORTS}/{export_id}").json()["status"])


@pytest.mark.usefixtures("worker")
def test_an_export_is_asked_for_made_and_fetched(client: TestClient, run_id: int) -> None:
    """From 202 with the place to look, through a real worker, to a file that parses."""
    answer = client.post(EXPORTS, json={"format": "coco", "filters": {"run_id": run_id}})
    assert answer.status_code == 202
    assert answer.headers["retry-after"] == "1"
    place = answer.headers["location"]
    assert place == f"{EXPORTS}/{answer.json()['id']}"
    assert answer.json()["download_url"] is None
    wait_until(lambda: client.get(place).json()["status"] == "succeeded", what="the export")
    ready = client.get(place)
    assert "retry-after" not in ready.headers
    assert (ready.json()["poses"], ready.json()["anonymise"]) == (3, True)
    file = client.get(ready.json()["download_url"])
    assert file.headers["content-type"] == "application/json"
    assert file.headers["content-disposition"].startswith('attachment; filename="quaymark-export')
    assert len(file.content) == ready.json()["size_bytes"]
    assert len(json.loads(file.content)["annotations"]) == 3


def told(answer: Response) -> dict[str, str]:
    """Return an answer's headers but for what differs each time."""
    return {name: value for name, value in answer.headers.items() if name != "x-request-id"}


def test_a_file_is_fetched_in_parts_and_once(client: TestClient, run_id: int, make: Make) -> None:
    """Ranges give their bytes, known bytes are not sent again, impossible ranges are refused.

    HEAD tells all that GET tells, but the bytes.
    """
    export_id = asked(client, filters={"run_id": run_id})
    make(export_id)
    url = f"{EXPORTS}/{export_id}/download"
    whole = client.get(url)
    etag = whole.headers["etag"]
    assert etag == f'"{client.get(f"{EXPORTS}/{export_id}").json()["sha256"]}"'
    size = len(whole.content)
    for wanted, first, last in (
        ("bytes=0-9", 0, 9),
        ("bytes=10-", 10, size - 1),
        ("bytes=-5", size - 5, size - 1),
    ):
        part = client.get(url, headers={"Range": wanted})
        assert part.status_code == 206
        assert part.headers["content-range"] == f"bytes {first}-{last}/{size}"
        assert part.content == whole.content[first : last + 1]
        head = client.head(url, headers={"Range": wanted})
        assert (head.status_code, head.content, told(head)) == (206, b"", told(part))
    for path in (url, f"{EXPORTS}/{export_id}", "/exports", f"{EXPORTS}/0"):
        head, full = client.head(path), client.get(path)
        assert (head.status_code, head.content, told(head)) == (full.status_code, b"", told(full))
    known = client.get(url, headers={"If-None-Match": etag})
    assert (known.status_code, known.content) == (304, b"")
    beyond = client.get(url, headers={"Range": f"bytes={size}-"})
    assert (beyond.status_code, beyond.headers["content-range"]) == (416, f"bytes */{size}")
    parts = ",".join(f"{start}-{start}" for start in range(10_000))
    assert client.get(url, headers={"Range": f"bytes={parts}"}).status_code == 416
    changed = client.get(url, headers={"Range": "bytes=0-9", "If-Range": '"another"'})
    assert (changed.status_code, changed.content) == (200, whole.content)


def test_a_file_that_is_not_there_yet_is_a_conflict(client: TestClient, run_id: int) -> None:
    """Who comes too early is told where the export stands and when to come again."""
    export_id = asked(client, filters={"run_id": run_id})
    early = client.get(f"{EXPORTS}/{export_id}/download")
    assert early.status_code == 409
    assert "queued" in early.json()["detail"]
    assert client.get(f"{EXPORTS}/{export_id}").headers["retry-after"] == "1"


@pytest.mark.parametrize(
    ("body", "status_code", "field"),
    [
        ({"format": "xlsx"}, 422, "format"),
        ({}, 422, "format"),
        ({"filters": {"image.site.owner": 1}}, 422, "filters.image.site.owner"),
        ({"filters": {"mmsi__name": "ANNEGRET"}}, 422, "filters.mmsi__name"),
        ({"filters": {"mmsi": "ANNEGRET"}}, 422, "filters.mmsi"),
        ({"filters": {"range_min_m": "nan"}}, 422, "filters.range_min_m"),
        ({"filters": {"from": "2026-06-02", "to": "2026-06-01"}}, 422, "filters"),
        ({"split": {"by": "camera"}}, 422, "split.by"),
        ({"filters": {"grade": ["superb"]}}, 422, "filters.grade.0"),
        ({"filters": {"grade": ["good"] * 6}}, 422, "filters.grade"),
        ({"filters": {"run_id": "1 or 1=1"}}, 422, "filters.run_id"),
        ({"filters": {"run_id": 2**40}}, 422, "filters.run_id"),
        ({"filters": {"run_id": 999_999}}, 404, "filters.run_id"),
        ({"filters": {"site_id": 999_999}}, 404, "filters.site_id"),
        ({"filters": {"camera_id": 999_999}}, 404, "filters.camera_id"),
        ({"sort": "run.site.name"}, 422, "sort"),
        ({"anonymise": "perhaps"}, 422, "anonymise"),
    ],
)
def test_a_wrong_field_is_named_and_nothing_is_asked_for(
    client: TestClient, database: Database, body: dict[str, Any], status_code: int, field: str
) -> None:
    """Filters are those of a list; what leads to nothing is named, and no job is made."""
    answer = client.post(EXPORTS, json=({"format": "coco"} | body) if body else {})
    assert answer.status_code == status_code, answer.text
    assert [error["field"] for error in answer.json()["errors"]] == [field]
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Export)) == 0


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
@pytest.mark.usefixtures("worker")
def test_an_export_that_cannot_be_made_says_why(
    client: TestClient, database: Database, run_id: int
) -> None:
    """A pose that cannot be written fails the export with a reason; the next one goes well."""
    with database.writing() as session:
        session.execute(sa.update(Pose).values(rotvec_cam_from_vessel=[]))
    broken = asked(client, filters={"run_id": run_id})
    wait_until(lambda: status(client, broken) == "failed", what="the failure")
    shown = client.get(f"{EXPORTS}/{broken}").json()
    assert shown["error"]
    assert "\n" not in shown["error"]
    assert shown["finished_at"] is not None
    assert shown["download_url"] is None
    assert client.get(f"{EXPORTS}/{broken}/download").status_code == 409
    with database.writing() as session:
        session.execute(sa.update(Pose).values(rotvec_cam_from_vessel=[0.0, 0.0, 0.0]))
    mended = asked(client, filters={"run_id": run_id})
    wait_until(lambda: status(client, mended) == "succeeded", what="the next export")


def test_a_file_the_store_lost_is_not_there(
    client: TestClient, settings: Settings, run_id: int, make: Make
) -> None:
    """A file that vanished from the store is 404, not a broken download."""
    export_id = asked(client, filters={"run_id": run_id})
    make(export_id)
    sha256 = client.get(f"{EXPORTS}/{export_id}").json()["sha256"]
    path = Storage(settings.storage_url).local_path(sha256)
    assert path is not None
    path.unlink()
    assert client.get(f"{EXPORTS}/{export_id}/download").status_code == 404


def test_a_full_disk_is_named_and_the_next_export_goes_well(
    client: TestClient, run_id: int, make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where there is no room for the draft people read which folder it was, not an errno."""
    export_id = asked(client, filters={"run_id": run_id})
    with monkeypatch.context() as full:
        full.setattr(
            service.tempfile,
            "SpooledTemporaryFile",
            lambda _: Path("/dev/full").open("r+b", buffering=0),  # noqa: SIM115  closed by who asked
        )
        with pytest.raises(StorageFull, match="no room left in /"):
            make(export_id)
    make(export_id)
    assert status(client, export_id) == "succeeded"


def test_the_same_key_asks_once(client: TestClient, database: Database) -> None:
    """A request repeated after a lost answer is one export."""
    key = {"Idempotency-Key": "once"}
    first, second = (client.post(EXPORTS, json={"format": "coco"}, headers=key) for _ in range(2))
    assert (second.status_code, second.json()) == (202, first.json())
    assert second.headers["location"] == first.headers["location"]
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Export)) == 1


def test_exports_are_their_owners(
    client: TestClient,
    harbour: Harbour,
    run_id: int,
    make: Make,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Others neither list nor find a person's export; an administrator finds all."""
    ada = client_of(make_user("viewer", harbour.site.id))
    ben = client_of(make_user("operator", harbour.site.id))
    export_id = asked(ada, filters={"run_id": run_id})
    make(export_id)
    assert [each["id"] for each in ada.get(EXPORTS).json()["items"]] == [export_id]
    assert ben.get(EXPORTS).json()["items"] == []
    for path in (f"/{export_id}", f"/{export_id}/download", f"/{2**70}", "/0"):
        assert ben.get(EXPORTS + path).status_code == 404
    assert client.get(f"{EXPORTS}/{export_id}/download").status_code == 200
    assert [each["id"] for each in client.get(EXPORTS).json()["items"]] == [export_id]


def test_an_export_holds_the_sites_of_its_owner(
    database: Database,
    harbour: Harbour,
    run_id: int,
    make: Make,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Without filters it is all one may read; another site's run, camera or site is not found."""
    with database.writing() as session:
        other = make_harbour(session)
        theirs = make_run(session, other, [1])
    neighbour = client_of(make_user("viewer", harbour.site.id))
    export_id = asked(neighbour)
    make(export_id)
    lines = neighbour.get(f"{EXPORTS}/{export_id}/download").text.splitlines()
    assert {json.loads(line).get("run_id", run_id) for line in lines} == {run_id}
    for field, value in (
        ("run_id", theirs.id),
        ("site_id", other.site.id),
        ("camera_id", other.camera.id),
        ("image_id", other.images[0].id),
    ):
        foreign = neighbour.post(EXPORTS, json={"format": "coco", "filters": {field: value}})
        unknown = neighbour.post(EXPORTS, json={"format": "coco", "filters": {field: 999_999}})
        assert (foreign.status_code, foreign.json()) == (404, unknown.json())


def test_identities_need_the_right_to_review_them(
    database: Database,
    harbour: Harbour,
    run_id: int,
    make: Make,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Names are given only of sites where one reviews, also when one may read more."""
    with database.writing() as session:
        other = make_harbour(session)
        theirs = make_run(session, other, [1])
    mixed = make_user("reviewer", harbour.site.id)
    with database.writing() as session:
        session.add(Membership(user_id=mixed.id, site_id=other.site.id, role="viewer"))
    client = client_of(mixed)
    export_id = asked(client, anonymise=False)
    make(export_id)
    lines = client.get(f"{EXPORTS}/{export_id}/download").text.splitlines()
    assert {json.loads(line).get("run_id", run_id) for line in lines} == {run_id}
    named = {"format": "coco", "anonymise": False, "filters": {"run_id": theirs.id}}
    assert client.post(EXPORTS, json=named).status_code == 403
    assert client.post(EXPORTS, json=named | {"anonymise": True}).status_code == 202
    for who in (
        client_of(make_user("viewer", harbour.site.id)),
        client_of(make_user("admin"), Scope.EXPORT),
    ):
        refused = who.post(EXPORTS, json={"format": "coco", "anonymise": False})
        assert refused.status_code == 403
        assert "identities" in refused.json()["detail"]


def test_a_file_is_fetched_with_the_rights_of_today(
    database: Database,
    harbour: Harbour,
    run_id: int,
    make: Make,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
) -> None:
    """Who lost a site no longer fetches a file that was selected from it."""
    user = make_user("reviewer", harbour.site.id)
    with database.writing() as session:
        other = make_harbour(session)
        session.add(Membership(user_id=user.id, site_id=other.site.id, role="viewer"))
    client = client_of(user)
    exports = [
        asked(client, filters={"run_id": run_id}, anonymise=value) for value in (True, False)
    ]
    for export_id in exports:
        make(export_id)
    with database.writing() as session:
        session.execute(
            sa.update(Membership)
            .where(Membership.user_id == user.id, Membership.site_id == harbour.site.id)
            .values(role="viewer")
        )
    hidden, named = (client.get(f"{EXPORTS}/{each}/download").status_code for each in exports)
    assert (hidden, named) == (200, 403)
    with database.writing() as session:
        session.execute(
            sa.delete(Membership).where(
                Membership.user_id == user.id, Membership.site_id == harbour.site.id
            )
        )
    assert client.get(f"{EXPORTS}/{exports[0]}/download").status_code == 403


def test_a_cancelled_export_stops_and_stays_cancelled(
    client: TestClient,
    run_id: int,
    make: Make,
    database: Database,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is under way tells how far it is, ends at a word, and is not finished afterwards."""
    monkeypatch.setattr(service, "TOLD_EVERY_S", 0.0)
    first, second = (asked(client, filters={"run_id": run_id}) for _ in range(2))
    with database.writing() as session:
        service.begin(session, first)
        repository.advance(session, first, 1, 4)
    under_way = client.get(f"{EXPORTS}/{first}").json()
    assert (under_way["status"], under_way["poses"], under_way["poses_total"]) == ("running", 1, 4)
    assert under_way["remaining_s"] == pytest.approx(3 / under_way["poses_per_s"])
    cancelled = client.post(f"{EXPORTS}/{first}/cancel")
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    with pytest.raises(service.NoLongerWanted):
        make(first)
    make(second)
    assert client.post(f"{EXPORTS}/{second}/cancel").status_code == 409
    assert client.get(f"{EXPORTS}/{first}").json()["status"] == "cancelled"


def test_a_manifest_and_a_datasheet_tell_what_is_in_the_file(
    client: TestClient, run_id: int, make: Make
) -> None:
    """Filters, counts, runs, detector, registration and the paper's figures stand in both."""
    export_id = asked(client, filters={"run_id": run_id, "grade": ["ungraded"]})
    assert client.get(f"{EXPORTS}/{export_id}/manifest").status_code == 409
    make(export_id)
    manifest = client.get(f"{EXPORTS}/{export_id}/manifest").json()
    assert manifest["filters"] == {"grade": ["ungraded"], "run_id": run_id}
    assert manifest["counts"]["poses"] == manifest["counts"]["grades"]["ungraded"] == 3
    assert manifest["runs"][0]["detector_sha256"]
    assert manifest["registrations"][0]["method"] == "given"
    assert manifest["sha256"] == client.get(f"{EXPORTS}/{export_id}").json()["sha256"]
    sheet = client.get(f"{EXPORTS}/{export_id}/datasheet")
    assert sheet.headers["content-type"].startswith("text/markdown")
    assert "| paper |  | pnp | 12.22 | 0.48 | 0.64 |" in sheet.text
