"""Who administers what; apart from `users` because workers ask too, without the web's framework."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.auth import repository
from app.tables.identity import User


def administrators_of(session: Session, site_id: int | None) -> Sequence[User]:
    """Return the active administrators of a site and of all sites; for None only the latter."""
    return repository.administrators(session, site_id)
