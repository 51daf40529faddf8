"""SQL of corrections: versions count up for each pose, the newest counts."""

from collections.abc import Mapping, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.reviews import Correction


def counting(session: Session, pose_ids: Sequence[int]) -> Mapping[int, Correction]:
    """Return the correction that counts for each pose that has one."""
    newest = (
        sa.select(Correction.pose_id, sa.func.max(Correction.version).label("version"))
        .where(Correction.pose_id.in_(pose_ids))
        .group_by(Correction.pose_id)
        .subquery()
    )
    rows = session.scalars(
        sa.select(Correction)
        .join(
            newest,
            (newest.c.pose_id == Correction.pose_id) & (newest.c.version == Correction.version),
        )
        .where(Correction.deleted_at.is_(None))
    )
    return {correction.pose_id: correction for correction in rows}


def all_of(session: Session, pose_id: int) -> Sequence[Correction]:
    """Return all corrections of a pose, deleted ones too, newest first."""
    return session.scalars(
        sa.select(Correction)
        .where(Correction.pose_id == pose_id)
        .order_by(Correction.version.desc())
    ).all()
