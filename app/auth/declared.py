"""No route without a declared permission: an application that has one does not start.

Forgetting a check is the commonest hole in a web application, and the one that no test of the
check finds. So the absence is what is looked for: every route, however deep it is mounted, must
depend on `allowed(...)` or on `public`. What is no route of the framework (a mounted folder, the
OpenAPI document) carries its declaration as a mark.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from fastapi import FastAPI
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, RouteContext, iter_route_contexts
from starlette.routing import BaseRoute, Mount

from app.auth.access import Allowed, public

_MARK = "__quaymark_public__"
Target = TypeVar("Target", bound=Callable[..., object])


class UndeclaredRouteError(RuntimeError):
    """A route says neither whom it allows nor that it is public."""


def declare_public(target: Target) -> Target:
    """Mark a mounted application or a plain endpoint as meant for everybody."""
    setattr(target, _MARK, True)
    return target


def routes_of(app: FastAPI) -> Iterator[RouteContext]:
    """Give every route of an application with its full path; mounts are opened, or end the walk."""
    yield from _walk(app.routes)


def _walk(routes: Sequence[BaseRoute]) -> Iterator[RouteContext]:
    for route in iter_route_contexts(routes):
        inner = route.original_route
        if isinstance(inner, Mount) and inner.routes and not hasattr(inner.app, _MARK):
            yield from _walk(inner.routes)
        else:
            yield route


def permission_of(route: RouteContext) -> Allowed | None:
    """Return what a route demands; None for a public one. Raises UndeclaredRouteError."""
    inner = route.original_route
    if isinstance(inner, APIRoute):
        calls = list(_calls(route.dependant))
        for call in calls:
            if isinstance(call, Allowed):
                return call
        if public in calls:
            return None
    elif hasattr(getattr(inner, "app", None), _MARK) or hasattr(route.endpoint, _MARK):
        return None
    raise UndeclaredRouteError(
        f"{route.path} declares no permission: give it `access: Annotated[Access, "
        "allowed(Scope.X)]`, or `Depends(public)` if it is meant for everybody",
    )


def _calls(dependant: Dependant) -> Iterator[object]:
    for part in dependant.dependencies:
        yield part.call
        yield from _calls(part)


def refuse_undeclared_routes(app: FastAPI) -> None:
    """Raise UndeclaredRouteError for the first route without a permission."""
    for route in routes_of(app):
        if route.path != app.openapi_url:
            permission_of(route)
