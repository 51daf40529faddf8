"""Pages for administrators: people, tokens, the audit log."""

from typing import Annotated

from fastapi import APIRouter, Form, Request
from fastapi.responses import RedirectResponse, Response
from sqlalchemy.orm import Session

from app.admin import service
from app.auth import links, mailed_links, second_factor, users
from app.auth import service as auth
from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.links import HandedOut
from app.dependencies import JobsDep, PagingDep, SessionDep, SettingsDep, public_address
from app.errors import Conflict, Invalid
from app.oidc import service as identities
from app.paging import Paging
from app.reviews import queues
from app.tables.identity import Role
from app.templating import page

router = APIRouter(prefix="/admin")
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
Text = Annotated[str, Form(max_length=2000)]
Site = Annotated[str, Form(pattern="^[0-9]{0,9}$")]
MOST_SHOWN = 1000
NOTICES = {
    "added": "The person is added. Tell them their password; it is not shown again.",
    "changed": "The change is stored.",
    "removed": "The person is removed; what they made stays, without their name.",
    "handed-over": "Their open queues and leases are handed over.",
    "withdrawn": "The invitation is withdrawn.",
    "unlinked": "Their next sign-in at the identity provider finds them by their address.",
    "mailed": "A link for a new password is on its way by mail.",
    "revoked": "The token is revoked.",
}


@router.get("")
def show_start(access: Administrator) -> Response:  # noqa: ARG001  declares the permission
    """Lead to the people."""
    return RedirectResponse("/admin/users", status_code=303)


@router.get("/users")
def show_users(
    request: Request, session: SessionDep, access: Administrator, done: str = ""
) -> Response:
    """Show all people and the form for another."""
    return _users(request, session, access, notice=NOTICES.get(done, ""))


