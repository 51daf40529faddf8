"""Writing an edit, and saying in plain words why it did not come to pass.

Everything people edit has a version, and many things have a name that nobody else may have. Both
are found out only as the change is written: somebody else was quicker.
"""

import sqlalchemy as sa
from sqlalchemy.orm import Session
from sqlalchemy.orm.exc import StaleDataError

from app.errors import Conflict, FieldError, PreconditionFailed


def flush_edit(session: Session) -> None:
    """Write what changed. Raises PreconditionFailed when somebody else changed it too."""
    try:
        session.flush()
    except StaleDataError as error:
        raise PreconditionFailed(
            "somebody else changed it meanwhile; read it again, then repeat the edit"
        ) from error


def flush_named(session: Session, taken: str) -> None:
    """Write what changed. Raises Conflict with `taken` for a name in use, PreconditionFailed."""
    try:
        flush_edit(session)
    except sa.exc.IntegrityError as error:
        raise Conflict(taken, fields=(FieldError("name", taken),)) from error
