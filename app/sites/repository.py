"""The SQL of sites and cameras."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import sqlalchemy as sa
from sqlalchemy.orm import Session, joinedload

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.ais import AisFile
from app.tables.imagery import Image
from app.tables.registration import Registration
from app.tables.runs import Run
from app.tables.sites import Camera, Site, Viewport


@dataclass(frozen=True, slots=True)
class SiteCounts:
    """How much there is on a site."""

    cameras: int
    images: int
    ais_files: int
    runs: int


def site(session: Session, site_id: int) -> Site | None:
    """Return a site by id."""
    return find(session, Site, site_id)


def camera(session: Session, camera_id: int) -> Camera | None:
    """Return a camera by id."""
    return find(session, Camera, camera_id)


def sites(
    session: Session, site_ids: frozenset[int] | None, paging: Paging
) -> tuple[Sequence[Site], str | None]:
    """Return a page of the sites among `site_ids` (all when None)."""
    statement = sa.select(Site)
    if site_ids is not None:
        statement = statement.where(Site.id.in_(site_ids))
    return fetch_page(session, statement, Site.id, paging)


def cameras(
    session: Session, site_ids: frozenset[int] | None, site_id: int | None, paging: Paging
) -> tuple[Sequence[Camera], str | None]:
    """Return a page of the cameras of the sites `site_ids` (all when None), or of one of them."""
    statement = sa.select(Camera).options(joinedload(Camera.site))
    if site_ids is not None:
        statement = statement.where(Camera.site_id.in_(site_ids))
    if site_id is not None:
        statement = statement.where(Camera.site_id == sa.literal(site_id, sa.BigInteger()))
    return fetch_page(session, statement, Camera.id, paging)


def site_id_of_viewport(session: Session, viewport_id: int) -> int | None:
    """Return the site a viewport belongs to."""
    viewport = find(session, Viewport, viewport_id)
    return viewport.camera.site_id if viewport else None


def lock_camera(session: Session, camera_id: int) -> None:
    """Keep others from changing what hangs on a camera until this transaction ends.

    On SQLite the transaction is the only writer anyway.
    """
    session.execute(sa.select(Camera.id).where(Camera.id == camera_id).with_for_update())


def count_registrations(session: Session, site_id: int) -> int:
    """Count the registrations whose pose is expressed in a site's frame."""
    return (
        session.scalar(
            sa.select(sa.func.count())
            .select_from(Registration)
            .join(Viewport, Registration.viewport_id == Viewport.id)
            .join(Camera, Viewport.camera_id == Camera.id)
            .where(Camera.site_id == site_id)
        )
        or 0
    )


def count_images(session: Session, camera_id: int) -> int:
    """Count the images of a camera."""
    statement = sa.select(sa.func.count()).select_from(Image).where(Image.camera_id == camera_id)
    return session.scalar(statement) or 0


def site_counts(session: Session, site_ids: Iterable[int]) -> dict[int, SiteCounts]:
    """Count what there is on sites: cameras, images, AIS recordings (shared ones too), runs."""
    ids = list(site_ids)
    cameras = _by_site(session, Camera.site_id, Camera.site_id.in_(ids))
    images = _by_site(session, Image.site_id, Image.site_id.in_(ids), Image.deleted_at.is_(None))
    files = _by_site(session, AisFile.site_id)
    runs = _by_site(session, Run.site_id, Run.site_id.in_(ids))
    shared = files.get(None, 0)
    return {
        site_id: SiteCounts(
            cameras.get(site_id, 0),
            images.get(site_id, 0),
            files.get(site_id, 0) + shared,
            runs.get(site_id, 0),
        )
        for site_id in ids
    }


def _by_site(
    session: Session,
    site_id: sa.orm.InstrumentedAttribute[int] | sa.orm.InstrumentedAttribute[int | None],
    *conditions: sa.ColumnElement[bool],
) -> dict[int | None, int]:
    statement = sa.select(site_id, sa.func.count()).where(*conditions).group_by(site_id)
    return {row[0]: row[1] for row in session.execute(statement)}
