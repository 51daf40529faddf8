"""The SQL of retention: which rows a rule would let go."""

from collections.abc import Collection, Sequence
from datetime import datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.domain.cells import hour_of
from app.tables.ais import AisPosition
from app.tables.groundtruth import GroundTruthImage
from app.tables.imagery import Image
from app.tables.live import RetentionKind, RetentionRule
from app.tables.reviews import Correction, ImageCompletion, MissedVessel, Review
from app.tables.runs import Pose

# A pose rests on reports of at most some minutes before and after its image.
NEEDED_AROUND = timedelta(minutes=15)
Gap = tuple[datetime | None, datetime]


def rule(session: Session, rule_id: int) -> RetentionRule | None:
    """Return a rule."""
    return find(session, RetentionRule, rule_id)


def rules(session: Session, site_id: int) -> Sequence[RetentionRule]:
    """Return the rules of a site and its cameras."""
    return session.scalars(
        sa.select(RetentionRule).where(RetentionRule.site_id == site_id).order_by(RetentionRule.id)
    ).all()


def active(session: Session) -> Sequence[int]:
    """Return the ids of the rules that are switched on."""
    return session.scalars(sa.select(RetentionRule.id).where(RetentionRule.is_active)).all()


def _images(rule: RetentionRule, before: datetime) -> list[sa.ColumnElement[bool]]:
    """Return the conditions of the images a rule speaks of."""
    conditions = [Image.site_id == rule.site_id, Image.captured_at < before]
    if rule.camera_id is not None:
        conditions.append(Image.camera_id == rule.camera_id)
    if rule.kind is RetentionKind.IMAGES and not rule.takes_judged:
        conditions += [
            ~sa.exists().where(of_pose.pose_id == Pose.id, Pose.image_id == Image.id)
            for of_pose in (Review, Correction)
        ]
        conditions += [
            ~sa.exists().where(of_image.image_id == Image.id)
            for of_image in (MissedVessel, ImageCompletion, GroundTruthImage)
        ]
    return conditions


def count_images(session: Session, rule: RetentionRule, before: datetime) -> int:
    """Count the images a rule would let go."""
    statement = sa.select(sa.func.count(Image.id)).where(*_images(rule, before))
    return session.scalar(statement) or 0


def image_ids(session: Session, rule: RetentionRule, before: datetime, limit: int) -> Sequence[int]:
    """Return the oldest images a rule lets go."""
    return session.scalars(
        sa.select(Image.id).where(*_images(rule, before)).order_by(Image.captured_at).limit(limit)
    ).all()


def contents(session: Session, rule: RetentionRule, before: datetime) -> Sequence[str]:
    """Return the addresses of the images whose previews a rule lets go."""
    return session.scalars(sa.select(Image.sha256).where(*_images(rule, before))).all()


def gaps(session: Session, rule: RetentionRule, before: datetime) -> list[Gap]:
    """Return the times before a moment in which no pose rests on any report of a site."""
    moments = session.scalars(
        sa.select(Image.captured_at)
        .where(
            Image.site_id == rule.site_id,
            Image.captured_at < before + NEEDED_AROUND,
            sa.exists().where(Pose.image_id == Image.id),
        )
        .order_by(Image.captured_at)
    )
    found: list[Gap] = []
    free_from: datetime | None = None
    for moment in moments:
        end = moment - NEEDED_AROUND
        if free_from is None or end > free_from:
            found.append((free_from, end))
        free_from = moment + NEEDED_AROUND
    if free_from is None or free_from < before:
        found.append((free_from, before))
    return found


def _in_gap(rule: RetentionRule, gap: Gap) -> list[sa.ColumnElement[bool]]:
    begin, end = gap
    position = AisPosition
    before_end = position.fix_time < end, position.hour <= hour_of(end)
    conditions = [position.site_id == rule.site_id, *before_end]
    if begin is None:
        return conditions
    return [*conditions, position.fix_time >= begin, position.hour >= hour_of(begin)]


def count_positions(session: Session, rule: RetentionRule, gaps: Collection[Gap]) -> int:
    """Count the positions of a site in some times."""
    return sum(
        session.scalar(sa.select(sa.func.count(AisPosition.id)).where(*_in_gap(rule, gap))) or 0
        for gap in gaps
    )


def remove_positions(session: Session, rule: RetentionRule, gap: Gap, limit: int) -> int:
    """Remove some of a site's positions of a time; returns how many."""
    ids = session.scalars(sa.select(AisPosition.id).where(*_in_gap(rule, gap)).limit(limit)).all()
    session.execute(
        sa.delete(AisPosition)
        .where(AisPosition.id.in_(ids))
        .execution_options(synchronize_session=False)
    )
    return len(ids)
