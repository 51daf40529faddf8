"""SQL of a run's images: what was judged in them, what was missed, which are complete."""

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.tables.imagery import Image
from app.tables.runs import Run, RunImage


def image(session: Session, image_id: int) -> Image | None:
    """Return a present image."""
    found = find(session, Image, image_id)
    return None if found is None or found.deleted_at is not None else found


def run_over(session: Session, run_id: int, image_id: int) -> Run | None:
    """Return a run if it is over an image."""
    return session.scalar(
        sa.select(Run)
        .join(RunImage, RunImage.run_id == Run.id)
        .where(Run.id == run_id, RunImage.image_id == image_id)
    )
