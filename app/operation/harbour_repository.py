"""SQL of the demo harbour: which of its parts are there already."""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.ais import AisFile
from app.tables.detection import Model, ModelStatus
from app.tables.groundtruth import VesselTruth
from app.tables.identity import User
from app.tables.imagery import Image
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


def detector_of_content(session: Session, sha256: str) -> str | None:
    """Return the name of the detector with these bytes."""
    return session.scalar(sa.select(Model.name).where(Model.sha256 == sha256))


def detector_status(session: Session, name: str) -> tuple[ModelStatus, str | None]:
    """Return whether a detector may be used, and why not."""
    row = session.execute(sa.select(Model.status, Model.reason).where(Model.name == name)).one()
    return row.status, row.reason


def newest_run(session: Session, viewport_id: int, detector: str) -> int | None:
    """Return the newest run on a viewport with a detector, by name."""
    return session.scalar(
        sa.select(sa.func.max(Run.id))
        .join(Model, Model.id == Run.model_id)
        .where(Run.viewport_id == viewport_id, Model.name == detector)
    )


def has_recording(session: Session, site_id: int, file_name: str) -> bool:
    """Whether a site has an AIS recording of a name."""
    statement = sa.select(AisFile.id).where(
        AisFile.site_id == site_id, AisFile.file_name == file_name
    )
    return session.scalars(statement).first() is not None


def names_of_images_with_truth(session: Session, camera_id: int) -> frozenset[str]:
    """Return the file names of a camera's images whose truth is stored."""
    statement = (
        sa.select(Image.file_name)
        .join(VesselTruth, VesselTruth.image_id == Image.id)
        .where(Image.camera_id == camera_id, Image.deleted_at.is_(None))
        .distinct()
    )
    return frozenset(session.scalars(statement))


def replace_truth(session: Session, image_id: int, rows: Sequence[VesselTruth]) -> None:
    """Store the truth of an image in the place of what was there."""
    session.execute(sa.delete(VesselTruth).where(VesselTruth.image_id == image_id))
    session.add_all(rows)


def anybody(session: Session) -> bool:
    """Whether there is any person yet."""
    return session.scalar(sa.select(User.id).limit(1)) is not None
