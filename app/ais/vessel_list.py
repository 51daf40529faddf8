"""The list of vessels in a view: by MMSI, or by pseudonym where those stand for them.

In the order of their MMSI pseudonyms would tell a good part of what they hide, as would a cursor.
So they are listed in their own order, for which all vessels of the site are gone through.
"""

import base64
from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.ais import repository
from app.identities.service import View
from app.paging import Paging, encode_cursor
from app.tables.ais import Vessel


def listed(
    session: Session, view: View, paging: Paging, search: str
) -> tuple[Sequence[Vessel], str | None]:
    """Return a part of the list and the next cursor; pseudonyms are searched by their start."""
    told, search = view.identities, search.strip()
    if not told.hidden:
        return repository.vessels(session, view.readable, paging, search)
    found = [
        (_number(name), vessel)
        for vessel in repository.all_vessels(session, view.readable)
        if (name := str(told.vessel(vessel.mmsi))).startswith(search.upper())
    ]
    found.sort(key=lambda pair: pair[0])
    rest = [pair for pair in found if paging.after is None or pair[0] > paging.after]
    page = rest[: paging.limit]
    cursor = encode_cursor(page[-1][0]) if len(rest) > paging.limit else None
    return [vessel for _, vessel in page], cursor


def _number(pseudonym: str) -> int:
    """Return the first 56 of a pseudonym's sixty bits, in the order of its letters."""
    return int.from_bytes(base64.b32decode(f"{pseudonym.removeprefix('V-')}===="), "big")
