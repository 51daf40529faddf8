"""SQL of the demo harbour: which of its parts are there already."""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.detection import Model
from app.tables.groundtruth import VesselTruth
from app.tables.identity import User
from app.tables.runs import Run
from app.tables.sites import Camera, Site, Viewport


def simulated_site(session: Session, name: str) -> Site | None:
    """Return the simulated site of a name."""
    return session.scalars(sa.select(Site).where(Site.is_simulated, Site.name == name)).first()


def first_camera(session: Session, site_id: int) -> Camera | None:
    """Return a site's first camera."""
    return session.scalars(
        sa.select(Camera).where(Camera.site_id == site_id).order_by(Camera.id)
    ).first()


def viewports(session: Session, camera_id: int) -> Sequence[Viewport]:
    """Return a camera's viewports in the order they were made."""
    return session.scalars(
        sa.select(Viewport).where(Viewport.camera_id == camera_id).order_by(Viewport.id)
    ).all()


def has_detector(session: Session, name: str) -> bool:
    """Whether there is a detector of a name."""
    return session.scalar(sa.select(Model.id).where(Model.name == name)) is not None


def newest_run(session: Session, viewport_id: int) -> int | None:
    """Return the newest run on a viewport."""
    return session.scalar(sa.select(sa.func.max(Run.id)).where(Run.viewport_id == viewport_id))


def replace_truth(session: Session, image_id: int, rows: Sequence[VesselTruth]) -> None:
    """Store the truth of an image in the place of what was there."""
    session.execute(sa.delete(VesselTruth).where(VesselTruth.image_id == image_id))
    session.add_all(rows)


def anybody(session: Session) -> bool:
    """Whether there is any person yet."""
    return session.scalar(sa.select(User.id).limit(1)) is not None
