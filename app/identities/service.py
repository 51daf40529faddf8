"""Who may see which vessels' identities: asked in one place, by every feature that tells of them.

A site shows vessels as MMSI and name, or as pseudonyms. With pseudonyms only those who may ingest
at the site (operators and administrators, who handle its receivers and raw recordings) see MMSI,
names, call signs and IMO numbers. A session knows who reads through it (`read_by`); the worker and
the command line, which act for the installation itself, read everything.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.domain.pseudonyms import is_pseudonym, pseudonym
from app.errors import Invalid, NotFound
from app.identities import repository
from app.identities.shown import Hidden, Identities, Shown, VesselId

NO_VESSEL = "there is no such vessel"
_MMSI_DIGITS = 9
_READER = "reader"
_KEYS = "keys_of_hiding_sites"
_SHOWN = Shown()
Sites = frozenset[int] | None
"""Sites by id; None for all of them."""


@dataclass(frozen=True, slots=True)
class Reader:
    """Who reads: the sites they may read, and those where they may see who vessels are."""

    readable: Sites
    trusted: Sites

    def may_read(self, site_id: int) -> bool:
        """Whether a site is among those they may read."""
        return self.readable is None or site_id in self.readable

    def is_trusted(self, site_id: int) -> bool:
        """Whether they may see who vessels are at a site, whatever it shows to others."""
        return self.trusted is None or site_id in self.trusted


EVERYTHING = Reader(None, None)
NOTHING = Reader(frozenset(), frozenset())


@dataclass(frozen=True, slots=True)
class View:
    """What a reader sees of AIS: reports of which sites, and how vessels are told."""

    readable: Sites
    identities: Identities


def read_by(session: Session, reader: Reader) -> None:
    """Say who reads through a session: what it tells of vessels is told to them."""
    session.info[_READER] = reader


def at_site(session: Session, site_id: int | None) -> Identities:
    """Return what the session's reader is told of vessels at a site; None: of a shared recording.

    A shared recording belongs to all sites, so it tells identities to those who see them anywhere.
    """
    if site_id is None:
        return everywhere(session).identities
    if _reader(session).is_trusted(site_id):
        return _SHOWN
    key = _hiding(session).get(site_id)
    return _SHOWN if key is None else Hidden(key)


def view(session: Session, site_id: int | None) -> View:
    """Return the view from a site that the reader may read; without one, `everywhere`."""
    if site_id is None:
        return everywhere(session)
    return View(frozenset({site_id}), at_site(session, site_id))


def everywhere(session: Session) -> View:
    """Return the view of all sites that show identities; where none does, of the first."""
    readable = _reader(session).readable
    hiding = hidden(session)
    if not hiding:
        return View(readable, _SHOWN)
    shown = (all_sites(session) if readable is None else readable) - hiding
    if shown:
        return View(shown, _SHOWN)
    first = min(hiding)
    return View(frozenset({first}), at_site(session, first))


def hidden(session: Session) -> frozenset[int]:
    """Return the sites that show pseudonyms to the session's reader."""
    reader = _reader(session)
    if reader.trusted is None:
        return frozenset()
    return frozenset(
        site_id
        for site_id in _hiding(session)
        if reader.may_read(site_id) and not reader.is_trusted(site_id)
    )


def all_sites(session: Session) -> frozenset[int]:
    """Return all sites."""
    return frozenset(repository.site_ids(session))


def found(session: Session, reference: VesselId) -> tuple[View, int]:
    """Return the vessel that an MMSI or a pseudonym stands for, and the view it is seen in.

    Raises NotFound; also for the MMSI of a vessel, existing or not, where the reader sees only
    pseudonyms, so that nobody can find out a vessel's pseudonym by asking for it.
    """
    text = str(reference)
    if text.isascii() and text.isdigit() and len(text) <= _MMSI_DIGITS:
        seen = everywhere(session)
        if seen.identities.hidden:
            raise NotFound(NO_VESSEL)
        return seen, int(text)
    if is_pseudonym(text):
        for site_id, key in _hiding(session).items():
            if _reader(session).may_read(site_id):
                mmsi = _behind(session, key, text)
                if mmsi is not None:
                    return view(session, site_id), mmsi
    raise NotFound(NO_VESSEL)


def searched(session: Session, given: VesselId | None) -> tuple[Sites, int | None]:
    """Return the sites and the MMSI to search by for a vessel as the reader calls it.

    Raises NotFound, as `found` does.
    """
    if given is None:
        return _reader(session).readable, None
    seen, mmsi = found(session, given)
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


def _reader(session: Session) -> Reader:
    reader: Reader = session.info.get(_READER, EVERYTHING)
    return reader


def _hiding(session: Session) -> Mapping[int, bytes]:
    known: Mapping[int, bytes] | None = session.info.get(_KEYS)
    if known is None:
        known = session.info[_KEYS] = repository.hiding_sites(session)
    return known


def _behind(session: Session, key: bytes, reference: str) -> int | None:
    """Try all vessels ever heard: a microsecond each, and nothing kept that leads back."""
    vessels = repository.mmsis(session)
    return next((mmsi for mmsi in vessels if pseudonym(mmsi, key) == reference), None)
