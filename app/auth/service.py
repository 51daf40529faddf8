"""Signing in and out, telling who is calling, and API tokens.

A browser holds an opaque session cookie, a script an opaque bearer token; both are looked up by
their SHA-256. A token acts for the person who made it, within its own scopes: what the person loses
the token loses at once, because roles are read at every request.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.auth import audit, link_repository, passwords, repository
from app.auth.access import Access, Scope
from app.auth.second_factor import fits
from app.auth.throttle import SignInThrottle
from app.auth.tokens import new_token, token_sha256
from app.db import Database, now
from app.errors import Forbidden, Invalid, NotFound, Unauthenticated
from app.paging import Paging
from app.tables.identity import ApiToken, LoginSession, User

TOKEN_USE_RESOLUTION = timedelta(hours=1)
LONGEST_TOKEN_DAYS = 3650
USUAL_TOKEN_DAYS = 90
CODE_WITHIN = timedelta(minutes=10)
LONGEST_USER_AGENT = 200


@dataclass(frozen=True, slots=True)
class Caller:
    """What a request's credentials came to: who it is, and whether a token's use wants noting."""

    access: Access
    token_to_note: int | None = None


def authenticate(
    session: Session, *, bearer: str | None, cookie: str | None, moment: datetime
) -> Caller | None:
    """Return who sent these credentials, or None; a bearer token goes before a cookie.

    Inactive people, expired sessions and expired or revoked tokens are nobody.
    """
    if bearer is not None:
        token = repository.credential_of_token(session, token_sha256(bearer), moment)
        if token is None or not token.is_active:
            return None
        used_at = token.last_used_at
        stale = used_at is None or moment - used_at > TOKEN_USE_RESOLUTION
        scopes = frozenset(Scope(scope) for scope in token.scopes)
        access = _access_of(token, token_scopes=scopes, token_id=token.id)
        return Caller(access, token.id if stale else None)
    if cookie is not None:
        found = repository.credential_of_session(session, token_sha256(cookie), moment)
        if found is not None and found.is_active:
            return Caller(_access_of(found, session_id=found.id))
    return None


def _access_of(
    found: repository.Credential,
    *,
    token_scopes: frozenset[Scope] | None = None,
    session_id: int | None = None,
    token_id: int | None = None,
) -> Access:
    return Access(
        user_id=found.user_id,
        email=found.email,
        name=found.name or found.email,
        roles=found.roles,
        token_scopes=token_scopes,
        session_id=session_id,
        token_id=token_id,
        camera_id=found.camera_id,
    )


def _access(user: User) -> Access:
    return Access(
        user_id=user.id,
        email=user.email,
        name=user.name or user.email,
        roles={membership.site_id: membership.role for membership in user.memberships},
    )


def note_token_use(session: Session, token_id: int, moment: datetime) -> None:
    """Store that a token was used; called at most once in `TOKEN_USE_RESOLUTION`."""
    repository.note_token_use(session, token_id, moment)


@dataclass(frozen=True, slots=True)
class Browser:
    """Where somebody signs in from, for the list of their sessions."""

    address: str
    user_agent: str


@dataclass(frozen=True, slots=True)
class OpenedSession:
    """A fresh session cookie, and whether a code is still owed before it is good for anything."""

    cookie: str
    awaits_code: bool


def sign_in(
    database: Database,
    throttle: SignInThrottle,
    *,
    email: str,
    password: str,
    browser: Browser,
    hours: int,
    replaces: Access | None,
) -> OpenedSession:
    """Check a password and return a fresh session cookie; the browser's old session ends.

    Hashing is slow on purpose, so it happens before the writing transaction begins. Raises
    Unauthenticated with the same words for a wrong password, an unknown and an inactive person;
    TooManyRequests after too many failures for the account or from the address.
    """
    with throttle.attempt(email, browser.address) as attempt:
        with database.reading() as session:
            user = repository.user_by_email(session, email)
        known = user.password_hash if user is not None and user.is_active else None
        if not passwords.password_fits(password, known) or user is None:
            attempt.failed()
            raise Unauthenticated("the e-mail address or the password is wrong")
        attempt.succeeded()
    awaits_code = user.totp_secret is not None
    lasts = CODE_WITHIN if awaits_code else timedelta(hours=hours)
    with database.writing() as session:
        _end_replaced(session, replaces)
        cookie = _open_session(session, user, browser, lasts, awaits_code=awaits_code)
    return OpenedSession(cookie, awaits_code)


def open_session(
    session: Session,
    user: User,
    browser: Browser,
    *,
    hours: int,
    factor_shown: bool,
    replaces: Access | None,
) -> OpenedSession:
    """Open a session for somebody whom the identity provider vouches for.

    With `factor_shown` the provider's second factor counts, and ours is not asked for.
    """
    _end_replaced(session, replaces)
    awaits_code = user.totp_secret is not None and not factor_shown
    lasts = CODE_WITHIN if awaits_code else timedelta(hours=hours)
    cookie = _open_session(
        session, user, browser, lasts, awaits_code=awaits_code, factor_shown=factor_shown
    )
    return OpenedSession(cookie, awaits_code)


def _end_replaced(session: Session, replaces: Access | None) -> None:
    if replaces is not None and replaces.session_id is not None:
        repository.drop_session(session, replaces.session_id)


def confirm_code(
    database: Database,
    throttle: SignInThrottle,
    *,
    cookie: str,
    code: str,
    browser: Browser,
    hours: int,
) -> str:
    """Check the second factor of a browser that knows the password; return its session's cookie.

    The cookie is a fresh one. Raises Unauthenticated for a wrong code and when the password has to
    be given again; TooManyRequests after too many wrong codes.
    """
    with database.reading() as session:
        waiting = link_repository.waiting_session(session, token_sha256(cookie), now())
    if waiting is None:
        raise Unauthenticated("too late; give your password again")
    with throttle.attempt(f"code of {waiting.user_id}", browser.address) as attempt:
        with database.writing() as session:
            user = repository.user_by_id(session, waiting.user_id)
            is_right = user is not None and user.is_active and fits(session, user, code)
            if user is not None and is_right:
                repository.drop_session(session, waiting.id)
                fresh = _open_session(session, user, browser, timedelta(hours=hours))
                attempt.succeeded()
                return fresh
        attempt.failed()
        raise Unauthenticated("the code is wrong or was used already")


def _open_session(
    session: Session,
    user: User,
    browser: Browser,
    lasts: timedelta,
    *,
    awaits_code: bool = False,
    factor_shown: bool = False,
) -> str:
    moment = now()
    repository.drop_expired_sessions(session, moment)
    cookie = new_token()
    session.add(
        LoginSession(
            token_sha256=token_sha256(cookie),
            user_id=user.id,
            expires_at=moment + lasts,
            awaits_code=awaits_code,
            factor_shown=factor_shown,
            user_agent=browser.user_agent[:LONGEST_USER_AGENT],
            address=browser.address,
        )
    )
    if not awaits_code:
        audit.record(session, _access(user), "sign-in", "user", user.id)
    return cookie


def sessions_of(session: Session, user_id: int) -> Sequence[LoginSession]:
    """Return the browsers where somebody is signed in, the newest first."""
    return link_repository.sessions_of(session, user_id, now())


def end_session(session: Session, access: Access, session_id: int) -> None:
    """End one of the caller's own browser sessions. Raises NotFound."""
    if session_id not in {found.id for found in sessions_of(session, access.user_id)}:
        raise NotFound("there is no such session of yours")
    repository.drop_session(session, session_id)
    audit.record(session, access, "end", "session", session_id)


