"""Who comes from the identity provider: known, expected, newly welcome, or refused.

An identity (issuer and subject) belongs to one person for good. At its first sign-in it finds that
person by the e-mail address, which the provider must have verified: somebody who is here already,
somebody invited, or, where that is allowed, anybody whose groups give a role.
"""

from collections.abc import Mapping
from typing import Any

from sqlalchemy.orm import Session

from app.auth import audit, links, users
from app.auth import service as auth
from app.auth.access import Access
from app.auth.service import Browser, OpenedSession
from app.config import Settings
from app.db import Database, now
from app.errors import Conflict, Forbidden
from app.oidc import repository
from app.oidc.roles import roles_of
from app.tables.identity import ProviderIdentity, User

Claims = Mapping[str, Any]
LONGEST_NAME = 200


def sign_in(
    database: Database,
    settings: Settings,
    claims: Claims,
    *,
    browser: Browser,
    replaces: Access | None,
) -> OpenedSession:
    """Open a session for whoever the provider vouches for. Raises Forbidden with the reason."""
    with database.writing() as session:
        issuer, subject = settings.oidc_issuer, str(claims["sub"])
        identity = repository.by_subject(session, issuer, subject)
        if identity is None:
            user = _meet(session, settings, claims)
            identity = _link(session, user, issuer, subject)
        else:
            user = _known(session, settings, claims, identity)
        identity.last_used_at = now()
        _give_roles(session, settings, claims, user)
        counts = settings.oidc_second_factor == "provider" and not _only_a_password(claims)
        return auth.open_session(
            session,
            user,
            browser,
            hours=settings.session_hours,
            factor_shown=counts,
            replaces=replaces,
        )


def unlink(session: Session, access: Access, user: User) -> None:
    """Forget who a person is at the provider; their next sign-in there finds them by address."""
    if not repository.drop(session, user.id):
        raise Conflict("nobody at the identity provider is this person")
    audit.record(session, access, "unlink", "provider identity", user.id)


def linked_users(session: Session) -> set[int]:
    """Return the ids of the people who have signed in at the provider."""
    return repository.linked_users(session)


def _known(
    session: Session, settings: Settings, claims: Claims, identity: ProviderIdentity
) -> User:
    user = session.get_one(User, identity.user_id)
    if not user.is_active:
        raise Forbidden(f"the account of {user.email} is switched off; ask an administrator")
    if claims.get("email"):
        _check_domain(settings, str(claims["email"]))
    return user


def _meet(session: Session, settings: Settings, claims: Claims) -> User:
    """Return the person an identity seen for the first time belongs to, added if need be."""
    email = _verified_email(settings, claims)
    user = auth.user_by_email(session, email)
    if user is not None:
        if not user.is_active:
            raise Forbidden(f"the account of {email} is switched off; ask an administrator")
        if any(known.issuer == settings.oidc_issuer for known in _identities(session, user)):
            raise Forbidden(
                f"{email} belongs to another identity of this provider here; an administrator can "
                "unlink that one under Administration, People"
            )
        return user
    name = str(claims.get("name") or "")[:LONGEST_NAME]
    invitation = repository.open_invitation(session, email, now())
    if invitation is not None:
        return links.join_from_provider(session, invitation, name)
    roles = roles_of(session, settings, claims) if settings.oidc_create_people else None
    if not roles:
        reason = (
            "no group of yours gives a role here"
            if settings.oidc_create_people
            else "nobody has invited you yet"
        )
        raise Forbidden(f"{email} is unknown here and {reason}; ask an administrator")
    return users.create_user(session, email, None, roles, name=name)


def _identities(session: Session, user: User) -> list[ProviderIdentity]:
    return list(repository.of_user(session, user.id))


def _verified_email(settings: Settings, claims: Claims) -> str:
    try:
        email = users.normalised_email(str(claims.get("email") or ""))
    except ValueError as error:
        raise Forbidden(
            "the identity provider tells no e-mail address of yours, by which to know you"
        ) from error
    if claims.get("email_verified") not in (True, "true"):
        raise Forbidden(
            f"the identity provider has not verified that {email} is yours; verify it there first"
        )
    _check_domain(settings, email)
    return email


def _check_domain(settings: Settings, email: str) -> None:
    domains = settings.oidc_email_domains
    if domains and email.rpartition("@")[2].lower() not in domains:
        raise Forbidden(f"addresses such as {email} may not sign in here; ask an administrator")


def _link(session: Session, user: User, issuer: str, subject: str) -> ProviderIdentity:
    identity = ProviderIdentity(user_id=user.id, issuer=issuer, subject=subject)
    session.add(identity)
    session.flush()
    audit.record(session, None, "link", "provider identity", user.id, issuer=issuer)
    return identity


def _give_roles(session: Session, settings: Settings, claims: Claims, user: User) -> None:
    roles = roles_of(session, settings, claims) if settings.oidc_roles else None
    held = {(membership.role, membership.site_id) for membership in user.memberships}
    if roles is None or held == {(spec.role, spec.site_id) for spec in roles}:
        return
    try:
        with session.begin_nested():
            users.change_user(session, user, users.UserChange(memberships=roles))
    except Conflict:
        # The last administrator stays one, whatever the provider says: nobody could make another.
        session.refresh(user)


def _only_a_password(claims: Claims) -> bool:
    """Whether the provider itself says that no second factor was shown."""
    methods = claims.get("amr")
    return methods == ["pwd"]
