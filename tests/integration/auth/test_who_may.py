"""Every route there is, called by those who may not: whatever is added is covered by itself.

The bodies of requests are made from the OpenAPI document, the ids in paths, queries and bodies are
those of a site the caller has no role on.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import httpx2
import pytest
import structlog
from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.testclient import TestClient

from app.auth.access import Scope
from app.auth.declared import permission_of, routes_of
from app.db import Database
from app.openapi_examples import example_of, resolved
from app.tables.identity import User
from tests.factories import identity
from tests.factories.sites import make_site
from tests.factories.world import make_world

MARKER = "Secretharbour"
MMSI = 211_000_001
ONE_PIXEL = b"\x89PNG\r\n\x1a\n"
PLACE = re.compile(r"\{(\w+)(?::\w+)?\}")
# Not of any site: people belong to the installation, and so do detectors.
OF_THE_INSTALLATION = {
    "job_id": {403},
    "invitation_id": {403},
    "user_id": {403, 404},
    "model_id": {200, 403, 404, 409},
}


@dataclass(frozen=True)
class Call:
    """One method of one route that is not public."""

    method: str
    path: str
    scope: Scope | None
    route: APIRoute

    @property
    def is_rest(self) -> bool:
        """Whether it is for scripts."""
        return self.path.startswith("/api/")


def calls_of(app: FastAPI) -> Iterator[Call]:
    """Give all calls that need somebody to be signed in."""
    for route in routes_of(app):
        if route.path is None or route.path == app.openapi_url:
            continue
        permission = permission_of(route)
        if permission is not None and isinstance(route.original_route, APIRoute):
            for method in sorted(route.methods or ()):
                yield Call(method, route.path, permission.scope, route.original_route)


def filled(path: str, ids: dict[str, int]) -> str:
    """Return a route's path with ids in its places; a new sort of id must be taught to `world`."""
    return PLACE.sub(lambda match: str(ids[match[1]]), path)


def send(
    client: TestClient,
    app: FastAPI,
    call: Call,
    ids: dict[str, int],
    *,
    version: int | None = 1,
) -> httpx2.Response:
    """Send a request as the OpenAPI document describes it, with the given ids wherever they go."""
    headers = {} if version is None else {"If-Match": f'"{version}"'}
    arguments: dict[str, Any] = {"headers": headers}
    operation = _operation(app, call)
    query = {
        part["name"]: ids[part["name"]]
        for part in operation.get("parameters", [])
        if part["in"] == "query" and part["name"] in ids
    }
    content = operation.get("requestBody", {}).get("content", {})
    for media_type, media in content.items():
        schema = resolved(app.openapi(), media["schema"])
        example = with_ids(example_of(app.openapi(), schema), ids)
        if media_type == "application/json":
            arguments["json"] = {} if call.method == "PATCH" else example
        elif media_type == "multipart/form-data":
            arguments |= _multipart(app, schema, example)
    if not call.is_rest:
        arguments["data"] = {**ids, "name": "x", "role": "viewer", "active": "true"}
    return client.request(call.method, filled(call.path, ids), params=query, **arguments)


def _operation(app: FastAPI, call: Call) -> dict[str, Any]:
    path = PLACE.sub(lambda match: f"{{{match[1]}}}", call.path)
    operation: dict[str, Any] = app.openapi()["paths"].get(path, {}).get(call.method.lower(), {})
    return operation


def _multipart(app: FastAPI, schema: Any, example: Any) -> dict[str, Any]:
    files = {
        name
        for name, field in schema["properties"].items()
        if "contentMediaType" in resolved(app.openapi(), field).get("items", field)
    }
    return {
        "files": dict.fromkeys(files & set(schema.get("required", ())), ("x.png", ONE_PIXEL)),
        "data": {
            name: value
            for name, value in example.items()
            if name not in files and value is not None and name in schema.get("required", ())
        },
    }


def with_ids(value: Any, ids: dict[str, int]) -> Any:
    """Return an example with the ids put where their names stand."""
    if isinstance(value, dict):
        return {key: ids[key] if key in ids else with_ids(part, ids) for key, part in value.items()}
    return [with_ids(part, ids) for part in value] if isinstance(value, list) else value


@pytest.fixture
def foreign(database: Database) -> dict[str, int]:
    """Give ids of one of everything on a site where the caller has no role."""
    with database.writing() as session:
        ids = make_world(session, MARKER, MMSI)
        stranger = identity.make_user(session, "viewer", ids["site_id"])
        identity.make_token(session, stranger)
        ids |= {"user_id": stranger.id, "token_id": 1, "session_id": 1, "invitation_id": 1}
        return ids


