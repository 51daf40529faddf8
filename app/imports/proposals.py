"""Which patterns the names of files seem to follow, found in the names themselves.

A name is cut into runs of digits and what stands between them. A few readings of neighbouring runs
are tried: eight digits are a day, fourteen a day with its time, ten or thirteen a count of seconds
or milliseconds. A reading is a pattern, kept by how many of the names it makes sense of. Days such
as 03-04-2026 read two ways; where no name decides between them, both are told and a person does.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import PurePosixPath

from app.sites.name_pattern import told_by

EARLIEST_YEAR = 1995
MOST_NAMES = 500
MOST_PATTERNS = 4
_DIGITS = re.compile(r"\d+")
# What a run of so many digits may stand for.
_READINGS = {
    2: ("%H", "%M", "%S", "%m", "%d", "%y"),
    4: ("%Y", "%H%M"),
    6: ("%H%M%S", "%y%m%d"),
    8: ("%Y%m%d", "%d%m%Y", "%m%d%Y"),
    10: ("%s",),
    12: ("%Y%m%d%H%M", "%y%m%d%H%M%S"),
    13: ("%s%f",),
    14: ("%Y%m%d%H%M%S", "%d%m%Y%H%M%S", "%m%d%Y%H%M%S"),
    17: ("%Y%m%d%H%M%S%f",),
}
_DAYS = tuple(tuple(re.findall("%.", day)) for day in ("%Y%m%d", "%d%m%Y", "%m%d%Y", "%y%m%d"))
_CLOCKS = (("%H", "%M", "%S"), ("%H", "%M"))
_OTHER_ORDER = {"%d": "%m", "%m": "%d"}
# Behind a dash stands a counter more often than a fraction.
_FRACTION = re.compile(r"[.,]\d{1,6}(?!\d)")
_ZONE = re.compile(r"Z(?![A-Za-z0-9])|[+-]\d{2}:?\d{2}(?!\d)")


@dataclass(frozen=True, slots=True)
class Proposal:
    """A pattern, how many names it reads, and the pattern with day and month swapped.

    `swapped` is given where it reads all these names as well: a person has to say which one it is.
    """

    pattern: str
    name_count: int
    swapped: str | None
    example: str
    example_time: datetime


def propose(names: Iterable[str], not_after: datetime) -> list[Proposal]:
    """Return the patterns that together read the most names, the one that reads most first.

    `not_after` is the present: a reading that lies in the future is none.
    """
    left = list(islice(dict.fromkeys(PurePosixPath(name).stem for name in names), MOST_NAMES))
    found: list[Proposal] = []
    while left and len(found) < MOST_PATTERNS:
        best = _best(left, not_after)
        if best is None:
            break
        found.append(best)
        left = [
            name for name in left if not _plausible(told_by(f"{name}.", best.pattern), not_after)
        ]
    return found


def _best(names: Sequence[str], not_after: datetime) -> Proposal | None:
    best: Proposal | None = None
    tried: set[str] = set()
    for name in names[:20]:
        for pattern in _readings_of(name):
            if pattern in tried:
                continue
            tried.add(pattern)
            proposal = _judged(pattern, names, not_after)
            if proposal is not None and (best is None or _rank(proposal) > _rank(best)):
                best = proposal
    return best


def _rank(proposal: Proposal) -> tuple[int, int]:
    return proposal.name_count, len(re.findall("%.", proposal.pattern))


def _judged(pattern: str, names: Sequence[str], not_after: datetime) -> Proposal | None:
    read = [
        (name, moment)
        for name in names
        if (moment := _plausible(told_by(f"{name}.", pattern), not_after)) is not None
    ]
    if not read:
        return None
    swapped = re.sub(r"%[dm]", lambda letter: _OTHER_ORDER[letter[0]], pattern)
    # Nobody writes the year first and then the day before the month.
    is_ambiguous = pattern.startswith(("%d", "%m")) and all(
        _plausible(told_by(f"{name}.", swapped), not_after) for name, _ in read
    )
    return Proposal(pattern, len(read), swapped if is_ambiguous else None, *read[0])


def _plausible(moment: datetime | None, not_after: datetime) -> datetime | None:
    if moment is None or moment.year < EARLIEST_YEAR:
        return None
    aware = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return moment if aware <= not_after else None


def _readings_of(stem: str) -> Iterator[str]:
    """Yield the patterns that a name could be read by, from each of its runs of digits on."""
    runs = list(_DIGITS.finditer(stem))
    for first in range(len(runs)):
        for letters, last in _readings_from(runs, first):
            pattern = _with_gaps(stem, runs[first : last + 1], letters)
            yield from _with_tail(pattern, stem[runs[last].end() :])


def _readings_from(
    runs: Sequence[re.Match[str]], first: int
) -> Iterator[tuple[tuple[str, ...], int]]:
    """Yield what the runs from one on may mean together: a reading a run, and the last run."""
    lengths = [len(run[0]) for run in runs[first : first + 6]]
    for whole in _READINGS.get(lengths[0], ()):
        if whole.startswith("%s") or whole.count("%") >= 5:
            yield (whole,), first
    for day, used in _days(lengths):
        rest = lengths[used:]
        for clock in _clocks(rest):
            yield (*day, *clock), first + used + len(clock) - 1


def _days(lengths: Sequence[int]) -> Iterator[tuple[tuple[str, ...], int]]:
    for letters in _DAYS:
        wanted = [4 if letter == "%Y" else 2 for letter in letters]
        if list(lengths[:3]) == wanted:
            yield letters, 3
        if lengths[0] == sum(wanted):
            yield ("".join(letters),), 1


def _clocks(lengths: Sequence[int]) -> Iterator[tuple[str, ...]]:
    for clock in _CLOCKS:
        if list(lengths[: len(clock)]) == [2] * len(clock):
            yield clock
    if lengths and lengths[0] in {4, 6}:
        yield ("%H%M%S" if lengths[0] == 6 else "%H%M",)


def _with_gaps(stem: str, runs: Sequence[re.Match[str]], letters: Sequence[str]) -> str:
    parts = [letters[0]]
    for before, run, letter in zip(runs, runs[1:], letters[1:], strict=False):
        parts += [stem[before.end() : run.start()].replace("%", "%%"), letter]
    return "".join(parts)


def _with_tail(pattern: str, tail: str) -> Iterator[str]:
    """Yield a pattern as it is, and with a fraction or a zone where one follows."""
    yield pattern
    if pattern.endswith("%S") and (fraction := _FRACTION.match(tail)):
        yield f"{pattern}{tail[0]}%f"
        tail = tail[fraction.end() :]
        pattern = f"{pattern}{fraction[0][0]}%f"
    if _ZONE.match(tail):
        yield f"{pattern}%z"
