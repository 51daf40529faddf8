"""Vessels' identities in an export: shown, or hidden behind pseudonyms.

A pseudonym is a keyed hash, the same in every export of a site and on its pages, so that a vessel
can be followed through a data set and not be traced from it. A file name may tell an identity too,
and is then replaced by the photograph's own hash. What stays is said in `REMAINS`.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import PurePath

from app.domain.pseudonyms import pseudonym

REMAINS = (
    "Without identities a file holds no MMSI, name, call sign, comment or person. It still holds "
    "times, places, headings and sizes, photographs' SHA-256 and the names of files that tell no "
    "vessel with a pose: whoever has an AIS archive of the same water can find vessels again by "
    "time and place."
)
MMSI_DIGITS = 9
SHORTEST_NAME = 3
_NO_LETTERS = re.compile(r"[\W_]+")
_DIGITS = re.compile(rf"[0-9]{{{MMSI_DIGITS},}}")


class Shown:
    """The MMSI, and file names as they are; some vessels by names of their own."""

    def __init__(self, names: Mapping[int, str] | None = None) -> None:
        self._names = names or {}

    def vessel(self, mmsi: int) -> str:
        """Return the MMSI, or the vessel's own name."""
        return self._names.get(mmsi) or str(mmsi)

    def file_name(self, name: str, sha256: str) -> str:  # noqa: ARG002  Identities
        """Return the name as it is."""
        return name


class Hidden:
    """A site's pseudonyms; `vessels` (MMSI, name) are those that no file name may tell."""

    def __init__(self, key: bytes, vessels: Iterable[tuple[int, str | None]]) -> None:
        self._key = key
        self._told: dict[int, str] = {}
        self._mmsis: set[str] = set()
        self._names: dict[str, set[str]] = {}  # by their first letters
        for mmsi, name in vessels:
            self._mmsis.add(f"{mmsi:0{MMSI_DIGITS}}")
            letters = _letters(name or "")
            if len(letters) >= SHORTEST_NAME:
                self._names.setdefault(letters[:SHORTEST_NAME], set()).add(letters)

    def vessel(self, mmsi: int) -> str:
        """Return the vessel's pseudonym."""
        if mmsi not in self._told:
            self._told[mmsi] = pseudonym(mmsi, self._key)
        return self._told[mmsi]

    def file_name(self, name: str, sha256: str) -> str:
        """Return the name, or one made of the content where it tells a vessel."""
        if not self._tells(name):
            return name
        suffix = PurePath(name).suffix
        return sha256 if self._tells(suffix) else f"{sha256}{suffix}"

    def _tells(self, name: str) -> bool:
        for digits in _DIGITS.findall(name):
            windows = range(len(digits) - MMSI_DIGITS + 1)
            if any(digits[at : at + MMSI_DIGITS] in self._mmsis for at in windows):
                return True
        letters = _letters(name)
        places = range(len(letters) - SHORTEST_NAME + 1)
        if self._names.keys().isdisjoint([letters[at : at + SHORTEST_NAME] for at in places]):
            return False
        return any(
            letters.startswith(vessel, at)
            for at in places
            for vessel in self._names.get(letters[at : at + SHORTEST_NAME], ())
        )


def _letters(text: str) -> str:
    """Return a text without what people leave out in file names: case, blanks, dots, dashes."""
    return _NO_LETTERS.sub("", text.casefold())
