"""Counting verdicts: grades, reasons, and the two shares people ask for."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from app.domain.sampling import Share
from app.evaluation.review_repository import Verdict
from app.tables.reviews import Grade


@dataclass(frozen=True, slots=True)
class Tally:
    """Verdicts by grade, and by reason within a grade; a verdict may give several reasons."""

    grades: Mapping[Grade, int]
    reasons: Mapping[Grade, Mapping[str, int]]

    @property
    def graded(self) -> int:
        """How many verdicts there are."""
        return sum(self.grades.values())

    @property
    def good(self) -> Share:
        """The share of Good among the graded."""
        return Share(self.grades[Grade.GOOD], self.graded)

    @property
    def acceptable(self) -> Share:
        """The share of Good and OK among the graded (paper, evaluation)."""
        return Share(self.grades[Grade.GOOD] + self.grades[Grade.OK], self.graded)


def tally(verdicts: Iterable[Verdict]) -> Tally:
    """Count verdicts; every grade is there, if only with 0."""
    grades = dict.fromkeys(Grade, 0)
    reasons: dict[Grade, Counter[str]] = {grade: Counter() for grade in Grade}
    for verdict in verdicts:
        grades[verdict.grade] += 1
        if verdict.reasons:
            reasons[verdict.grade].update(verdict.reasons)
    return Tally(grades, {grade: dict(found.most_common()) for grade, found in reasons.items()})
