"""Statics that a recording says again: another recording or a feed brought them already.

Positions that are known are left out as they are written. Statics are few, so those that are known
are taken out once, when a recording is whole.
"""

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from app.ais.rows import STATIC_COLUMNS
from app.tables.ais import AisFile, AisStatic

_SAID = [name for name in STATIC_COLUMNS if name not in {"mmsi", "received_at"}]


def remove_known_statics(session: Session, file_id: int, site_id: int | None) -> int:
    """Remove a file's statics that its site knew already, of the same moment; return how many."""
    known = aliased(AisStatic)
    shown = sa.select(AisFile.id).where(AisFile.is_whole, AisFile.deleted_at.is_(None))
    is_before = sa.and_(
        known.id < AisStatic.id,
        sa.func.coalesce(known.site_id, 0) == (site_id or 0),
        sa.or_(known.file_id.is_(None), known.file_id.in_(shown)),
    )
    says_the_same = sa.and_(
        known.mmsi == AisStatic.mmsi,
        known.received_at == AisStatic.received_at,
        *(getattr(known, name).is_not_distinct_from(getattr(AisStatic, name)) for name in _SAID),
    )
    repeated = sa.select(AisStatic.id).where(
        AisStatic.file_id == file_id, sa.exists().where(is_before, says_the_same)
    )
    # Past the ORM, which would look for the rows among its own.
    result = session.connection().execute(sa.delete(AisStatic).where(AisStatic.id.in_(repeated)))
    return result.rowcount
