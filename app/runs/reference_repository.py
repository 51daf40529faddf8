"""SQL of the run that a site's others are measured by."""

from collections.abc import Collection

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.runs import ReferenceRun, Run
from app.tables.sites import Site


def of_site(session: Session, site_id: int) -> ReferenceRun | None:
    """Return what was chosen for a site."""
    return session.get(ReferenceRun, site_id)


def lock_site(session: Session, site_id: int) -> None:
    """Let choices for a site come one after the other (SQLite has one writer anyway)."""
    session.execute(sa.select(Site.id).where(Site.id == site_id).with_for_update())


def run_ids(session: Session, site_ids: Collection[int]) -> frozenset[int]:
    """Return the reference runs of some sites; deleted runs are none."""
    statement = (
        sa.select(Run.id)
        .join(ReferenceRun, ReferenceRun.run_id == Run.id)
        .where(Run.site_id.in_(site_ids))
    )
    return frozenset(session.scalars(statement))