def end_sessions_of(session: Session, access: Access, user: User) -> None:
    """End all browser sessions of another person, at an administrator's wish."""
    access.require(Scope.ADMIN, None)
    repository.drop_sessions_of(session, user.id)
    audit.record(session, access, "end sessions", "user", user.id)


def sign_out_everywhere(session: Session, access: Access) -> None:
    """End all browser sessions of the caller, this one too."""
    repository.drop_sessions_of(session, access.user_id)
    audit.record(session, access, "sign-out everywhere", "user", access.user_id)


def sign_out(session: Session, access: Access) -> None:
    """End the browser session in use; nothing to end for a token."""
    if access.session_id is not None:
        repository.drop_session(session, access.session_id)
        audit.record(session, access, "sign-out", "user", access.user_id)


def create_token(
    session: Session,
    access: Access,
    *,
    name: str,
    scopes: Iterable[Scope],
    days: int | None,
    usual_days: int = USUAL_TOKEN_DAYS,
) -> tuple[ApiToken, str]:
    """Make a token for the caller and return it with its text, which is shown this once.

    Raises Forbidden when it would hold a scope that the caller lacks, or outlive the token that
    makes it: no token widens itself. Without `days` it lives `usual_days`, or as long as it may.
    """
    wanted = frozenset(scopes)
    beyond = wanted - access.scopes()
    if beyond:
        names = ", ".join(sorted(beyond))
        raise Forbidden(f"a token cannot hold scopes that its maker lacks: {names}")
    token, text = issue_token(
        session,
        access.user_id,
        name=name,
        scopes=wanted,
        days=usual_days if days is None else days,
    )
    if access.token_id is not None:
        _end_with_maker(session, token, access.token_id, refuses=days is not None)
    audit.record(session, access, "create", "token", token.id, name=name, scopes=list(token.scopes))
    return token, text


