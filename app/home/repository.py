"""SQL of the first page: what a site has of all that leads to a graded pose."""

from dataclasses import dataclass

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.ais import AisFile
from app.tables.detection import Model, ModelStatus
from app.tables.exports import Export, ExportStatus
from app.tables.feeds import AisFeed
from app.tables.imagery import Image
from app.tables.queues import ReviewQueue, ReviewQueueItem
from app.tables.registration import Keypoint, Registration
from app.tables.reviews import Review
from app.tables.runs import Pose, Run, RunStatus
from app.tables.sites import Camera, Site, Viewport


@dataclass(frozen=True, slots=True)
class Facts:
    """Ids of the newest of each thing a site has (None: has none), and counts where they matter."""

    camera_id: int | None
    viewport_id: int | None
    images: int
    keypoints: int
    registered_viewport_id: int | None
    has_ais: bool
    has_detector: bool
    run_id: int | None
    run_with_poses_id: int | None
    graded: int
    exported: bool


def site_to_set_up(session: Session, site_ids: frozenset[int] | None) -> Site | None:
    """Return the site somebody is most likely setting up: the newest that is not simulated."""
    statement = sa.select(Site).order_by(Site.is_simulated, Site.id.desc()).limit(1)
    if site_ids is not None:
        statement = statement.where(Site.id.in_(site_ids))
    return session.scalars(statement).first()


def facts_of(session: Session, site_id: int) -> Facts:
    """Return what a site has, in one statement."""
    of_site = Camera.site_id == site_id
    viewports = sa.select(sa.func.max(Viewport.id)).join(Viewport.camera).where(of_site)
    keypoints = (
        sa.select(sa.func.count(Keypoint.id))
        .join(Viewport, Viewport.id == Keypoint.viewport_id)
        .join(Viewport.camera)
        .where(of_site)
    )
    registered = (
        sa.select(sa.func.max(Registration.viewport_id))
        .join(Registration.viewport)
        .join(Viewport.camera)
        .where(of_site)
    )
    recorded = sa.exists().where((AisFile.site_id == site_id) | AisFile.site_id.is_(None))
    fed = sa.exists().where(AisFeed.site_id == site_id, AisFeed.removed_at.is_(None))
    graded = (
        sa.select(sa.func.count(Review.id))
        .join(Pose, Pose.id == Review.pose_id)
        .join(Run, Run.id == Pose.run_id)
        .where(Run.site_id == site_id, Review.replaced_at.is_(None))
    )
    row = session.execute(
        sa.select(
            sa.select(sa.func.max(Camera.id)).where(of_site).scalar_subquery(),
            viewports.scalar_subquery(),
            sa.select(sa.func.count(Image.id))
            .where(Image.site_id == site_id, Image.deleted_at.is_(None))
            .scalar_subquery(),
            keypoints.scalar_subquery(),
            registered.scalar_subquery(),
            sa.or_(recorded, fed),
            sa.exists().where(Model.status == ModelStatus.READY),
            sa.select(sa.func.max(Run.id))
            .where(Run.site_id == site_id, Run.status == RunStatus.SUCCEEDED)
            .scalar_subquery(),
            sa.select(sa.func.max(Run.id))
            .where(Run.site_id == site_id, Run.status == RunStatus.SUCCEEDED)
            .where(sa.exists().where(Pose.run_id == Run.id))
            .scalar_subquery(),
            graded.scalar_subquery(),
            sa.exists().where(Export.status == ExportStatus.SUCCEEDED),
        )
    ).one()
    return Facts(*row)


def queues_of(session: Session, user_id: int, site_ids: frozenset[int] | None) -> list[ReviewQueue]:
    """Return the queues a person worked in that have work left, the last touched first."""
    item = ReviewQueueItem
    own = (
        sa.select(item.queue_id, sa.func.max(sa.func.coalesce(item.done_at, item.leased_until)))
        .where(item.user_id == user_id)
        .group_by(item.queue_id)
        .subquery()
    )
    left = sa.exists().where(item.queue_id == ReviewQueue.id, item.done_at.is_(None))
    statement = (
        sa.select(ReviewQueue)
        .join(own, own.c.queue_id == ReviewQueue.id)
        .join(ReviewQueue.run)
        .options(sa.orm.contains_eager(ReviewQueue.run))
        .where(left)
        .order_by(own.c[1].desc())
        .limit(1)
    )
    if site_ids is not None:
        statement = statement.where(Run.site_id.in_(site_ids))
    return list(session.scalars(statement))
