"""SQL of identities: which sites hide them, with which keys, and the vessels they hide."""

from collections.abc import Collection, Mapping, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.ais import Vessel
from app.tables.sites import Site


def hiding_sites(session: Session) -> Mapping[int, bytes]:
    """Return the keys of the sites that show pseudonyms, by site."""
    rows = session.execute(
        sa.select(Site.id, Site.pseudonym_key).where(Site.shows_pseudonyms).order_by(Site.id)
    )
    return {row[0]: row[1] for row in rows}


def keys(session: Session, site_ids: Collection[int]) -> Mapping[int, bytes]:
    """Return the keys of some sites."""
    rows = session.execute(sa.select(Site.id, Site.pseudonym_key).where(Site.id.in_(site_ids)))
    return {row[0]: row[1] for row in rows}


def site_ids(session: Session) -> Sequence[int]:
    """Return all sites."""
    return session.scalars(sa.select(Site.id)).all()


def mmsis(session: Session) -> Sequence[int]:
    """Return all vessels ever heard."""
    return session.scalars(sa.select(Vessel.mmsi)).all()