@pytest.fixture
def neighbour(database: Database, make_user: Callable[..., User]) -> User:
    """Give the administrator of another site."""
    with database.writing() as session:
        site = make_site(session, "Next door")
    return make_user("admin", site.id)


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # it walks every route
def test_nobody_gets_nothing(
    app: FastAPI,
    anonymous: TestClient,
    anonymous_browser: TestClient,
    foreign: dict[str, int],
) -> None:
    """Without signing in every route that is not public is 401, a page leads to the sign-in."""
    wrong = []
    for call in calls_of(app):
        answer = send(anonymous, app, call, foreign)
        if answer.status_code != 401 or "www-authenticate" not in answer.headers:
            wrong.append((call.method, call.path, answer.status_code))
        if not call.is_rest:
            shown = send(anonymous_browser, app, call, foreign)
            if (shown.status_code, shown.headers["location"][:8]) != (303, "/sign-in"):
                wrong.append((call.method, call.path, shown.status_code))
    assert wrong == []


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # it walks every route
def test_a_scope_that_is_lacking_is_refused(
    app: FastAPI,
    client_of: Callable[..., TestClient],
    make_user: Callable[..., User],
    foreign: dict[str, int],
) -> None:
    """With every scope but the one a route demands, the route is 403, also for administrators."""
    admin = make_user("admin")
    clients = {scope: client_of(admin, *(set(Scope) - {scope})) for scope in Scope}
    wrong = [
        (call.method, call.path, status)
        for call in calls_of(app)
        if call.scope is not None
        and (status := send(clients[call.scope], app, call, foreign).status_code) != 403
    ]
    assert wrong == []


def test_a_foreign_id_is_not_found_on_any_verb(
    app: FastAPI,
    client_of: Callable[..., TestClient],
    neighbour: User,
    foreign: dict[str, int],
) -> None:
    """Another site's administrator gets 404 for every id in a path, with the one answer."""
    client = client_of(neighbour)
    wrong = []
    for call in calls_of(app):
        places = PLACE.findall(call.path)
        if not places:
            continue
        expected = next((OF_THE_INSTALLATION[p] for p in places if p in OF_THE_INSTALLATION), {404})
        answer = send(client, app, call, foreign)
        if answer.status_code not in expected:
            wrong.append((call.method, call.path, answer.status_code, answer.text[:200]))
        elif answer.status_code == 404 and call.is_rest:
            unknown = send(client, app, call, dict.fromkeys(foreign, 999_999))
            if unknown.json() != answer.json():
                wrong.append((call.method, call.path, "tells unknown from foreign"))
    assert wrong == []


def test_a_foreign_id_in_a_body_or_a_filter_shows_and_does_nothing(
    app: FastAPI,
    client_of: Callable[..., TestClient],
    browser_of: Callable[[User], TestClient],
    neighbour: User,
    foreign: dict[str, int],
) -> None:
    """Lists, forms and creations reveal no name of the other site and create nothing on it."""
    client, browser = client_of(neighbour), browser_of(neighbour)
    wrong = []
    for call in calls_of(app):
        if PLACE.search(call.path):
            continue
        for caller in (client, browser):
            answer = send(caller, app, call, foreign)
            if answer.status_code >= 500 or MARKER in answer.text or str(MMSI) in answer.text:
                wrong.append((call.method, call.path, answer.status_code, answer.text[:300]))
        needs_foreign = call.method == "POST" and set(foreign) & set(_body_fields(app, call))
        if needs_foreign and call.is_rest and answer.status_code < 400:
            wrong.append((call.method, call.path, answer.status_code, answer.text[:300]))
    assert wrong == []


def _body_fields(app: FastAPI, call: Call) -> set[str]:
    content = _operation(app, call).get("requestBody", {}).get("content", {})
    return {
        name
        for media in content.values()
        for name in resolved(app.openapi(), media["schema"]).get("properties", {})
    }


def test_a_foreign_id_is_logged(
    client_of: Callable[..., TestClient], neighbour: User, foreign: dict[str, int]
) -> None:
    """Whoever tries foreign ids leaves a trace that names them."""
    client = client_of(neighbour)
    with structlog.testing.capture_logs() as lines:
        assert client.get(f"/api/v1/sites/{foreign['site_id']}").status_code == 404
    logged = [line for line in lines if line["event"] == "foreign_id"]
    assert logged[0]["user_id"] == neighbour.id
    assert logged[0]["site_id"] == foreign["site_id"]
