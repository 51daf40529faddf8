"""The SQL of viewports, landmarks, keypoints and registrations."""

from collections.abc import Iterable, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session, contains_eager

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.registration import Keypoint, Landmark, Registration
from app.tables.sites import Camera, Viewport


def viewport(session: Session, viewport_id: int) -> Viewport | None:
    """Return a viewport by id."""
    return find(session, Viewport, viewport_id)


def viewports(
    session: Session,
    site_ids: frozenset[int] | None,
    camera_id: int | None,
    site_id: int | None,
    paging: Paging,
) -> tuple[Sequence[Viewport], str | None]:
    """Return a page of the viewports of the sites `site_ids` (all when None)."""
    statement = sa.select(Viewport).join(Viewport.camera).options(contains_eager(Viewport.camera))
    if site_ids is not None:
        statement = statement.where(Camera.site_id.in_(site_ids))
    if camera_id is not None:
        statement = statement.where(Viewport.camera_id == sa.literal(camera_id, sa.BigInteger()))
    if site_id is not None:
        statement = statement.where(Camera.site_id == sa.literal(site_id, sa.BigInteger()))
    return fetch_page(session, statement, Viewport.id, paging)


def overlapping(
    session: Session,
    camera_id: int,
    viewport_id: int | None,
    begin: datetime | None,
    end: datetime | None,
) -> Viewport | None:
    """Return another viewport of a camera that is valid at some time of [begin, end)."""
    statement = sa.select(Viewport).where(Viewport.camera_id == camera_id)
    if viewport_id is not None:
        statement = statement.where(Viewport.id != viewport_id)
    if end is not None:
        statement = statement.where(
            sa.or_(Viewport.valid_from.is_(None), Viewport.valid_from < end)
        )
    if begin is not None:
        statement = statement.where(
            sa.or_(Viewport.valid_until.is_(None), Viewport.valid_until > begin)
        )
    return session.scalars(statement.order_by(Viewport.id).limit(1)).first()


def keypoints(session: Session, viewport_id: int) -> Sequence[Keypoint]:
    """Return a viewport's keypoints in the order they were named."""
    return session.scalars(
        sa.select(Keypoint).where(Keypoint.viewport_id == viewport_id).order_by(Keypoint.id)
    ).all()


def keypoint_counts(session: Session, viewport_ids: Iterable[int]) -> dict[int, int]:
    """Count the keypoints of viewports."""
    rows = session.execute(
        sa.select(Keypoint.viewport_id, sa.func.count())
        .where(Keypoint.viewport_id.in_(list(viewport_ids)))
        .group_by(Keypoint.viewport_id)
    )
    return {row[0]: row[1] for row in rows}


def landmarks(session: Session, site_id: int) -> Sequence[Landmark]:
    """Return a site's landmarks."""
    return session.scalars(
        sa.select(Landmark).where(Landmark.site_id == site_id).order_by(Landmark.id)
    ).all()


def landmark(session: Session, landmark_id: int) -> Landmark | None:
    """Return a landmark by id."""
    return find(session, Landmark, landmark_id)


def landmark_page(
    session: Session, site_id: int, paging: Paging
) -> tuple[Sequence[Landmark], str | None]:
    """Return a page of a site's landmarks."""
    statement = sa.select(Landmark).where(Landmark.site_id == site_id)
    return fetch_page(session, statement, Landmark.id, paging)


def keypoint_counts_of_landmarks(session: Session, landmark_ids: Iterable[int]) -> dict[int, int]:
    """Count the viewports that have a keypoint of each landmark."""
    rows = session.execute(
        sa.select(Keypoint.landmark_id, sa.func.count())
        .where(Keypoint.landmark_id.in_(list(landmark_ids)))
        .group_by(Keypoint.landmark_id)
    )
    return {row[0]: row[1] for row in rows}


def viewport_names_of_landmark(session: Session, landmark_id: int) -> Sequence[str]:
    """Return the names of the viewports that have a keypoint of a landmark."""
    return session.scalars(
        sa.select(Viewport.name)
        .join(Keypoint, Keypoint.viewport_id == Viewport.id)
        .where(Keypoint.landmark_id == landmark_id)
        .order_by(Viewport.id)
    ).all()


def registration(session: Session, registration_id: int) -> Registration | None:
    """Return a registration by id."""
    return find(session, Registration, registration_id)


def registrations(
    session: Session, viewport_id: int, paging: Paging
) -> tuple[Sequence[Registration], str | None]:
    """Return a page of a viewport's registrations, oldest first."""
    statement = sa.select(Registration).where(Registration.viewport_id == viewport_id)
    return fetch_page(session, statement, Registration.id, paging)


def newest_poses(session: Session, viewport_ids: Iterable[int]) -> dict[int, Registration]:
    """Return, by viewport, the newest registration that has a camera pose."""
    newest = (
        sa.select(sa.func.max(Registration.id))
        .where(
            Registration.viewport_id.in_(list(viewport_ids)),
            Registration.center_lat_deg.is_not(None),
        )
        .group_by(Registration.viewport_id)
    )
    rows = session.scalars(sa.select(Registration).where(Registration.id.in_(newest)))
    return {row.viewport_id: row for row in rows}


def newest_by_method(session: Session, viewport_id: int) -> Sequence[Registration]:
    """Return the newest registration of each method, newest first."""
    newest = (
        sa.select(sa.func.max(Registration.id))
        .where(Registration.viewport_id == viewport_id)
        .group_by(Registration.method)
    )
    return session.scalars(
        sa.select(Registration).where(Registration.id.in_(newest)).order_by(Registration.id.desc())
    ).all()
