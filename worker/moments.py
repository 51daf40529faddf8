"""The present moment as all workers see it: the database server's where there is one.

The clocks of several machines disagree, and a worker whose clock is behind must not look dead to
the others. On SQLite all are on one machine.
"""

from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import now


def common_moment(session: Session) -> datetime:
    """Return the present moment in UTC."""
    if session.get_bind().dialect.name == "sqlite":
        return now()
    moment: datetime = session.scalars(sa.select(sa.func.clock_timestamp())).one()
    return moment
