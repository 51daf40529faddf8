"""SQL of review queues, as far as evaluation asks for them: which sample figures rest on."""

from collections.abc import Collection, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.errors import NotFound
from app.tables.queues import ReviewQueue


def queue(session: Session, queue_id: int) -> ReviewQueue:
    """Return a review queue with its run. Raises NotFound."""
    found = find(session, ReviewQueue, queue_id, joinedload(ReviewQueue.run))
    if found is None:
        raise NotFound("there is no such review queue")
    return found


def queues(session: Session, run_ids: Collection[int]) -> Sequence[ReviewQueue]:
    """Return the review queues of some runs, newest first."""
    return session.scalars(
        sa.select(ReviewQueue)
        .where(ReviewQueue.run_id.in_(run_ids))
        .order_by(ReviewQueue.id.desc())
    ).all()
