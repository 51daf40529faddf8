"""REST for administrators: people and the audit log."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import AwareDatetime

from app.admin import service
from app.admin.schemas import AuditOut
from app.auth import users
from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.schemas import UserIn, UserOut, UserPatch
from app.auth.versions import VERSIONED, check_if_match, heed_if_match, set_etag
from app.dependencies import Page, PagingDep, SessionDep
from app.reviews import queues
from app.tables.identity import User

router = APIRouter(route_class=IdempotentRoute)
Administrator = Annotated[Access, allowed(Scope.ADMIN)]


@router.get("/users", tags=["users"])
def list_users(session: SessionDep, access: Administrator, paging: PagingDep) -> Page[UserOut]:
    """List all people, oldest first."""
    found, next_cursor = users.list_users(session, access, paging)
    return Page(items=[UserOut.of(user) for user in found], next_cursor=next_cursor)


@router.post("/users", status_code=201, tags=["users"])
def create_user(
    data: UserIn, session: SessionDep, access: Administrator, response: Response
) -> UserOut:
    """Add a person with their roles."""
    access.require(Scope.ADMIN, None)
    user = users.create_user(
        session,
        data.email,
        data.password,
        [membership.spec() for membership in data.memberships],
        name=data.name,
        access=access,
    )
    response.headers["Location"] = f"/api/v1/users/{user.id}"
    return _shown(user, response)


@router.get("/users/{user_id}", tags=["users"])
def get_user(
    user_id: int, session: SessionDep, access: Administrator, response: Response
) -> UserOut:
    """Show a person; the ETag is what an edit sends as If-Match."""
    return _shown(users.user_for(session, access, user_id), response)


@router.patch("/users/{user_id}", tags=["users"], dependencies=[VERSIONED])
def update_user(
    user_id: int,
    data: UserPatch,
    request: Request,
    session: SessionDep,
    access: Administrator,
    response: Response,
) -> UserOut:
    """Change a person; fields left out stay. A new password signs their browsers out."""
    user = users.user_for(session, access, user_id)
    check_if_match(request, user.version)
    memberships = data.memberships
    change = users.UserChange(
        name=data.name,
        is_active=data.is_active,
        password=data.password,
        memberships=None if memberships is None else [part.spec() for part in memberships],
    )
    users.change_user(session, user, change, access=access)
    return _shown(user, response)


@router.delete("/users/{user_id}", status_code=204, tags=["users"], dependencies=[VERSIONED])
def remove_user(user_id: int, request: Request, session: SessionDep, access: Administrator) -> None:
    """Remove a person; what they made stays. The last administrator cannot be removed."""
    user = users.user_for(session, access, user_id)
    heed_if_match(request, user.version)
    queues.let_go(session, user.id)
    users.remove_user(session, user, access=access)


@router.get("/audit-log", tags=["audit log"])
def list_audit_log(
    session: SessionDep,
    access: Administrator,
    paging: PagingDep,
    user_id: int | None = None,
    entity: Annotated[str | None, Query(max_length=64, examples=["site"])] = None,
    entity_id: int | None = None,
    action: Annotated[str | None, Query(max_length=64, examples=["create"])] = None,
    site_id: int | None = None,
    since: AwareDatetime | None = None,
    until: AwareDatetime | None = None,
) -> Page[AuditOut]:
    """List changes, newest first; administrators of single sites see those sites' changes."""
    wanted = service.AuditFilter(
        user_id=user_id,
        entity=entity,
        entity_id=entity_id,
        action=action,
        site_id=site_id,
        since=since,
        until=until,
    )
    entries, next_cursor = service.list_audit(session, access, wanted, paging)
    return Page(items=[AuditOut.of(entry) for entry in entries], next_cursor=next_cursor)


def _shown(user: User, response: Response) -> UserOut:
    set_etag(response, user.version)
    return UserOut.of(user)
