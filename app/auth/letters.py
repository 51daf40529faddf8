"""Letters with links, written by workers: the link's token is made only as its mail is sent.

Its SHA-256 is stored, and the letter is the only place where the token itself stands. A repeated
try makes another, and the earlier one opens nothing.
"""

from datetime import timedelta

from sqlalchemy.orm import Session

from app.auth import link_repository, repository
from app.auth.tokens import new_token, token_sha256
from app.db import now
from app.mail.sending import Letter
from app.tables.identity import AccountLink, AuditEntry, LinkKind, User

INVITATION_MAIL, RESET_MAIL = "mail invitation", "mail password reset"
RESET_LASTS = timedelta(days=1)
_ENDING = "The link works once. If you did not expect this mail, do nothing.\n"


def path_of(token: str) -> str:
    """Return the path of the page behind a link, below the installation's address."""
    return f"/join?token={token}"


def fresh_reset(session: Session, user: User) -> tuple[AccountLink, str]:
    """Store a link with which a person sets a new password; earlier ones of theirs end."""
    link_repository.drop_resets(session, user.id)
    token = new_token()
    link = AccountLink(
        kind=LinkKind.PASSWORD_RESET,
        email=user.email,
        user_id=user.id,
        token_sha256=token_sha256(token),
        expires_at=now() + RESET_LASTS,
    )
    session.add(link)
    return link, token


def invitation_letter(session: Session, address: str, link_id: int) -> Letter | None:
    """Give an invitation its token for mail; None when it was used, withdrawn or has expired."""
    link = link_repository.by_id(session, link_id)
    if link is None or link.kind is not LinkKind.INVITATION or link.used_at is not None:
        return None
    if link.expires_at <= now():
        return None
    token = new_token()
    link.mailed_sha256 = token_sha256(token)
    role = "" if link.role is None else f" as {link.role.value}"
    return Letter(
        link.email,
        "Your invitation to Quaymark",
        f"You are invited to Quaymark at {address}{role}.\n\n"
        f"Join until {link.expires_at:%Y-%m-%d %H:%M} UTC:\n{address}{path_of(token)}\n\n"
        + _ENDING,
    )


def reset_letter(session: Session, address: str, user_id: int) -> Letter | None:
    """Make a link for a new password; None when nobody is there to get it."""
    user = repository.user_by_id(session, user_id)
    if user is None or not user.is_active or user.removed_at is not None:
        return None
    link, token = fresh_reset(session, user)
    session.flush()
    session.add(AuditEntry(action="mail", entity=link.kind.value, entity_id=link.id))
    return Letter(
        user.email,
        "A new password for Quaymark",
        f"Somebody, hopefully you, asked for a new password for Quaymark at {address}.\n\n"
        f"Choose it until {link.expires_at:%Y-%m-%d %H:%M} UTC:\n{address}{path_of(token)}\n\n"
        + _ENDING,
    )
