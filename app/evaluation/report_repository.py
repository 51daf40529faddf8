"""SQL of the report: what the data of a site and a period is, and how it was made."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.evaluation.review_repository import of_images, of_poses
from app.evaluation.selection import Selection
from app.tables.imagery import Image
from app.tables.runs import Pose, Run, RunImage, VesselStateRow
from app.tables.sites import Camera


class CameraImages(NamedTuple):
    """A camera's images of the period."""

    name: str
    images: int
    first_at: datetime | None
    last_at: datetime | None


class Heard(NamedTuple):
    """What the runs heard by AIS: images with a vessel near, and how many vessels there were."""

    images: int
    vessels: int


def cameras(session: Session, site_id: int, chosen: Selection) -> list[CameraImages]:
    """Return a site's cameras with their images of the period."""
    asked = chosen.asked
    first, last = sa.func.min(Image.captured_at), sa.func.max(Image.captured_at)
    statement = (
        sa.select(Camera.name, sa.func.count(), first, last)
        .join(Image, Image.camera_id == Camera.id)
        .where(Camera.site_id == site_id, Image.deleted_at.is_(None))
        .group_by(Camera.id, Camera.name)
        .order_by(Camera.name)
    )
    if asked.since is not None:
        statement = statement.where(Image.captured_at >= asked.since)
    if asked.until is not None:
        statement = statement.where(Image.captured_at < asked.until)
    return [CameraImages(*row) for row in session.execute(statement)]


def runs(session: Session, chosen: Selection) -> Sequence[Run]:
    """Return the runs of a selection that did an image of the period."""
    did = (
        sa.select(RunImage.run_id)
        .join(Image, Image.id == RunImage.image_id)
        .join(Run, Run.id == RunImage.run_id)
        .where(RunImage.done_at.is_not(None), *_images(chosen))
    )
    statement = sa.select(Run).where(Run.id.in_(did)).order_by(Run.id)
    return session.scalars(
        statement.options(
            joinedload(Run.model), joinedload(Run.registration), joinedload(Run.viewport)
        )
    ).all()


def images_done(session: Session, chosen: Selection) -> int:
    """Count the different images that the runs of a selection have done."""
    return (
        session.scalar(
            sa.select(sa.func.count(sa.distinct(RunImage.image_id)))
            .join(Image, Image.id == RunImage.image_id)
            .join(Run, Run.id == RunImage.run_id)
            .where(RunImage.done_at.is_not(None), *_images(chosen))
        )
        or 0
    )


def heard(session: Session, chosen: Selection) -> Heard:
    """Count the different images with a vessel heard near, and the different vessels."""
    row = session.execute(
        sa.select(
            sa.func.count(sa.distinct(VesselStateRow.image_id)),
            sa.func.count(sa.distinct(VesselStateRow.mmsi)),
        )
        .join(Image, Image.id == VesselStateRow.image_id)
        .join(Run, Run.id == VesselStateRow.run_id)
        .where(*of_images(chosen, VesselStateRow.image_id, VesselStateRow.run_id))
    ).one()
    return Heard(row[0], row[1])


def posed_vessels(session: Session, chosen: Selection) -> int:
    """Count the different vessels that have a pose."""
    return (
        session.scalar(
            sa.select(sa.func.count(sa.distinct(Pose.mmsi)))
            .join(Image, Image.id == Pose.image_id)
            .join(Run, Run.id == Pose.run_id)
            .where(*of_poses(chosen))
        )
        or 0
    )


def _images(chosen: Selection) -> list[sa.ColumnElement[bool]]:
    return of_images(chosen, RunImage.image_id, RunImage.run_id)
