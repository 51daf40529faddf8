"""What a caller is told of a vessel: itself, or its pseudonym and nothing that names it.

Names, call signs and IMO numbers name a vessel as its MMSI does. Type, size, place and time stay:
without them there is no work to do, and with a public AIS archive they can still lead back.
"""

from typing import Protocol

from app.domain.pseudonyms import pseudonym

VesselId = int | str
"""An MMSI, or for a caller who may not see identities a pseudonym."""


class Identities(Protocol):
    """What is told of vessels to one caller at one site."""

    @property
    def hidden(self) -> bool:
        """Whether pseudonyms stand for vessels."""
        ...

    def vessel(self, mmsi: int) -> VesselId:
        """Return what stands for a vessel."""
        ...

    def name(self, text: str | None) -> str | None:
        """Return a name, a call sign or a file name as it may be told."""
        ...

    def number(self, value: int | None) -> int | None:
        """Return an IMO number as it may be told."""
        ...


class Shown:
    """Everything as it is."""

    hidden = False

    def vessel(self, mmsi: int) -> VesselId:
        """Return the MMSI."""
        return mmsi

    def name(self, text: str | None) -> str | None:
        """Return the text as it is."""
        return text

    def number(self, value: int | None) -> int | None:
        """Return the number as it is."""
        return value


class Hidden:
    """Pseudonyms made with a site's key."""

    hidden = True

    def __init__(self, key: bytes) -> None:
        self._key = key

    def vessel(self, mmsi: int) -> VesselId:
        """Return the vessel's pseudonym at the site."""
        return pseudonym(mmsi, self._key)

    def name(self, text: str | None) -> str | None:  # noqa: ARG002  Identities
        """Return nothing: it would name the vessel."""
        return None

    def number(self, value: int | None) -> int | None:  # noqa: ARG002  Identities
        """Return nothing: it would name the vessel."""
        return None


def title_of(vessel: VesselId, name: str | None) -> str:
    """Return what to call a vessel: its name, else its number or pseudonym."""
    if name:
        return name
    return f"MMSI {vessel}" if isinstance(vessel, int) else f"Vessel {vessel}"
