"""Queueing letters with links, in the transaction of the change that they tell of.

A job's arguments are kept for all administrators to see, so they hold no token and no address.
"""

import secrets

from sqlalchemy.orm import Session

from app.auth import audit, repository
from app.auth.access import Access, Scope
from app.auth.letters import INVITATION_MAIL, RESET_MAIL
from app.jobs import JobClient, JobQueue
from app.tables.identity import AccountLink, LinkKind, User

NOBODY = 0


def queue_invitation(session: Session, jobs: JobClient, link: AccountLink) -> None:
    """Send an invitation by mail, once the caller's transaction is committed."""
    _enqueue(session, jobs, INVITATION_MAIL, link.id)


def queue_reset(session: Session, jobs: JobClient, access: Access, user: User) -> None:
    """Send a person a link for a new password, at an administrator's wish."""
    access.require(Scope.ADMIN, None)
    audit.record(session, access, "mail", LinkKind.PASSWORD_RESET.value, user.id)
    _enqueue(session, jobs, RESET_MAIL, user.id)


def queue_wished_reset(session: Session, jobs: JobClient, email: str) -> None:
    """Send a link for a new password to whoever has this address, if anybody has.

    A job is queued for unknown addresses too, so that nothing tells them from known ones. Who never
    had a password here, because they sign in at the identity provider, gets none this way.
    """
    user = repository.user_by_email(session, email)
    is_known = user is not None and user.is_active and bool(user.password_hash)
    _enqueue(session, jobs, RESET_MAIL, user.id if user is not None and is_known else NOBODY)


def _enqueue(session: Session, jobs: JobClient, job: str, identifier: int) -> None:
    job_id = f"{job.replace(' ', '-')}-{secrets.token_hex(8)}"
    jobs.enqueue(session, job, identifier, queue=JobQueue.MAIL, job_id=job_id)
