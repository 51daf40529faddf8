"""People are managed by administrators of all sites, and nobody promotes themselves."""

from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from app.auth.passwords import password_fits
from app.db import Database
from app.tables.identity import User
from tests.factories import identity
from tests.factories.sites import make_site

ClientOf = Callable[..., TestClient]
MakeUser = Callable[..., User]
ADA = {"email": " Ada@Harbour.example ", "password": "correct horse battery", "name": "Ada"}


def test_an_administrator_adds_a_person(client: TestClient, database: Database) -> None:
    """Roles on single sites and on all are stored; the password comes back nowhere."""
    with database.writing() as session:
        site = make_site(session)
    body = ADA | {"memberships": [{"role": "viewer"}, {"role": "operator", "site_id": site.id}]}
    made = client.post("/api/v1/users", json=body)
    assert made.status_code == 201
    assert made.json()["email"] == "ada@harbour.example"
    assert "password" not in made.text
    shown = client.get(made.headers["location"])
    assert shown.json() == made.json()
    assert shown.headers["etag"] == '"1"'
    assert made.json() in client.get("/api/v1/users").json()["items"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"email": "no address"}, "email"),
        ({"password": "short"}, "password"),
        ({"memberships": [{"role": "emperor"}]}, "memberships.0.role"),
        ({"memberships": [{"role": "viewer", "site_id": 99}]}, "memberships"),
        ({"memberships": [{"role": "viewer"}, {"role": "admin"}]}, "memberships"),
        ({"is_admin": True}, "is_admin"),
    ],
)
def test_bad_input_names_the_field(
    client: TestClient, change: dict[str, object], field: str
) -> None:
    """Each wrong field is named, and nobody is added."""
    answer = client.post("/api/v1/users", json=ADA | change)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == field
    assert len(client.get("/api/v1/users").json()["items"]) == 1


def test_an_address_is_used_once(client: TestClient) -> None:
    """The same address in other letters is the same person."""
    assert client.post("/api/v1/users", json=ADA).status_code == 201
    again = client.post("/api/v1/users", json=ADA | {"email": "ADA@harbour.example"})
    assert again.status_code == 409


def test_nobody_promotes_themselves(
    client_of: ClientOf, make_user: MakeUser, database: Database
) -> None:
    """Below an administrator of all sites, nobody reads or changes people, themselves included."""
    with database.writing() as session:
        site = make_site(session)
    for user in (
        make_user("viewer"),
        make_user("reviewer"),
        make_user("operator"),
        make_user("admin", site.id),
        make_user(None),
    ):
        caller = client_of(user)
        body = {"memberships": [{"role": "admin"}]}
        path = f"/api/v1/users/{user.id}"
        assert caller.patch(path, json=body, headers={"If-Match": '"1"'}).status_code == 403
        assert caller.get(path).status_code == 403
        assert caller.delete(path).status_code == 403
        assert caller.get("/api/v1/users").status_code == 403
        assert caller.post("/api/v1/users", json=ADA).status_code == 403


def test_an_edit_says_which_version_it_is_based_on(client: TestClient, make_user: MakeUser) -> None:
    """Without If-Match 428, with a stale one 412, and each change makes a new version."""
    path = f"/api/v1/users/{make_user('viewer').id}"
    assert client.patch(path, json={"name": "A"}).status_code == 428
    first = client.patch(path, json={"name": "A"}, headers={"If-Match": '"1"'})
    assert (first.status_code, first.headers["etag"]) == (200, '"2"')
    assert client.patch(path, json={"name": "B"}, headers={"If-Match": '"1"'}).status_code == 412
    roles = {"memberships": [{"role": "reviewer"}]}
    second = client.patch(path, json=roles, headers={"If-Match": '"2"'})
    assert second.json()["version"] == 3
    assert second.json()["name"] == "A"


def test_a_new_password_signs_the_browsers_out(
    client: TestClient,
    browser_of: Callable[[User], TestClient],
    make_user: MakeUser,
    database: Database,
) -> None:
    """A reset ends what was opened with the old password."""
    user = make_user("viewer")
    browser = browser_of(user)
    change = {"password": "another horse battery"}
    path = f"/api/v1/users/{user.id}"
    assert client.patch(path, json=change, headers={"If-Match": '"1"'}).status_code == 200
    assert browser.get("/account").status_code == 303
    with database.reading() as session:
        stored = session.get_one(User, user.id).password_hash
    assert stored.startswith("$argon2id$")
    assert password_fits("another horse battery", stored)
    assert not password_fits(identity.PASSWORD, stored)


def test_the_last_administrator_stays(client: TestClient, admin: User, make_user: MakeUser) -> None:
    """The last one can be neither removed nor demoted nor shut out; the last but one can."""
    path, match = f"/api/v1/users/{admin.id}", {"If-Match": '"1"'}
    make_user("admin", is_active=False)
    for change in ({"is_active": False}, {"memberships": [{"role": "operator"}]}):
        assert client.patch(path, json=change, headers=match).status_code == 409
    assert client.delete(path).status_code == 409
    make_user("admin")
    assert client.delete(path).status_code == 204
    assert client.get("/api/v1/me").status_code == 401


def test_unknown_people_are_not_found(client: TestClient) -> None:
    """An unknown id is 404 on every verb."""
    path, match = "/api/v1/users/999999", {"If-Match": '"1"'}
    assert client.get(path).status_code == 404
    assert client.patch(path, json={}, headers=match).status_code == 404
    assert client.delete(path).status_code == 404


def test_people_are_managed_on_the_page(
    browser_of: Callable[[User], TestClient], admin: User, database: Database
) -> None:
    """Adding, giving a role on a site, shutting out and removing, as an administrator clicks."""
    with database.writing() as session:
        site = make_site(session, "Elbe <b>quay</b>")
    browser = browser_of(admin)
    form = {"email": "ada@harbour.example", "password": "short", "role": "viewer", "site_id": ""}
    refused = browser.post("/admin/users", data=form)
    assert refused.status_code == 422
    assert 'value="ada@harbour.example"' in refused.text
    form["password"] = "correct horse battery"
    assert browser.post("/admin/users", data=form).headers["location"] == "/admin/users?done=added"
    shown = browser.get("/admin/users?done=added").text
    assert "viewer: all sites" in shown
    assert "The person is added" in shown
    with database.reading() as session:
        ada = session.query(User).filter_by(email="ada@harbour.example").one()
    role = {"role": "operator", "site_id": str(site.id)}
    assert browser.post(f"/admin/users/{ada.id}/role", data=role).status_code == 303
    assert "operator: Elbe &lt;b&gt;quay&lt;/b&gt;" in browser.get("/admin/users").text
    assert (
        browser.post(f"/admin/users/{ada.id}/active", data={"active": "false"}).status_code == 303
    )
    assert "Inactive" in browser.get("/admin/users").text
    assert browser.post(f"/admin/users/{ada.id}/remove").status_code == 303
    assert "ada@harbour.example" not in browser.get("/admin/users").text
    assert browser.post(f"/admin/users/{admin.id}/remove").status_code == 409
