"""Retention: what a rule would let go, said before; and letting it go, a little at a time.

Images go as anything that is deleted: hidden, and for 30 days they can be brought back. Positions
and previews go at once; previews are made again when somebody looks, and positions only where no
pose rests on them. Nothing a person has judged, corrected or drawn goes unless the rule says so.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.db import Database, now
from app.deletions import service as deletions
from app.errors import Invalid, NotFound
from app.imagery import service as imagery
from app.retention import repository
from app.storage import Storage
from app.tables.live import RetentionKind, RetentionRule

ROWS_AT_ONCE = 500
LONGEST_DAYS = 36_500


def label(rule: RetentionRule) -> str:
    """Return how people call a rule."""
    return f"{rule.kind.value.replace('_', ' ')} kept for {rule.keep_days} days"


def get(session: Session, rule_id: int) -> RetentionRule:
    """Return a rule. Raises NotFound."""
    row = repository.rule(session, rule_id)
    if row is None:
        raise NotFound("there is no such rule")
    return row


def rules(session: Session, site_id: int) -> Sequence[RetentionRule]:
    """Return the rules of a site and its cameras."""
    return repository.rules(session, site_id)


def add(session: Session, row: RetentionRule) -> RetentionRule:
    """Store a rule, switched off. Raises Invalid."""
    if not 1 <= row.keep_days <= LONGEST_DAYS:
        raise Invalid.field("keep_days", f"must lie between 1 and {LONGEST_DAYS}")
    session.add(row)
    session.flush()
    return row


def _limit(row: RetentionRule) -> datetime:
    return now() - timedelta(days=row.keep_days)


def preview(session: Session, row: RetentionRule) -> int:
    """Count what a rule would let go now: images, positions, or images whose previews go."""
    before = _limit(row)
    if row.kind is RetentionKind.AIS_POSITIONS:
        return repository.count_positions(session, row, repository.gaps(session, row, before))
    return repository.count_images(session, row, before)


def apply_all(database: Database, storage: Storage) -> int:
    """Let go what the active rules say; returns how much."""
    with database.reading() as session:
        ids = repository.active(session)
    return sum(apply(database, storage, rule_id) for rule_id in ids)


def apply(database: Database, storage: Storage, rule_id: int) -> int:
    """Let go what one rule says, in small transactions; returns how much."""
    with database.reading() as session:
        row = get(session, rule_id)
        before = _limit(row)
    if row.kind is RetentionKind.IMAGES:
        count = _apply_to_images(database, row, before)
    elif row.kind is RetentionKind.AIS_POSITIONS:
        count = _apply_to_positions(database, row, before)
    else:
        with database.reading() as session:
            sha256s = repository.contents(session, row, before)
        count = sum(imagery.forget_previews(storage, sha256) for sha256 in sha256s)
    with database.writing() as session:
        row = get(session, rule_id)
        row.applied_at, row.applied_count = now(), count
    return count


def _apply_to_images(database: Database, row: RetentionRule, before: datetime) -> int:
    count = 0
    while True:
        with database.writing() as session:
            ids = repository.image_ids(session, row, before, ROWS_AT_ONCE)
            if not ids:
                return count
            label = f"{len(ids)} images older than {row.keep_days} days, by rule {row.id}"
            deletions.delete(session, "image", ids, site_id=row.site_id, label=label)
            count += len(ids)


def _apply_to_positions(database: Database, row: RetentionRule, before: datetime) -> int:
    with database.reading() as session:
        gaps = repository.gaps(session, row, before)
    count = 0
    for gap in gaps:
        while True:
            with database.writing() as session:
                removed = repository.remove_positions(session, row, gap, ROWS_AT_ONCE)
            if not removed:
                break
            count += removed
    return count
