"""What is hard to believe of stored positions, found when they are read.

Nothing is written beside a position: a later recording may bring the report that clears a doubt, or
raises one, and importing stays fast. A position costs four steps in an index.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from app.ais import doubt_repository
from app.ais.report_repository import Readable
from app.domain.plausibility import NEIGHBOURS, Doubt, ReportedFix, doubts

_AT_ONCE = 500  # ids of a statement: databases bound their number


def doubts_of(session: Session, readable: Readable, ids: Iterable[int]) -> dict[int, list[Doubt]]:
    """Return by id what is hard to believe of positions, given all their vessels' reports.

    Far away means far from the site that a position was heard for; one shared by all has none.
    """
    found: dict[int, list[Doubt]] = {}
    for part in _parts(dict.fromkeys(ids)):
        rows = doubt_repository.neighbour_rows(session, readable, part)
        fixes, suspect = _fixes(session, rows)
        for own, *neighbours, site_lat_deg, site_lon_deg in rows:
            known = [None if other is None else fixes[other] for other in neighbours]
            found[own] = doubts(
                fixes[own],
                [fix for fix in known[:NEIGHBOURS] if fix is not None],
                [fix for fix in known[NEIGHBOURS:] if fix is not None],
                None if site_lat_deg is None else (site_lat_deg, site_lon_deg),
            )
            if own in suspect and Doubt.RECEIVER_CLOCK not in found[own]:
                found[own].append(Doubt.RECEIVER_CLOCK)
    return found


def doubts_between(
    session: Session,
    readable: Readable,
    ids: Iterable[int],
    vessels: Collection[int],
    start: datetime,
    end: datetime,
) -> dict[int, list[Doubt]]:
    """Do what `doubts_of` does for many positions that some vessels reported in a while.

    All that these reported then is read at once. Whatever has a neighbour before or after that
    while is looked up by itself.
    """
    asked = set(ids)
    tracks: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
    if asked:
        for row in doubt_repository.track_rows(session, readable, vessels, start, end):
            tracks[row[1]].append(row)
    found: dict[int, list[Doubt]] = {}
    for rows in tracks.values():
        fixes = [ReportedFix(*row[1:7]) for row in rows]
        for place in range(NEIGHBOURS, len(rows) - NEIGHBOURS):
            own, *_, is_suspect, site_lat_deg, site_lon_deg = rows[place]
            if own not in asked:
                continue
            fix = fixes[place]
            before = fixes[place - NEIGHBOURS : place]
            after = fixes[place + 1 : place + 1 + NEIGHBOURS]
            # Of reports of one moment none is another's neighbour.
            if before[-1].fix_time < fix.fix_time < after[0].fix_time:
                site = None if site_lat_deg is None else (site_lat_deg, site_lon_deg)
                found[own] = doubts(fix, before, after, site)
                if is_suspect and Doubt.RECEIVER_CLOCK not in found[own]:
                    found[own].append(Doubt.RECEIVER_CLOCK)
    return found | doubts_of(session, readable, asked.difference(found))


def _fixes(
    session: Session, rows: Iterable[tuple[Any, ...]]
) -> tuple[dict[int, ReportedFix], set[int]]:
    """Read positions and neighbours, each once; and which came at times their receiver denies."""
    wanted = {identifier for row in rows for identifier in row[:-2] if identifier is not None}
    fixes: dict[int, ReportedFix] = {}
    suspect: set[int] = set()
    for part in _parts(wanted):
        for identifier, *told, is_suspect in doubt_repository.fix_rows(session, part):
            fixes[identifier] = ReportedFix(*told)
            if is_suspect:
                suspect.add(identifier)
    return fixes, suspect


def _parts(ids: Iterable[int]) -> Iterator[list[int]]:
    known = list(ids)
    for start in range(0, len(known), _AT_ONCE):
        yield known[start : start + _AT_ONCE]
