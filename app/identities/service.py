"""Who may see which vessels' identities: asked in one place, by every feature that tells of them.

A site shows vessels as MMSI and name, or as pseudonyms. With pseudonyms only those who may ingest
at the site (operators and administrators, who handle its receivers and raw recordings) see MMSI,
names, call signs and IMO numbers. A session knows who reads through it (`read_by`); the worker and
the command line, which act for the installation itself, read everything.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.errors import Invalid, NotFound
from app.identities import repository
from app.domain.pseudonyms import is_pseudonym, pseudonym
from app.identities.shown import Hidden, Identities, Shown, VesselId

NO_VESSEL = "there is no such vessel"
SEES_IDENTITIES = Scope.INGEST
_READER = "reader"
_KEYS = "keys_of_hiding_sites"
_SHOWN = Shown()


@dataclass(frozen=True, slots=True)
class View:
    """What a caller sees of AIS: reports of which sites (None: all), and how vessels are told."""

    readable: frozenset[int] | None
    identities: Identities


def read_by(session: Session, access: Access | None) -> None:
    """Say who reads through a session: what it tells of vessels is told to them."""
    session.info[_READER] = access


def at_site(session: Session, site_id: int | None) -> Identities:
    """Return what the session's reader is told of vessels at a site; None: of a shared recording.

    A shared recording belongs to all sites, so it tells identities to those who see them anywhere.
    """
    if _READER not in session.info:
        return _SHOWN
    if site_id is None:
        return everywhere(session).identities
    key = _hiding(session).get(site_id)
    reader: Access | None = session.info[_READER]
    if key is None or (reader is not None and reader.may(SEES_IDENTITIES, site_id)):
        return _SHOWN
    return Hidden(key)


def view(session: Session, access: Access, site_id: int | None) -> View:
    """Return the view from a site, or without one the widest that shows identities.

    Raises NotFound for a site that the caller may not read.
    """
    if site_id is None:
        return everywhere(session, access)
    access.require(Scope.READ, site_id)
    return View(frozenset({site_id}), at_site(session, site_id))


def everywhere(session: Session, access: Access | None = None) -> View:
    """Return the view of all sites that show identities; where none does, of the first."""
    reader: Access | None = access or session.info.get(_READER)
    readable = frozenset[int]() if reader is None else reader.site_ids(Scope.READ)
    hiding = [
        site_id
        for site_id in _hiding(session)
        if (readable is None or site_id in readable) and at_site(session, site_id).hidden
    ]
    if not hiding:
        return View(readable, _SHOWN)
    shown = (all_sites(session) if readable is None else readable) - {*hiding}
    if shown:
        return View(shown, _SHOWN)
    return View(frozenset({hiding[0]}), at_site(session, hiding[0]))


def found(session: Session, access: Access, reference: str) -> tuple[View, int]:
    """Return the vessel that an MMSI or a pseudonym stands for, and the view it is seen in.

    Raises NotFound; also for the MMSI of a vessel, existing or not, where the caller sees only
    pseudonyms, so that nobody can find out a vessel's pseudonym by asking for it.
    """
    if reference.isascii() and reference.isdigit() and len(reference) <= 9:
        seen = everywhere(session, access)
        if seen.identities.hidden:
            raise NotFound(NO_VESSEL)
        return seen, int(reference)
    if is_pseudonym(reference):
        readable = access.site_ids(Scope.READ)
        for site_id, key in _hiding(session).items():
            if readable is None or site_id in readable:
                mmsi = _behind(session, key, reference)
                if mmsi is not None:
                    return View(frozenset({site_id}), at_site(session, site_id)), mmsi
    raise NotFound(NO_VESSEL)


def searched(
    session: Session, access: Access, given: VesselId | None
) -> tuple[frozenset[int] | None, int | None]:
    """Return the sites (None: all) and the MMSI to search by for a vessel as a caller calls it.

    Raises NotFound, as `found` does.
    """
    if given is None:
        return access.site_ids(Scope.READ), None
    seen, mmsi = found(session, access, str(given))
    return seen.readable, mmsi


def mmsi_at(session: Session, site_id: int, given: VesselId, field: str = "mmsi") -> int:
    """Return the MMSI of a vessel as the session's reader calls it at a site.

    Raises Invalid naming the field.
    """
    identities = at_site(session, site_id)
    if isinstance(given, int):
        if identities.hidden:
            raise Invalid.field(field, "give the vessel's pseudonym; MMSI are not shown here")
        return given
    key = repository.keys(session, [site_id]).get(site_id)
    mmsi = None if key is None else _behind(session, key, given)
    if mmsi is None:
        raise Invalid.field(field, "there is no vessel of this name")
    return mmsi


def keys(session: Session, site_ids: Iterable[int]) -> Mapping[int, bytes]:
    """Return sites' keys, for exports."""
    return repository.keys(session, list(site_ids))


def hidden_from(session: Session, access: Access) -> frozenset[int]:
    """Return the sites that show a caller pseudonyms."""
    return frozenset(
        site_id for site_id in _hiding(session) if not access.may(SEES_IDENTITIES, site_id)
    )


def all_sites(session: Session) -> frozenset[int]:
    """Return all sites."""
    return frozenset(repository.site_ids(session))


def _hiding(session: Session) -> Mapping[int, bytes]:
    known: Mapping[int, bytes] | None = session.info.get(_KEYS)
    if known is None:
        known = session.info[_KEYS] = repository.hiding_sites(session)
    return known


def _behind(session: Session, key: bytes, reference: str) -> int | None:
    """Try all vessels ever heard: a microsecond each, and nothing kept that leads back."""
    vessels = repository.mmsis(session)
    return next((mmsi for mmsi in vessels if pseudonym(mmsi, key) == reference), None)
