"""What callers do with a site's water levels: the change and the audit line together."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.auth.access import Access
from app.auth.audit import record
from app.deletions import service as deletions
from app.sites import water_repository as repository
from app.sites.water import Reading, Series, series_of
from app.tables.sites import Site


def replace(session: Session, access: Access, site: Site, readings: Sequence[Reading]) -> Series:
    """Make these the site's series; the one before can be restored for 30 days."""
    _delete(session, access, site)
    repository.insert(session, site.id, readings)
    count = len(readings)
    record(session, access, "replace", "water_levels", site.id, site.id, readings=count)
    return series_of(session, site)


def remove(session: Session, access: Access, site: Site) -> None:
    """Delete a site's series for 30 days; its constant level holds again."""
    _delete(session, access, site)
    record(session, access, "delete", "water_levels", site.id, site.id)


def _delete(session: Session, access: Access, site: Site) -> None:
    if repository.has_readings(session, site.id):
        deletions.delete(
            session,
            "water_levels",
            [site.id],
            site_id=site.id,
            label=f"water levels of {site.name}",
            user_id=access.user_id,
        )
