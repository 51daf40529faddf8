"""REST of how people come in and stay in: invitations, new passwords, second factors, sessions."""

from typing import Annotated

from fastapi import APIRouter, Request
from sqlalchemy.orm import Session

from app.admin.people_schemas import (
    FactorIn,
    FactorOut,
    FactorWish,
    HandOverIn,
    HandOverOut,
    InvitationIn,
    InvitationOut,
    NewInvitationOut,
    ResetIn,
    ResetOut,
    SessionOut,
)
from app.auth import links, mailed_links, second_factor, service, users
from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match
from app.config import Settings
from app.dependencies import JobsDep, Page, SessionDep, SettingsDep, public_address
from app.errors import Invalid
from app.oidc import service as identities
from app.reviews import queues

# The plain route class: answers with a link's token must not be stored for a repetition.
router = APIRouter(tags=["users"])
repeatable = APIRouter(tags=["users"], route_class=IdempotentRoute)
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
SignedIn = Annotated[Access, allowed(None)]


@router.get("/invitations")
def list_invitations(session: SessionDep, access: Administrator) -> Page[InvitationOut]:
    """List the invitations that still work, newest first."""
    found = links.open_invitations(session, access)
    return Page(items=[InvitationOut.of(link) for link in found], next_cursor=None)


@router.post("/invitations", status_code=201)
def invite_person(
    data: InvitationIn,
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Administrator,
) -> NewInvitationOut:
    """Invite somebody; the link is shown this once, works once and for a week.

    An `Idempotency-Key` is not heeded here: repeating the answer would mean keeping the secret.
    """
    access.require(Scope.ADMIN, None)
    _check_mail(settings, by_mail=data.by_mail)
    handed = links.invite(session, access, email=data.email, role=data.role, site_id=data.site_id)
    if data.by_mail:
        mailed_links.queue_invitation(session, jobs, handed.link)
    url = public_address(request) + handed.path
    return NewInvitationOut(url=url, **InvitationOut.of(handed.link).model_dump())


@router.delete("/invitations/{invitation_id}", status_code=204)
def withdraw_invitation(invitation_id: int, session: SessionDep, access: Administrator) -> None:
    """Make an invitation worthless."""
    links.withdraw(session, access, invitation_id)


@router.post("/users/{user_id}/password-reset", status_code=201)
def reset_password(
    user_id: int,
    data: ResetIn,
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    jobs: JobsDep,
    access: Administrator,
) -> ResetOut:
    """Make a link for a person's new password, for one day; shown this once, or sent by mail."""
    user = users.user_for(session, access, user_id)
    _check_mail(settings, by_mail=data.by_mail)
    if data.by_mail:
        mailed_links.queue_reset(session, jobs, access, user)
        return ResetOut(url=None, expires_at=None)
    handed = links.reset(session, access, user)
    url = public_address(request) + handed.path
    return ResetOut(url=url, expires_at=handed.link.expires_at)


@router.put("/users/{user_id}/second-factor", dependencies=[VERSIONED])
def change_second_factor(
    user_id: int, data: FactorIn, request: Request, session: SessionDep, access: Administrator
) -> FactorOut:
    """Demand a second factor of a person, demand it no longer, or take away a lost one."""
    user = users.user_for(session, access, user_id)
    check_if_match(request, user.version)
    if data.wanted is FactorWish.RESET:
        second_factor.reset(session, access, user)
    else:
        second_factor.demand(session, access, user, wanted=data.wanted is FactorWish.DEMAND)
    return FactorOut(is_on=user.totp_secret is not None, is_demanded=user.totp_required)


@repeatable.post("/users/{user_id}/hand-over")
def hand_over(
    user_id: int,
    data: HandOverIn,
    session: SessionDep,
    settings: SettingsDep,
    access: Administrator,
) -> HandOverOut:
    """Give a person's open review queues and leases to another."""
    giver = users.user_for(session, access, user_id)
    taker = users.user_for(session, access, data.taker_id)
    items = queues.hand_over(session, giver.id, taker.id, settings.review_lease_s)
    record(session, access, "hand over", "user", giver.id, taker_id=taker.id, items=items)
    return HandOverOut(items=items)


@router.delete("/users/{user_id}/identity", status_code=204)
def unlink_identity(user_id: int, session: SessionDep, access: Administrator) -> None:
    """Forget who a person is at the identity provider; the next sign-in there binds it anew."""
    identities.unlink(session, access, users.user_for(session, access, user_id))


@router.get("/users/{user_id}/sessions")
def list_sessions_of(user_id: int, session: SessionDep, access: Administrator) -> Page[SessionOut]:
    """List the browsers where a person is signed in, newest first."""
    user = users.user_for(session, access, user_id)
    return _sessions(session, access, user.id)


@router.delete("/users/{user_id}/sessions", status_code=204)
def end_sessions_of(user_id: int, session: SessionDep, access: Administrator) -> None:
    """Sign all of a person's browsers out."""
    user = users.user_for(session, access, user_id)
    service.end_sessions_of(session, access, user)


@router.get("/me/sessions")
def list_sessions(session: SessionDep, access: SignedIn) -> Page[SessionOut]:
    """List the browsers where one is signed in, newest first."""
    return _sessions(session, access, access.user_id)


@router.delete("/me/sessions/{session_id}", status_code=204)
def end_session(session_id: int, session: SessionDep, access: SignedIn) -> None:
    """Sign one of one's own browsers out."""
    service.end_session(session, access, session_id)


def _sessions(session: Session, access: Access, user_id: int) -> Page[SessionOut]:
    found = service.sessions_of(session, user_id)
    items = [SessionOut.of(each, access.session_id) for each in found]
    return Page(items=items, next_cursor=None)


def _check_mail(settings: Settings, *, by_mail: bool) -> None:
    if by_mail and not settings.sends_mail:
        raise Invalid.field("by_mail", "no mail server is configured; hand the link on yourself")


router.include_router(repeatable)
