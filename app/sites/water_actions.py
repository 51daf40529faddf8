"""What callers do with a site's water levels: the change and the audit line together."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.auth.access import Access
from app.auth.audit import record
from app.sites import water_repository as repository
from app.sites.water import Reading, Series, series_of
from app.tables.sites import Site


def replace(session: Session, access: Access, site: Site, readings: Sequence[Reading]) -> Series:
    """Make these the site's series."""
    repository.replace(session, site.id, readings)
    count = len(readings)
    record(session, access, "replace", "water_levels", site.id, site.id, readings=count)
    return series_of(session, site)


def remove(session: Session, access: Access, site: Site) -> None:
    """Remove a site's series; its constant level holds again."""
    repository.replace(session, site.id, [])
    record(session, access, "delete", "water_levels", site.id, site.id)
