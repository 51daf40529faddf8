"""The SQL of learning: a site's complete images with all verdicts, and what was learnt of them."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.db import find
from app.tables.detection import Detection
from app.tables.imagery import Image
from app.tables.learning import LearntSettings
from app.tables.reviews import (
    Correction,
    CorrectionKind,
    Grade,
    ImageCompletion,
    MissedReason,
    MissedVessel,
    Review,
    verdict_order,
)
from app.tables.runs import Match, Pose, Run, RunImage


class CompleteImage(NamedTuple):
    """An image that a person marked complete, in the newest run for which one did."""

    image_id: int
    run_id: int
    captured_at: datetime
    detection_set_id: int


class Box(NamedTuple):
    """A detection."""

    id: int
    detection_set_id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    score: float


class PoseVerdict(NamedTuple):
    """A pose, what it was matched by, and the verdict that stands; None where nobody graded it."""

    id: int
    run_id: int
    image_id: int
    detection_id: int
    mmsi: int
    person_made: bool
    cost: float
    cost_terms: Mapping[str, Any]


class Verdict(NamedTuple):
    """The grade that counts for a pose, and its reasons."""

    grade: Grade
    reasons: Sequence[str]


class Missed(NamedTuple):
    """A visible vessel without a pose."""

    run_id: int
    image_id: int
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    reason: MissedReason


def complete_images(session: Session, site_id: int) -> list[CompleteImage]:
    """Return a site's complete images, each once."""
    rows = session.execute(
        sa.select(
            ImageCompletion.image_id,
            ImageCompletion.run_id,
            Image.captured_at,
            RunImage.detection_set_id,
        )
        .join(Image, Image.id == ImageCompletion.image_id)
        .join(Run, Run.id == ImageCompletion.run_id)
        .join(
            RunImage,
            sa.and_(
                RunImage.run_id == ImageCompletion.run_id,
                RunImage.image_id == ImageCompletion.image_id,
            ),
        )
        .where(Run.site_id == site_id, RunImage.detection_set_id.is_not(None))
        .order_by(ImageCompletion.run_id)
    )
    # Of several runs the newest comes last and stays.
    newest = {row[0]: row for row in rows}
    return [CompleteImage(*row[:3], row[3] or 0) for row in newest.values()]


def parameters(session: Session, run_ids: Collection[int]) -> Mapping[int, Mapping[str, Any]]:
    """Return the parameters of some runs."""
    rows = session.execute(sa.select(Run.id, Run.parameters).where(Run.id.in_(run_ids)))
    return {row[0]: row[1] for row in rows}


def boxes(session: Session, site_id: int) -> list[Box]:
    """Return the detections of a site's complete images."""
    sets = (
        sa.select(RunImage.detection_set_id)
        .join(Run, Run.id == RunImage.run_id)
        .join(ImageCompletion, _completes(RunImage))
        .where(Run.site_id == site_id)
    )
    rows = session.execute(
        sa.select(
            Detection.id,
            Detection.detection_set_id,
            Detection.x1_px,
            Detection.y1_px,
            Detection.x2_px,
            Detection.y2_px,
            Detection.score,
        )
        .where(Detection.detection_set_id.in_(sets))
        .order_by(Detection.id)
    )
    return [Box(*row) for row in rows]


def poses(session: Session, site_id: int) -> list[PoseVerdict]:
    """Return the poses in a site's complete images."""
    rows = session.execute(
        sa.select(
            Pose.id,
            Pose.run_id,
            Pose.image_id,
            Match.detection_id,
            Pose.mmsi,
            Pose.person_made,
            Match.cost,
            Match.cost_terms,
        )
        .join(Match, Match.id == Pose.match_id)
        .join(Run, Run.id == Pose.run_id)
        .join(ImageCompletion, _completes(Pose))
        .where(Run.site_id == site_id)
        .order_by(Pose.id)
    )
    return [PoseVerdict(*row) for row in rows]


def verdicts(session: Session, site_id: int) -> Mapping[int, Verdict]:
    """Return the verdict that counts for each graded pose of a site's complete images."""
    rows = session.execute(
        sa.select(Review.pose_id, Review.grade, Review.reasons)
        .join(Pose, Pose.id == Review.pose_id)
        .join(Run, Run.id == Pose.run_id)
        .join(ImageCompletion, _completes(Pose))
        .where(Run.site_id == site_id, Review.replaced_at.is_(None))
        .order_by(*verdict_order())
    ).all()
    return {row[0]: Verdict(row[1], row[2]) for row in reversed(rows)}


def rematched(session: Session, site_id: int) -> Mapping[int, int]:
    """Return the vessel a person chose for a pose instead of its own, by pose."""
    rows = session.execute(
        sa.select(Correction.pose_id, Correction.mmsi)
        .join(Pose, Pose.id == Correction.pose_id)
        .join(Run, Run.id == Pose.run_id)
        .where(
            Run.site_id == site_id,
            Correction.kind == CorrectionKind.REMATCHED,
            Correction.deleted_at.is_(None),
        )
        .order_by(Correction.pose_id, Correction.version)
    )
    return {row[0]: row[1] for row in rows}


def missed(session: Session, site_id: int) -> list[Missed]:
    """Return the missed vessels of a site's complete images."""
    rows = session.execute(
        sa.select(
            MissedVessel.run_id,
            MissedVessel.image_id,
            MissedVessel.x1_px,
            MissedVessel.y1_px,
            MissedVessel.x2_px,
            MissedVessel.y2_px,
            MissedVessel.reason,
        )
        .join(Run, Run.id == MissedVessel.run_id)
        .join(ImageCompletion, _completes(MissedVessel))
        .where(Run.site_id == site_id)
    )
    return [Missed(*row) for row in rows]


def learnt(session: Session, site_id: int) -> Sequence[LearntSettings]:
    """Return a site's sets, undone ones too, newest first."""
    return session.scalars(
        sa.select(LearntSettings)
        .where(LearntSettings.site_id == site_id)
        .order_by(LearntSettings.number.desc())
    ).all()


def get(session: Session, learnt_id: int) -> LearntSettings | None:
    """Return a set."""
    return find(session, LearntSettings, learnt_id)


def _completes(rows: type[Pose | MissedVessel | RunImage]) -> sa.ColumnElement[bool]:
    return sa.and_(ImageCompletion.image_id == rows.image_id, ImageCompletion.run_id == rows.run_id)