@router.post("/users")
def add_user(
    request: Request,
    session: SessionDep,
    access: Administrator,
    email: Text,
    password: Text,
    role: Annotated[Role, Form()],
    site_id: Site = "",
    name: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    """Add a person."""
    access.require(Scope.ADMIN, None)
    spec = users.MembershipSpec(role, int(site_id) if site_id else None)
    try:
        users.create_user(session, email, password, [spec], name=name, access=access)
    except (Invalid, Conflict) as error:
        values = {"email": email, "name": name, "role": role.value, "site_id": site_id}
        return _users(request, session, access, error=error.detail, values=values)
    return RedirectResponse("/admin/users?done=added", status_code=303)


@router.post("/users/{user_id}/role")
def give_role(
    user_id: int,
    session: SessionDep,
    access: Administrator,
    role: Annotated[Role, Form()],
    site_id: Site = "",
) -> Response:
    """Give a person a role on a site, or on all."""
    user = users.user_for(session, access, user_id)
    spec = users.MembershipSpec(role, int(site_id) if site_id else None)
    change = users.UserChange(memberships=users.with_role(user, spec))
    users.change_user(session, user, change, access=access)
    return RedirectResponse("/admin/users?done=changed", status_code=303)


@router.post("/users/{user_id}/active")
def set_active(
    user_id: int, session: SessionDep, access: Administrator, active: Annotated[bool, Form()]
) -> Response:
    """Let a person sign in, or no longer."""
    user = users.user_for(session, access, user_id)
    users.change_user(session, user, users.UserChange(is_active=active), access=access)
    return RedirectResponse("/admin/users?done=changed", status_code=303)


@router.get("/users/{user_id}/remove")
def ask_to_remove(
    request: Request, user_id: int, session: SessionDep, access: Administrator
) -> Response:
    """Say what goes with a person and what stays, and that it is final."""
    user = users.user_for(session, access, user_id)
    return page(
        request,
        "admin/remove.html",
        crumbs=[
            {"label": "People", "href": "/admin/users"},
            {"label": user.name or user.email},
            {"label": "Remove"},
        ],
        person=user,
        counts=users.goes_with(session, user),
        held=queues.count_held(session, user.id),
    )


@router.post("/users/{user_id}/remove")
def remove_user(user_id: int, session: SessionDep, access: Administrator) -> Response:
    """Remove a person; what they hold of review queues goes back."""
    user = users.user_for(session, access, user_id)
    queues.let_go(session, user.id)
    users.remove_user(session, user, access=access)
    return RedirectResponse("/admin/users?done=removed", status_code=303)


@router.post("/users/{user_id}/hand-over")
def hand_over(
    user_id: int,
    session: SessionDep,
    settings: SettingsDep,
    access: Administrator,
    taker_id: Annotated[int, Form()] = 0,
) -> Response:
    """Give a person's open review queues and leases to another."""
    giver = users.user_for(session, access, user_id)
    taker = users.user_for(session, access, taker_id)
    count = queues.hand_over(session, giver.id, taker.id, settings.review_lease_s)
    record(session, access, "hand over", "user", giver.id, taker_id=taker.id, items=count)
    return RedirectResponse("/admin/users?done=handed-over", status_code=303)


@router.post("/users/{user_id}/reset-link")
def make_reset_link(
    user_id: int,
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Administrator,
    by: Annotated[str, Form(max_length=10)] = "",
) -> Response:
    """Make a link with which a person sets a new password, and show it this once; or mail it."""
    if by == "mail" and settings.sends_mail:
        user = users.user_for(session, access, user_id)
        mailed_links.queue_reset(session, jobs, access, user)
        return RedirectResponse("/admin/users?done=mailed", status_code=303)
    handed = links.reset(session, access, users.user_for(session, access, user_id))
    return _users(request, session, access, link=handed)


@router.post("/users/{user_id}/second-factor")
def change_second_factor(
    user_id: int,
    session: SessionDep,
    access: Administrator,
    wanted: Annotated[str, Form(max_length=10)] = "",
) -> Response:
    """Demand a second factor of a person, no longer demand it, or take away a lost one."""
    user = users.user_for(session, access, user_id)
    if wanted not in {"demand", "free", "reset"}:
        raise Invalid.field("wanted", "must be demand, free or reset")
    if wanted == "reset":
        second_factor.reset(session, access, user)
    else:
        second_factor.demand(session, access, user, wanted=wanted == "demand")
    return RedirectResponse("/admin/users?done=changed", status_code=303)


@router.post("/users/{user_id}/unlink")
def unlink_identity(user_id: int, session: SessionDep, access: Administrator) -> Response:
    """Forget who a person is at the identity provider."""
    identities.unlink(session, access, users.user_for(session, access, user_id))
    return RedirectResponse("/admin/users?done=unlinked", status_code=303)


@router.post("/invitations")
def invite(
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Administrator,
    email: Text,
    role: Annotated[Role, Form()],
    site_id: Site = "",
    *,
    by_mail: Annotated[bool, Form()] = False,
) -> Response:
    """Make an invitation and show its link, this once; where wanted it goes by mail too."""
    try:
        handed = links.invite(
            session, access, email=email, role=role, site_id=int(site_id) if site_id else None
        )
    except (Invalid, Conflict) as error:
        values = {"email": email, "role": role.value, "site_id": site_id}
        return _users(request, session, access, invite_error=error.detail, values=values)
    if by_mail and settings.sends_mail:
        mailed_links.queue_invitation(session, jobs, handed.link)
    return _users(request, session, access, link=handed, mailed=by_mail)


@router.post("/invitations/withdraw")
def withdraw_invitation(
    session: SessionDep, access: Administrator, link_id: Annotated[int, Form()]
) -> Response:
    """Make an invitation worthless."""
    links.withdraw(session, access, link_id)
    return RedirectResponse("/admin/users?done=withdrawn", status_code=303)


@router.get("/tokens")
def show_tokens(
    request: Request,
    session: SessionDep,
    access: Administrator,
    paging: PagingDep,
    done: str = "",
) -> Response:
    """Show everybody's tokens."""
    tokens, next_cursor = auth.list_tokens(session, access, paging, everybody=True)
    return page(
        request,
        "admin/tokens.html",
        tokens=tokens,
        emails=service.emails_of(session, {token.user_id for token in tokens}),
        next_cursor=next_cursor,
        flashes=_flashes(NOTICES.get(done, "")),
    )


@router.post("/tokens/{token_id}/revoke")
def revoke_token(token_id: int, session: SessionDep, access: Administrator) -> Response:
    """Revoke anybody's token."""
    auth.revoke_token(session, access, token_id)
    return RedirectResponse("/admin/tokens?done=revoked", status_code=303)


def _users(
    request: Request,
    session: Session,
    access: Access,
    *,
    notice: str = "",
    error: str = "",
    invite_error: str = "",
    link: HandedOut | None = None,
    mailed: bool = False,
    values: dict[str, str] | None = None,
) -> Response:
    found, _ = users.list_users(session, access, Paging(limit=MOST_SHOWN, after=None))
    return page(
        request,
        "admin/users.html",
        status_code=422 if error or invite_error else 200,
        users=found,
        invitations=links.open_invitations(session, access),
        invite_error=invite_error,
        link=f"{public_address(request)}{link.path}" if link else "",
        linked=link.link.email if link else "",
        mailed=mailed,
        linked_users=identities.linked_users(session),
        sends_mail=request.app.state.settings.sends_mail,
        sites=auth.administered_sites(session, access),
        roles=[(role.value, role.value.capitalize()) for role in Role],
        flashes=_flashes(notice),
        error=error,
        values=values or {},
    )


def _flashes(notice: str) -> list[dict[str, str]]:
    return [{"message": notice, "tone": "success"}] if notice else []
