"""A route without a declared permission must not get as far as answering."""

from pathlib import Path
from typing import Annotated

import pytest
from fastapi import APIRouter, Depends, FastAPI
from starlette.applications import Starlette
from starlette.routing import Mount, Route

from app.auth.access import Access, Scope, allowed, public
from app.auth.declared import (
    UndeclaredRouteError,
    declare_public,
    permission_of,
    refuse_undeclared_routes,
    routes_of,
)
from app.auth.idempotency import IdempotentRoute
from app.config import Settings
from app.main import create_app

NO_STORED_ANSWER = {
    "/api/v1/tokens": "its answer holds a secret",
    "/api/v1/invitations": "its answer holds the link's secret",
    "/api/v1/users/{user_id}/password-reset": "its answer holds the link's secret",
    "/api/v1/sites/{site_id:int}/webhooks": "its answer holds the webhook's secret",
    "/api/v1/webhooks/{webhook_id:int}/rotate": "its answer holds the webhook's secret",
    "/api/v1/ais/files": "an upload: the same bytes are the same file",
    "/api/v1/ais/previews": "it looks at a recording and stores nothing",
    "/api/v1/detections": "an upload: the same bytes are the same detections",
    "/api/v1/models": "an upload: the same bytes are the same model",
}


def _answer() -> None:
    """Answer nothing."""


def test_an_undeclared_route_stops_the_start() -> None:
    """A forgotten permission is an error of the start and names the path."""
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.add_api_route("/forgotten", _answer)
    with pytest.raises(UndeclaredRouteError, match="/forgotten"):
        refuse_undeclared_routes(app)


def test_an_undeclared_route_is_found_however_deep_it_is_included() -> None:
    """Routers within routers are walked."""
    inner, outer = APIRouter(), APIRouter()
    inner.add_api_route("/deep", _answer)
    outer.include_router(inner, prefix="/inner")
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.include_router(outer, prefix="/outer")
    with pytest.raises(UndeclaredRouteError, match="/outer/inner/deep"):
        refuse_undeclared_routes(app)


def test_a_mounted_application_must_be_declared() -> None:
    """A mount hides routes from the framework, and none from the walk."""
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.router.routes.append(Mount("/mounted", Starlette(routes=[Route("/x", lambda _: None)])))
    with pytest.raises(UndeclaredRouteError):
        refuse_undeclared_routes(app)


def test_declared_routes_start() -> None:
    """Each way to declare is recognised: a scope, everybody, and a mark on what is mounted."""

    def guarded(access: Annotated[Access, allowed(Scope.READ)]) -> None:
        """Use the access."""
        assert access

    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.add_api_route("/guarded", guarded)
    app.add_api_route("/open", _answer, dependencies=[Depends(public)])
    app.mount("/files", declare_public(Starlette()))
    refuse_undeclared_routes(app)
    permissions = [permission_of(route) for route in routes_of(app)]
    assert [part.scope if part else None for part in permissions] == [Scope.READ, None, None]


def test_writing_routes_of_rest_can_be_repeated(tmp_path: Path) -> None:
    """Every POST below /api/v1 takes an Idempotency-Key, or says here why not."""
    app = create_app(Settings(data_dir=tmp_path))
    without = {
        route.path
        for route in routes_of(app)
        if (route.path or "").startswith("/api/v1/")
        and "POST" in (route.methods or ())
        and not isinstance(route.original_route, IdempotentRoute)
    }
    assert without <= set(NO_STORED_ANSWER)
