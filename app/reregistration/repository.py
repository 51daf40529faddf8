"""The SQL of re-registrations: what is asked, what came of the images, what is proposed."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find, now
from app.domain.reregistration import Refusal
from app.paging import Paging, fetch_page
from app.reregistration.schemas import Counts, ImageChoice
from app.tables.imagery import Image
from app.tables.registration import Keypoint
from app.tables.reregistration import (
    Pointing,
    PointingState,
    Reregistration,
    ReregistrationImage,
    ReregistrationStatus,
)
from app.tables.sites import Camera, Viewport

OPEN = (ReregistrationStatus.QUEUED, ReregistrationStatus.RUNNING)
# What more keyframes may change; a blank picture stays blank.
WORTH_ANOTHER_LOOK = (
    Refusal.TOO_FEW_INLIERS,
    Refusal.TOO_SMALL_AREA,
    Refusal.TWO_MOTIONS,
    Refusal.UNCERTAIN,
)


def get(session: Session, reregistration_id: int) -> Reregistration | None:
    """Return a re-registration with its viewport and camera."""
    return find(
        session,
        Reregistration,
        reregistration_id,
        joinedload(Reregistration.viewport).joinedload(Viewport.camera).joinedload(Camera.site),
        joinedload(Reregistration.registration),
    )


def listed(
    session: Session, site_ids: Iterable[int] | None, viewport_id: int | None, paging: Paging
) -> tuple[Sequence[Reregistration], str | None]:
    """Return a page of the re-registrations of some sites (None: all), oldest first."""
    statement = sa.select(Reregistration)
    if site_ids is not None:
        statement = statement.where(Reregistration.site_id.in_(site_ids))
    if viewport_id is not None:
        statement = statement.where(
            Reregistration.viewport_id == sa.literal(viewport_id, sa.BigInteger())
        )
    return fetch_page(session, statement, Reregistration.id, paging)


def newest(session: Session, viewport_id: int, limit: int) -> Sequence[Reregistration]:
    """Return a viewport's newest re-registrations."""
    return session.scalars(
        sa.select(Reregistration)
        .where(Reregistration.viewport_id == viewport_id)
        .order_by(Reregistration.id.desc())
        .limit(limit)
    ).all()


def first_image(session: Session, viewport_id: int) -> Image | None:
    """Return the first present image of a viewport."""
    return session.scalars(
        sa.select(Image)
        .where(Image.viewport_id == viewport_id, Image.deleted_at.is_(None))
        .order_by(Image.captured_at, Image.id)
        .limit(1)
    ).first()


def add(
    session: Session,
    row: Reregistration,
    choice: ImageChoice,
    begin: datetime | None,
    end: datetime | None,
) -> int:
    """Store a re-registration with a row for each image it is about; returns their count."""
    session.add(row)
    session.flush()
    reference = session.get_one(Image, row.reference_image_id)
    order = sa.func.row_number().over(order_by=(Image.captured_at, Image.id)) - 1
    chosen = sa.select(Image.id, order).where(
        Image.camera_id == reference.camera_id,
        Image.deleted_at.is_(None),
        Image.id != reference.id,
    )
    if choice is ImageChoice.UNASSIGNED:
        chosen = chosen.where(Image.viewport_id.is_(None))
    elif choice is ImageChoice.VIEWPORT:
        chosen = chosen.where(Image.viewport_id == row.viewport_id)
    if begin is not None:
        chosen = chosen.where(Image.captured_at >= begin)
    if end is not None:
        chosen = chosen.where(Image.captured_at < end)
    rows = session.execute(chosen).all()
    if rows:
        session.execute(
            sa.insert(ReregistrationImage),
            [
                {"reregistration_id": row.id, "image_id": image_id, "position": position}
                for image_id, position in rows
            ],
        )
    row.image_count = len(rows)
    session.flush()
    return row.image_count


