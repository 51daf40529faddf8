"""What a caller may do: roles become scopes, a route demands a scope, a handler checks the site.

Three questions, kept apart. *Who is it?* is answered once for each request, before its body is
read (`app.auth.authentication`). *May they do this sort of thing at all?* is declared by the route
with `allowed(Scope.X)`; a route that declares nothing stops the application from starting. *May
they do it here?* is asked by the handler, which alone knows the site: `access.require(scope, site)`
or, for lists, `access.site_ids(scope)`. Somebody who may not even read a site is told that there is
no such thing, so that ids give nothing away.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

import structlog
from fastapi import Request, Security
from fastapi.openapi.models import HTTPBearer
from fastapi.params import Depends as Dependency
from fastapi.security.base import SecurityBase

from app.errors import Forbidden, NotFound, Unauthenticated
from app.tables.identity import Role

_log = structlog.get_logger("quaymark.access")


class Scope(StrEnum):
    """A sort of action; tokens carry scopes, roles stand for sets of them."""

    READ = "read"
    REVIEW = "review"
    REGISTER = "register"
    INGEST = "ingest"
    EXPORT = "export"
    ADMIN = "admin"


_VIEWER = frozenset({Scope.READ, Scope.EXPORT})
_REVIEWER = _VIEWER | {Scope.REVIEW}
_OPERATOR = _REVIEWER | {Scope.REGISTER, Scope.INGEST}
ROLE_SCOPES: Mapping[Role, frozenset[Scope]] = MappingProxyType(
    {
        Role.VIEWER: _VIEWER,
        Role.REVIEWER: _REVIEWER,
        Role.OPERATOR: _OPERATOR,
        Role.ADMIN: _OPERATOR | {Scope.ADMIN},
    },
)


@dataclass(frozen=True, slots=True)
class Access:
    """A signed-in person, or a token that acts for one within its own scopes."""

    user_id: int
    email: str
    name: str
    roles: Mapping[int | None, Role]
    """Role by site id; the key None holds the role on all sites."""
    token_scopes: frozenset[Scope] | None = None
    """The scopes of the token in use; None for a person at a browser."""
    session_id: int | None = None
    """The login session in use, for signing out; None for a token."""
    token_id: int | None = None
    """The token in use; None for a person at a browser."""
    camera_id: int | None = None
    """The camera whose photographs the token in use drops, and does nothing else; None for all."""

    @property
    def is_admin(self) -> bool:
        """Whether this caller administers the whole installation."""
        return self.may(Scope.ADMIN, None)

    def may_anywhere(self, scope: Scope) -> bool:
        """Whether there is any site, or all of them, where the scope is granted."""
        return self._token_allows(scope) and any(
            scope in ROLE_SCOPES[role] for role in self.roles.values()
        )

    def may(self, scope: Scope, site_id: int | None) -> bool:
        """Whether the scope is granted on a site; with None, on all sites at once."""
        roles = {self.roles.get(None), self.roles.get(site_id)} - {None}
        return self._token_allows(scope) and any(
            scope in ROLE_SCOPES[role] for role in roles if role is not None
        )

    def site_ids(self, scope: Scope) -> frozenset[int] | None:
        """Return the sites where the scope is granted; None stands for all sites."""
        if self.may(scope, None):
            return None
        return frozenset(
            site_id for site_id in self.roles if site_id is not None and self.may(scope, site_id)
        )

    def scopes(self) -> frozenset[Scope]:
        """Return the scopes granted on at least one site."""
        return frozenset(scope for scope in Scope if self.may_anywhere(scope))

    def require(self, scope: Scope, site_id: int | None) -> None:
        """Demand a scope on a site, or on all sites with None.

        Raises NotFound, and logs it, where the site may not even be read; Forbidden where it may.
        """
        if self.may(scope, site_id):
            return
        if site_id is not None and not self.may(Scope.READ, site_id):
            _log.warning("foreign_id", user_id=self.user_id, site_id=site_id, scope=scope.value)
            raise NotFound("it belongs to a site that the caller may not read")
        where = "on this site" if site_id is not None else "on all sites"
        raise Forbidden(f"this needs the scope `{scope.value}` {where}")

    def _token_allows(self, scope: Scope) -> bool:
        return self.token_scopes is None or scope in self.token_scopes


def access_of(request: Request) -> Access | None:
    """Return who is calling, or None for a caller who is not signed in."""
    access: Access | None = getattr(request.state, "access", None)
    return access


@dataclass(frozen=True)
class Allowed(SecurityBase):
    """The dependency behind `allowed`: gives the caller's access, or refuses."""

    scope: Scope | None
    model: HTTPBearer = field(
        default_factory=lambda: HTTPBearer(
            description="An API token, or the session cookie that a browser gets when signing in"
        ),
        compare=False,
    )
    scheme_name: str = "token"

    async def __call__(self, request: Request) -> Access:
        """Return the caller's access. Raises Unauthenticated or Forbidden."""
        access = access_of(request)
        if access is None:
            raise Unauthenticated(
                "sign in, or send an API token as `Authorization: Bearer ...`",
                headers={"WWW-Authenticate": 'Bearer realm="Quaymark"'},
            )
        if access.camera_id is not None and request.url.path != drop_path(access.camera_id):
            raise Forbidden(f"this token only drops photographs of camera {access.camera_id}")
        if self.scope is not None and not access.may_anywhere(self.scope):
            raise Forbidden(f"this needs the scope `{self.scope.value}`")
        return access


def drop_path(camera_id: int) -> str:
    """Return the only address that is for a camera's own tokens."""
    return f"/api/v1/cameras/{camera_id}/drop"


def allowed(scope: Scope | None) -> Dependency:
    """Declare that a route is for callers who hold a scope somewhere; None: who are signed in.

    Written `access: Annotated[Access, allowed(Scope.READ)]`.
    """
    names = [] if scope is None else [scope.value]  # so that the OpenAPI document tells them
    dependency: Dependency = Security(Allowed(scope), scopes=names)
    return dependency


async def public() -> None:
    """Declare, as `Depends(public)`, that a route is for everybody."""
