"""Which patterns the names of files seem to follow, found in the names themselves.

A name is cut into runs of digits and what stands between them. A few readings of neighbouring runs
are tried: eight digits are a day, fourteen a day with its time, ten or thirteen a count of seconds
or milliseconds. A reading is a pattern, kept by how many of the names it makes sense of; of names
that tell nothing, the folders are read too. Days such as 03-04-2026 read two ways, and 03-04-26
three; where no name decides between them, the likeliest two are told and a person decides.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import PurePosixPath

from app.sites.name_pattern import has_shape, told_by

EARLIEST_YEAR = 1995
MOST_NAMES = 500
MOST_PATTERNS = 8
_DIGITS = re.compile(r"\d+")
# What a run of so many digits may stand for by itself.
_READINGS = {
    10: ("%s",),
    12: ("%Y%m%d%H%M", "%y%m%d%H%M%S", "%d%m%y%H%M%S", "%m%d%y%H%M%S"),
    13: ("%s%f",),
    14: ("%Y%m%d%H%M%S", "%d%m%Y%H%M%S", "%m%d%Y%H%M%S"),
    17: ("%Y%m%d%H%M%S%f",),
}
_SHORT_DAYS = ("%d%m%y", "%m%d%y", "%y%m%d")
_DAYS = tuple(
    tuple(re.findall("%.", day)) for day in ("%Y%m%d", "%d%m%Y", "%m%d%Y", "%Y%j", *_SHORT_DAYS)
)
_DIGITS_OF = {"%Y": 4, "%j": 3}
_CLOCKS = (("%H", "%M", "%S"), ("%H", "%M"))
_TOGETHER = {4: "%H%M", 6: "%H%M%S", 9: "%H%M%S%f"}
_OTHER_ORDER = {"%d": "%m", "%m": "%d"}
# Words between a day and its time; WA, CAM and their like come before counters.
_BETWEEN = re.compile(r"(?:[^A-Za-z]|[Tt]|(?<![A-Za-z])(?:at|um|om|kl|a|las)(?![A-Za-z])|[hms])*")
_MOST_COUNTERS = 0.2  # of what is read: so much that looks the same may be no moment
# Behind a dash stands a counter more often than a fraction.
_FRACTION = re.compile(r"[.,]\d{1,6}(?!\d)")
_ZONE = re.compile(r"Z(?![A-Za-z0-9])|[+-]\d{2}:?\d{2}(?!\d)")


@dataclass(frozen=True, slots=True)
class Proposal:
    """A pattern, how many names it reads, and the pattern with the parts of the day in other order.

    `swapped` is given where it reads all these names as well: a person has to say which one it is.
    """

    pattern: str
    name_count: int
    swapped: str | None
    example: str
    example_time: datetime


def propose(paths: Iterable[str], not_after: datetime) -> list[Proposal]:
    """Return the patterns that together read the most paths, the one that reads most first.

    `not_after` is the present: a reading that lies in the future is none.
    """
    left = [PurePosixPath(path) for path in islice(dict.fromkeys(paths), MOST_NAMES)]
    found: list[Proposal] = []
    for told_in in (_name_of, _folders_and_name_of):
        while left and len(found) < MOST_PATTERNS:
            names = list(dict.fromkeys(map(told_in, left)))
            best = _best(names, not_after)
            if best is None:
                break
            found.append(best)
            left = [path for path in left if not _read(told_in(path), best.pattern, not_after)]
    return found


def _name_of(path: PurePosixPath) -> str:
    return path.stem


def _folders_and_name_of(path: PurePosixPath) -> str:
    return f"{path.parent}/{path.stem}"


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


def _rank(proposal: Proposal) -> tuple[int, int, datetime]:
    """Compare by names read and letters used; of two orders of a day, the later is likelier."""
    moment = proposal.example_time
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return proposal.name_count, len(re.findall("%.", proposal.pattern)), moment


def _judged(pattern: str, names: Sequence[str], not_after: datetime) -> Proposal | None:
    read = [
        (name, moment) for name in names if (moment := _read(name, pattern, not_after)) is not None
    ]
    counters = sum(
        has_shape(f"{name}.", pattern) and told_by(f"{name}.", pattern) is None for name in names
    )
    if not read or counters > _MOST_COUNTERS * len(read):
        return None
    # Of other orders that read all these names the one that comes nearest to the present.
    others = [
        (moment, other)
        for other in _other_orders(pattern)
        if all(_read(name, other, not_after) for name, _ in read)
        and (moment := _read(read[0][0], other, not_after))
    ]
    likeliest = max(others)[1] if others else None
    return Proposal(pattern, len(read), likeliest, *read[0])


def _other_orders(pattern: str) -> Iterator[str]:
    """Yield a pattern with the parts of its day in other orders, as people do write them."""
    if "%y" in pattern:
        parts = re.split("(%[dmy])", pattern)
        for day in _SHORT_DAYS:
            parts[1::2] = re.findall("%.", day)
            if (other := "".join(parts)) != pattern:
                yield other
    elif -1 < pattern.find("%d") < pattern.find("%Y"):
        # Nobody writes the year first and then the day before the month.
        yield re.sub(r"%[dm]", lambda letter: _OTHER_ORDER[letter[0]], pattern)


def _read(name: str, pattern: str, not_after: datetime) -> datetime | None:
    return _plausible(told_by(f"{name}.", pattern), not_after)


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
            if pattern:
                yield from _with_tail(pattern, stem[runs[last].end() :])


def _readings_from(
    runs: Sequence[re.Match[str]], first: int
) -> Iterator[tuple[tuple[str, ...], int]]:
    """Yield what the runs from one on may mean together: a reading a run, and the last run."""
    lengths = [len(run[0]) for run in runs[first : first + 6]]
    for whole in _READINGS.get(lengths[0], ()):
        yield (whole,), first
    for day, used in _days(lengths):
        rest = lengths[used:]
        for clock in _clocks(rest):
            yield (*day, *clock), first + used + len(clock) - 1


def _days(lengths: Sequence[int]) -> Iterator[tuple[tuple[str, ...], int]]:
    for letters in _DAYS:
        wanted = [_DIGITS_OF.get(letter, 2) for letter in letters]
        if _fit(lengths, wanted):
            yield letters, len(letters)
        if lengths[0] == sum(wanted):
            yield ("".join(letters),), 1


def _clocks(lengths: Sequence[int]) -> Iterator[tuple[str, ...]]:
    for clock in _CLOCKS:
        if _fit(lengths, [2] * len(clock)) and 1 not in lengths[1 : len(clock)]:
            yield clock
    if lengths and lengths[0] in _TOGETHER:
        yield (_TOGETHER[lengths[0]],)


def _fit(lengths: Sequence[int], wanted: Sequence[int]) -> bool:
    """Whether runs of digits are as long as wanted; of two digits a leading zero may be missing."""
    return len(lengths) >= len(wanted) and all(
        length == most or (length, most) == (1, 2)
        for length, most in zip(lengths, wanted, strict=False)
    )


def _with_gaps(stem: str, runs: Sequence[re.Match[str]], letters: Sequence[str]) -> str:
    """Return the pattern of neighbouring runs; empty where a word between them speaks against."""
    parts = [letters[0]]
    for before, run, letter in zip(runs, runs[1:], letters[1:], strict=False):
        gap = stem[before.end() : run.start()]
        if not _BETWEEN.fullmatch(gap):
            return ""
        parts += [gap.replace("%", "%%"), letter]
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