def counts(session: Session, ids: Iterable[int]) -> dict[int, Counts]:
    """Tell of re-registrations how many of their images are done."""
    wanted = list(ids)
    found = {identifier: Counts() for identifier in wanted}
    image = ReregistrationImage
    passed = sa.case((image.refusal.is_(None), 1), else_=0)
    for row in session.execute(
        sa.select(
            image.reregistration_id,
            sa.func.count(),
            sa.func.sum(passed),
            sa.func.max(image.done_at),
        )
        .where(image.reregistration_id.in_(wanted), image.done_at.is_not(None))
        .group_by(image.reregistration_id)
    ):
        found[row[0]] = Counts(
            passed=int(row[2]), refused=row[1] - int(row[2]), last_done_at=row[3]
        )
    for identifier, count in session.execute(
        sa.select(Pointing.reregistration_id, sa.func.count())
        .where(Pointing.reregistration_id.in_(wanted))
        .group_by(Pointing.reregistration_id)
    ):
        found[identifier].pointings = count
    return found


def images(
    session: Session,
    reregistration_id: int,
    *,
    passed: bool | None = None,
    pointing_id: int | None = None,
    after: int = -1,
    limit: int = 1000,
) -> Sequence[ReregistrationImage]:
    """Return images of a re-registration in order of time, those after a position."""
    image = ReregistrationImage
    statement = sa.select(image).where(
        image.reregistration_id == reregistration_id, image.position > after
    )
    if passed is not None:
        statement = statement.where(image.done_at.is_not(None))
        statement = statement.where(
            image.refusal.is_(None) if passed else image.refusal.is_not(None)
        )
    if pointing_id is not None:
        statement = statement.where(image.pointing_id == pointing_id)
    return session.scalars(statement.order_by(image.position).limit(limit)).all()


def undone(
    session: Session, reregistration_id: int, start: int, stop: int, attempt: int
) -> Sequence[ReregistrationImage]:
    """Return the images at some positions that had no turn yet, or may pass at another attempt."""
    image = ReregistrationImage
    return session.scalars(
        sa.select(image)
        .where(
            image.reregistration_id == reregistration_id,
            image.position >= start,
            image.position < stop,
            image.attempts < attempt,
            sa.or_(image.done_at.is_(None), image.refusal.in_(WORTH_ANOTHER_LOOK)),
        )
        .order_by(image.position)
    ).all()


def begin(session: Session, reregistration_id: int) -> int:
    """Mark a re-registration as running; returns how many images it has."""
    row = session.get_one(Reregistration, reregistration_id)
    if row.status is ReregistrationStatus.QUEUED:
        row.status = ReregistrationStatus.RUNNING
        row.started_at = now()
    return row.image_count


def store(session: Session, reregistration_id: int, outcomes: Sequence[dict[str, Any]]) -> None:
    """Store what came of images; each outcome names its image_id."""
    for outcome in outcomes:
        session.execute(
            sa.update(ReregistrationImage)
            .where(
                ReregistrationImage.reregistration_id == reregistration_id,
                ReregistrationImage.image_id == outcome["image_id"],
            )
            .values(
                **{name: value for name, value in outcome.items() if name != "image_id"},
                done_at=now(),
            )
        )


def finish(
    session: Session,
    reregistration_id: int,
    status: ReregistrationStatus,
    error: str | None = None,
) -> bool:
    """Mark as ended, unless it has ended already; returns whether it did."""
    changed = session.execute(
        sa.update(Reregistration)
        .where(Reregistration.id == reregistration_id, Reregistration.status.in_(OPEN))
        .values(status=status, error=error, finished_at=now())
        .returning(Reregistration.id)
    )
    return changed.first() is not None


def id_of_job(session: Session, workflow_id: str) -> int | None:
    """Return the re-registration behind a job."""
    return session.scalar(
        sa.select(Reregistration.id).where(Reregistration.workflow_id == workflow_id)
    )


