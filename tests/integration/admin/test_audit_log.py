"""The audit log: one line for each change, in its transaction, for those it concerns."""

from collections.abc import Callable
from datetime import UTC, datetime

from starlette.testclient import TestClient

from app.auth import audit
from app.db import Database
from app.tables.identity import AuditEntry, User
from tests.factories.sites import make_site

ADA = {"email": "ada@harbour.example", "password": "correct horse battery"}


def test_a_change_leaves_a_line_without_secrets(client: TestClient, admin: User) -> None:
    """Who did what to whom is readable; passwords are not."""
    made = client.post("/api/v1/users", json=ADA).json()["id"]
    change = {"password": "another horse battery", "name": "Ada"}
    client.patch(f"/api/v1/users/{made}", json=change, headers={"If-Match": '"1"'})
    answer = client.get("/api/v1/audit-log")
    newest, before = answer.json()["items"][:2]
    assert (newest["action"], newest["entity"], newest["entity_id"]) == ("change", "user", made)
    assert newest["details"] == {"name": "Ada", "password": "changed"}
    assert newest["user_id"] == admin.id
    assert newest["at"].endswith("Z")
    assert before["action"] == "create"
    assert "horse" not in answer.text


def test_a_change_that_failed_leaves_none(client: TestClient) -> None:
    """The line and the change are one transaction."""
    client.post("/api/v1/users", json=ADA)
    client.post("/api/v1/users", json=ADA)
    lines = client.get("/api/v1/audit-log?entity=user").json()["items"]
    assert [line["action"] for line in lines] == ["create"]


def test_the_log_comes_in_pages_newest_first(client: TestClient, database: Database) -> None:
    """The cursor leads through all lines once."""
    with database.writing() as session:
        for number in range(5):
            audit.record(session, None, "create", "site", number)
    seen: list[int] = []
    cursor = ""
    while True:
        answer = client.get(f"/api/v1/audit-log?entity=site&limit=2{cursor}").json()
        seen += [line["entity_id"] for line in answer["items"]]
        if answer["next_cursor"] is None:
            break
        cursor = f"&cursor={answer['next_cursor']}"
    assert seen == [4, 3, 2, 1, 0]


def test_a_sites_administrator_reads_that_sites_lines(
    client_of: Callable[..., TestClient],
    browser_of: Callable[[User], TestClient],
    make_user: Callable[..., User],
    database: Database,
) -> None:
    """Other sites' changes, and those of the installation, stay out of sight."""
    with database.writing() as session:
        mine, other = make_site(session), make_site(session)
        for site_id in (mine.id, other.id, None):
            audit.record(session, None, "touch", "camera", site_id, site_id=site_id)
    user = make_user("admin", mine.id)
    items = client_of(user).get("/api/v1/audit-log").json()["items"]
    assert [line["site_id"] for line in items] == [mine.id]
    page = browser_of(user).get("/admin/audit").text
    assert page.count("<td>touch</td>") == 1


def test_the_log_is_for_administrators(
    client_of: Callable[..., TestClient], make_user: Callable[..., User]
) -> None:
    """An operator does not read it."""
    assert client_of(make_user("operator")).get("/api/v1/audit-log").status_code == 403


def test_details_are_text_on_the_page(
    browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """Script in a name is shown, not run."""
    with database.writing() as session:
        audit.record(session, None, "create", "site", 1, name="<script>alert(1)</script>")
    page = browser_of(admin).get("/admin/audit").text
    assert "<script>alert" not in page
    assert "alert(1)" in page


def test_the_log_is_searched_by_its_address_and_taken_along(
    browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """Who, what and when narrow the page and the file alike; formulas stay text."""
    with database.writing() as session:
        for action, day in (("create", 1), ("remove", 2)):
            session.add(
                AuditEntry(
                    user_id=admin.id,
                    action=action,
                    entity="=site",
                    details={},
                    at=datetime(2026, 5, day, tzinfo=UTC),
                )
            )
    browser = browser_of(admin)
    query = f"who={admin.email}&action=create&since=2026-05-01&until=2026-05-02"
    shown = browser.get(f"/admin/audit?{query}").text
    assert shown.count("=site") == 1
    taken = browser.get(f"/admin/audit/csv?{query}")
    assert taken.headers["content-type"].startswith("text/csv")
    line = taken.text.splitlines()[1]
    assert line.startswith(f"2026-05-01T00:00:00+00:00,{admin.email},create,'=site")
    assert browser.get("/admin/audit?who=nobody@example.org").text.count("=site") == 0
    assert browser.get("/admin/audit?since=2026-13-01").status_code == 422