def _end_with_maker(session: Session, token: ApiToken, maker_id: int, *, refuses: bool) -> None:
    """Let a token end with the token that made it; what is asked is taken in whole days."""
    maker = repository.token_by_id(session, maker_id)
    if maker is None:
        raise Forbidden("the token in use was removed meanwhile")
    if refuses and token.expires_at >= maker.expires_at + timedelta(days=1):
        raise Forbidden(
            f"a token lives no longer than the token that makes it, until {maker.expires_at:%F}; "
            "ask for fewer expires_days, leave them out, or sign in to make a longer one"
        )
    token.expires_at = min(token.expires_at, maker.expires_at)
    token.made_by_id = maker.id
    session.flush()


def issue_token(
    session: Session, user_id: int, *, name: str, scopes: Iterable[Scope], days: int
) -> tuple[ApiToken, str]:
    """Make a token for a user without asking who wants it; for the command line and `create_token`.

    Raises Invalid for no scope or an absurd life.
    """
    wanted = sorted(set(scopes))
    if not wanted:
        raise Invalid.field("scopes", "name at least one")
    if not 1 <= days <= LONGEST_TOKEN_DAYS:
        raise Invalid.field("expires_days", f"must lie between 1 and {LONGEST_TOKEN_DAYS}")
    text = new_token()
    token = ApiToken(
        token_sha256=token_sha256(text),
        user_id=user_id,
        name=name,
        scopes=[scope.value for scope in wanted],
        expires_at=now() + timedelta(days=days),
    )
    session.add(token)
    session.flush()
    return token, text


def list_tokens(
    session: Session, access: Access, paging: Paging, *, everybody: bool = False
) -> tuple[Sequence[ApiToken], str | None]:
    """Return a page of the caller's tokens, or of everybody's for an administrator."""
    if everybody:
        access.require(Scope.ADMIN, None)
    return repository.list_tokens(session, None if everybody else access.user_id, paging)


def revoke_token(session: Session, access: Access, token_id: int) -> None:
    """Revoke a token, one's own or, for an administrator, anybody's, and all that it made.

    Raises NotFound.
    """
    token = repository.token_by_id(session, token_id)
    if token is None or (token.user_id != access.user_id and not access.is_admin):
        raise NotFound(f"there is no token {token_id} of yours")
    for each in repository.with_what_it_made(session, token):
        if each.revoked_at is None:
            each.revoked_at = now()
            audit.record(session, access, "revoke", "token", each.id, name=each.name)


def site_names(session: Session, access: Access) -> dict[int, str]:
    """Return the names of the sites where the caller has a role of their own, by id."""
    return repository.site_names(session, {site_id for site_id in access.roles if site_id})


def administered_sites(session: Session, access: Access) -> dict[int, str]:
    """Return the names of the sites by id among which an administrator may choose."""
    ids = access.site_ids(Scope.ADMIN)
    return repository.site_names(session, None if ids is None else set(ids))


def user_by_email(session: Session, email: str) -> User | None:
    """Return the person with an address, whatever its case; None for nobody."""
    return repository.user_by_email(session, email)


def site_id_named(session: Session, text: str) -> int | None:
    """Return the id of the site with a name or, for a number, with that id; None for none."""
    return repository.site_id_named(session, text)