def add_pointing(session: Session, pointing: Pointing, image_ids: Sequence[int]) -> None:
    """Store a pointing and say so at its images."""
    session.add(pointing)
    session.flush()
    session.execute(
        sa.update(ReregistrationImage)
        .where(
            ReregistrationImage.reregistration_id == pointing.reregistration_id,
            ReregistrationImage.image_id.in_(image_ids),
        )
        .values(pointing_id=pointing.id)
    )


def pointing(session: Session, pointing_id: int) -> Pointing | None:
    """Return a pointing."""
    return find(session, Pointing, pointing_id)


def pointings(session: Session, reregistration_id: int) -> Sequence[Pointing]:
    """Return the pointings of a re-registration in order of time."""
    return session.scalars(
        sa.select(Pointing)
        .where(Pointing.reregistration_id == reregistration_id)
        .order_by(Pointing.position)
    ).all()


def strongest(session: Session, pointing_id: int) -> ReregistrationImage | None:
    """Return the image of a pointing with the most support."""
    return session.scalars(
        sa.select(ReregistrationImage)
        .where(ReregistrationImage.pointing_id == pointing_id)
        .order_by(ReregistrationImage.inliers.desc(), ReregistrationImage.position)
        .limit(1)
    ).first()


def turned_image(
    session: Session, reregistration_id: int, image_id: int
) -> ReregistrationImage | None:
    """Return an image of a re-registration."""
    return session.get(ReregistrationImage, (reregistration_id, image_id))


def viewports_of_camera(session: Session, camera_id: int) -> Sequence[Viewport]:
    """Return a camera's viewports."""
    return session.scalars(
        sa.select(Viewport).where(Viewport.camera_id == camera_id).order_by(Viewport.id)
    ).all()


def keypoints(session: Session, viewport_id: int) -> Sequence[Keypoint]:
    """Return a viewport's keypoints with their landmarks."""
    return session.scalars(
        sa.select(Keypoint).where(Keypoint.viewport_id == viewport_id).order_by(Keypoint.id)
    ).all()


def waiting_pointings(session: Session, camera_id: int) -> tuple[int, int | None]:
    """Count a camera's pointings nobody has decided on; with the newest re-registration of them."""
    row = session.execute(
        sa.select(sa.func.count(), sa.func.max(Reregistration.id))
        .select_from(Pointing)
        .join(Reregistration, Pointing.reregistration_id == Reregistration.id)
        .join(Viewport, Reregistration.viewport_id == Viewport.id)
        .where(Viewport.camera_id == camera_id, Pointing.state == PointingState.PROPOSED)
    ).one()
    return row[0], row[1]


def moved(
    session: Session, viewport_ids: Iterable[int], alarm_deg: float
) -> Sequence[tuple[int, int, int, float, datetime]]:
    """Tell of viewports which of their own images look another way than registered.

    Rows (viewport, re-registration, count, largest angle in degrees, first moment), of the newest
    re-registration of each viewport only.
    """
    image = ReregistrationImage
    latest = (
        sa.select(sa.func.max(Reregistration.id))
        .where(
            Reregistration.viewport_id.in_(list(viewport_ids)),
            Reregistration.status == ReregistrationStatus.SUCCEEDED,
        )
        .group_by(Reregistration.viewport_id)
    )
    rows = session.execute(
        sa.select(
            Reregistration.viewport_id,
            Reregistration.id,
            sa.func.count(),
            sa.func.max(Pointing.angle_deg),
            sa.func.min(Image.captured_at),
        )
        .join(image, image.reregistration_id == Reregistration.id)
        .join(Pointing, Pointing.id == image.pointing_id)
        .join(Image, Image.id == image.image_id)
        .where(
            Reregistration.id.in_(latest),
            Image.viewport_id == Reregistration.viewport_id,
            Pointing.angle_deg > alarm_deg,
        )
        .group_by(Reregistration.viewport_id, Reregistration.id)
    )
    return [(row[0], row[1], row[2], row[3], row[4]) for row in rows]
