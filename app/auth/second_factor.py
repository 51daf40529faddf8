"""The second factor: set up by showing one code of it, asked for at every sign-in after that.

Recovery codes stand in for a lost phone, each once. Wrong codes count as wrong passwords do, and
who sets the factor up or off shows that they know the password.
"""

import secrets
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.auth import audit, link_repository, passwords, repository, totp
from app.auth.access import Access
from app.auth.tokens import token_sha256
from app.db import now
from app.errors import Conflict, Invalid, NotFound
from app.tables.identity import User

RECOVERY_CODES = 10
_RECOVERY_BYTES = 8
WRONG_CODE = "is not the present code; the phone's clock may be off"


def set_up(session: Session, access: Access, secret: str, code: str, password: str) -> list[str]:
    """Turn the caller's second factor on and return fresh recovery codes, shown this once.

    Raises Invalid for a wrong code or password.
    """
    user = _caller(session, access, password)
    try:
        step = totp.matching_step(secret, code, now(), None)
    except ValueError as error:
        raise Invalid.field("code", "belongs to no secret of ours; begin again") from error
    if step is None:
        raise Invalid.field("code", WRONG_CODE)
    user.totp_secret, user.totp_last_step = secret, step
    codes = [secrets.token_hex(_RECOVERY_BYTES) for _ in range(RECOVERY_CODES)]
    link_repository.replace_recovery_codes(session, user.id, map(token_sha256, codes))
    repository.drop_sessions_of(session, user.id, but=access.session_id)
    audit.record(session, access, "set up", "second factor", user.id)
    return codes


def turn_off(session: Session, access: Access, password: str) -> None:
    """Turn the caller's second factor off. Raises Conflict while an administrator demands it."""
    user = _caller(session, access, password)
    if user.totp_required:
        raise Conflict("an administrator demands a second factor of you")
    _clear(session, user)
    audit.record(session, access, "turn off", "second factor", user.id)


def reset(session: Session, access: Access, user: User) -> None:
    """Take a person's second factor away, who lost phone and recovery codes; they set up anew."""
    _clear(session, user)
    repository.drop_sessions_of(session, user.id)
    audit.record(session, access, "reset", "second factor", user.id)


def demand(session: Session, access: Access, user: User, *, wanted: bool) -> None:
    """Demand a second factor of a person, or no longer; without one they may do nothing."""
    user.totp_required = wanted
    audit.record(session, access, "demand", "second factor", user.id, wanted=wanted)


def fits(session: Session, user: User, code: str) -> bool:
    """Whether a code of the app or a recovery code is right; either is used up."""
    if user.totp_secret is None:
        return False
    moment = now()
    step = totp.matching_step(user.totp_secret, code, moment, user.totp_last_step)
    if step is not None:
        user.totp_last_step = step
        return True
    recovery = "".join(code.split()).lower()
    used = link_repository.use_recovery_code(session, user.id, token_sha256(recovery), moment)
    if used:
        audit.record(session, None, "use recovery code", "second factor", user.id)
    return used


@dataclass(frozen=True, slots=True)
class State:
    """Whether somebody has a second factor, must have one, and their recovery codes left."""

    is_on: bool
    is_demanded: bool
    codes_left: int


def state_of(session: Session, access: Access) -> State:
    """Return how the caller stands with the second factor."""
    user = repository.user_by_id(session, access.user_id)
    if user is None:
        raise NotFound("the caller is gone")
    left = link_repository.count_recovery_codes(session, user.id)
    return State(user.totp_secret is not None, user.totp_required, left)


def _clear(session: Session, user: User) -> None:
    user.totp_secret = user.totp_last_step = None
    link_repository.replace_recovery_codes(session, user.id, ())


def _caller(session: Session, access: Access, password: str) -> User:
    user = repository.user_by_id(session, access.user_id)
    if user is None:
        raise NotFound("the caller is gone")
    # Who signs in at the identity provider only has no password to show.
    if user.password_hash and not passwords.password_fits(password, user.password_hash):
        raise Invalid.field("password", "is not your present password")
    return user
