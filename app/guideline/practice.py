"""Calibration sets: judged poses, and going through them.

The first grade of a pose in an attempt counts, because only that one was given blind; grading again
answers with the first. Nothing of it touches the reviews of the run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from random import Random

from sqlalchemy.orm import Session

from app.deletions import service as deletions
from app.domain.agreement import Kappa, cohens_kappa
from app.domain.grading import GUIDELINE_VERSION, check_reasons
from app.errors import Conflict, Invalid, NotFound
from app.guideline import repository
from app.guideline.truth import judged_by_truth
from app.paging import Paging
from app.runs import service as runs
from app.tables.practice import CalibrationSet, JudgedPose, PracticeAttempt, PracticeGrade
from app.tables.reviews import Grade
from app.tables.runs import Run

MOST_POSES = 200
_CATEGORIES = {grade: number for number, grade in enumerate(Grade)}


@dataclass(frozen=True, slots=True)
class Judged:
    """A judgement as somebody gives it."""

    pose_id: int
    grade: Grade
    reasons: Sequence[str]
    note: str


@dataclass(frozen=True, slots=True)
class Compared:
    """A judged pose beside what a person answered; None where they have not yet."""

    judged: JudgedPose
    answer: PracticeGrade | None

    @property
    def agrees(self) -> bool:
        """Whether the answer is the judged grade."""
        return self.answer is not None and self.answer.grade == self.judged.grade


@dataclass(frozen=True, slots=True)
class Result:
    """How an attempt went; `kappa` compares the answers with the judgements."""

    attempt: int
    poses: Sequence[Compared]
    kappa: Kappa

    @property
    def answered(self) -> int:
        """How many poses were answered."""
        return self.kappa.units

    @property
    def percent(self) -> float | None:
        """Answers that agree, percent; None before the first."""
        return 100 * self.kappa.agreed / self.kappa.units if self.kappa.units else None


def get_set(session: Session, set_id: int) -> CalibrationSet:
    """Return a calibration set with its run. Raises NotFound."""
    found = repository.get(session, set_id)
    if found is None:
        raise NotFound("there is no such calibration set")
    return found


def list_sets(
    session: Session, site_ids: frozenset[int] | None, run_id: int | None, paging: Paging
) -> tuple[Sequence[CalibrationSet], str | None]:
    """Return a page of the sets of some sites (None: all)."""
    return repository.listed(session, site_ids, run_id, paging)


def counts(session: Session, sets: Sequence[CalibrationSet]) -> Mapping[int, int]:
    """Count the poses of some sets."""
    return repository.counts(session, [found.id for found in sets])


def create_set(
    session: Session, run: Run, name: str, judgements: Sequence[Judged], user_id: int | None
) -> CalibrationSet:
    """Store a set of poses a person judged. Raises Invalid for foreign poses and wrong reasons."""
    known = repository.poses_of_run(session, run.id, {judged.pose_id for judged in judgements})
    for judged in judgements:
        if judged.pose_id not in known:
            raise Invalid.field("poses", f"pose {judged.pose_id} is none of run {run.id}")
        _check(judged)
    if len(known) < len(judgements):
        raise Invalid.field("poses", "a pose stands there twice")
    return _store(session, run, name, judgements, user_id, from_truth=False, seed=None)


def create_from_truth(
    session: Session, run: Run, name: str, size: int, seed: int, user_id: int | None
) -> CalibrationSet:
    """Draw clear cases by the simulator's truth. Raises Conflict where nothing is known."""
    judged = [
        Judged(pose_id, Grade(found.grade), found.reasons, found.note)
        for pose_id, found in judged_by_truth(session, run.id)
    ]
    if not judged:
        raise Conflict(
            f"no pose of {runs.label(run)} can be judged by truth: only simulated sites have one, "
            "and there must be clear cases; give `poses` with grades of your own instead"
        )
    drawn = draw_in_turn(judged, size, seed)
    return _store(session, run, name, drawn, user_id, from_truth=True, seed=seed)


def offer_from_truth(
    session: Session, run_ids: Sequence[int], name: str, size: int = 20, seed: int = 1
) -> CalibrationSet | None:
    """Make a set of the first run that can be judged; None if none can, or a set is there."""
    for run_id in run_ids:
        present, _ = repository.listed(session, None, run_id, Paging(limit=1, after=None))
        if present:
            return None
    for run_id in run_ids:
        try:
            return create_from_truth(session, runs.get_run(session, run_id), name, size, seed, None)
        except Conflict:
            continue
    return None


def create_from_own(
    session: Session, run: Run, name: str, size: int, seed: int, user_id: int
) -> CalibrationSet:
    """Draw from the poses this person graded, with their comments as notes. Raises Conflict."""
    judged = [
        Judged(review.pose_id, review.grade, review.reasons, review.comment or "")
        for review in repository.reviews_of(session, run.id, user_id)
    ]
    if not judged:
        raise Conflict(f"you have graded no pose of {runs.label(run)} yet: grade some first")
    drawn = draw_in_turn(judged, size, seed)
    return _store(session, run, name, drawn, user_id, from_truth=False, seed=seed)


def draw_in_turn(judged: Sequence[Judged], size: int, seed: int) -> list[Judged]:
    """Draw judged poses grade by grade in turn, then mix them.

    So a newcomer meets Bad and Wrong although they are rare; the share of Good in such a set says
    nothing about the run.
    """
    random = Random(seed)  # noqa: S311  a draw that can be repeated, not a secret
    by_grade = {grade: [found for found in judged if found.grade is grade] for grade in Grade}
    for found in by_grade.values():
        random.shuffle(found)
    drawn: list[Judged] = []
    while len(drawn) < size and any(by_grade.values()):
        drawn += [found.pop() for found in by_grade.values() if found]
    random.shuffle(drawn)
    return drawn[:size]


def _check(judged: Judged) -> None:
    try:
        check_reasons(judged.grade, judged.reasons)
    except ValueError as error:
        raise Invalid.field("reasons", str(error)) from error


def _store(
    session: Session,
    run: Run,
    name: str,
    judgements: Sequence[Judged],
    user_id: int | None,
    *,
    from_truth: bool,
    seed: int | None,
) -> CalibrationSet:
    stored = CalibrationSet(
        run_id=run.id,
        name=name,
        from_truth=from_truth,
        seed=seed,
        guideline_version=GUIDELINE_VERSION,
        created_by_id=user_id,
    )
    stored.run = run
    session.add(stored)
    session.flush()
    session.add_all(
        JudgedPose(
            set_id=stored.id,
            pose_id=judged.pose_id,
            position=position,
            grade=judged.grade,
            reasons=list(judged.reasons),
            note=judged.note,
        )
        for position, judged in enumerate(judgements)
    )
    session.flush()
    return stored


def put_pose(session: Session, found: CalibrationSet, judged: Judged) -> JudgedPose:
    """Judge a pose of the set's run, or judge it anew. Raises Invalid, Conflict for a full set."""
    _check(judged)
    repository.lock(session, found.id)
    if not repository.poses_of_run(session, found.run_id, [judged.pose_id]):
        raise NotFound("the set's run has no such pose")
    row = repository.judgement(session, found.id, judged.pose_id)
    if row is None:
        present = repository.judged(session, found.id)
        if len(present) >= MOST_POSES:
            raise Conflict(f"a calibration set holds at most {MOST_POSES} poses")
        row = JudgedPose(
            set_id=found.id,
            pose_id=judged.pose_id,
            position=max((other.position for other in present), default=-1) + 1,
        )
        session.add(row)
    row.grade, row.reasons, row.note = judged.grade, list(judged.reasons), judged.note
    session.flush()
    return row


def with_present_reasons(session: Session, set_id: int, judged: Judged) -> Judged:
    """Keep the reasons of a pose whose grade stays as it is; another grade has others."""
    row = repository.judgement(session, set_id, judged.pose_id)
    if row is None or row.grade != judged.grade:
        return judged
    return replace(judged, reasons=row.reasons)


def remove_pose(session: Session, set_id: int, pose_id: int) -> Judged:
    """Take a pose out of a set; returns how it was judged. Raises NotFound."""
    row = repository.judgement(session, set_id, pose_id)
    if row is None:
        raise NotFound("the set has no such pose")
    session.delete(row)
    return Judged(pose_id, row.grade, row.reasons, row.note)


def delete_set(session: Session, found: CalibrationSet, user_id: int) -> None:
    """Delete a set with all attempts at it, for 30 days."""
    deletions.delete(
        session,
        "calibration_set",
        [found.id],
        site_id=found.run.site_id,
        label=found.name,
        user_id=user_id,
    )


def answer(
    session: Session,
    found: CalibrationSet,
    user_id: int,
    pose_id: int,
    grade: Grade,
    reasons: Sequence[str],
    seconds: float | None,
) -> tuple[Compared, PracticeGrade, bool]:
    """Store a person's grade of a judged pose; returns it, compared, and whether it is new.

    Raises Invalid for a pose that is not in the set and for reasons that do not go with the grade.
    """
    judged = repository.judgement(session, found.id, pose_id)
    if judged is None:
        raise Invalid.field("pose_id", "is not in this calibration set")
    _check(Judged(pose_id, grade, reasons, ""))
    repository.lock(session, found.id)
    attempt = repository.attempt(session, found.id, user_id) or _begin(session, found.id, user_id)
    earlier = repository.answers(session, attempt.id).get(pose_id)
    if earlier is not None:
        return Compared(judged, earlier), earlier, False
    given = PracticeGrade(
        attempt_id=attempt.id,
        pose_id=pose_id,
        grade=grade,
        reasons=list(reasons),
        seconds=seconds,
    )
    session.add(given)
    session.flush()
    return Compared(judged, given), given, True


def restart(session: Session, set_id: int, user_id: int) -> Result:
    """Begin a new attempt; the earlier ones stay. An attempt without an answer is gone on with."""
    repository.lock(session, set_id)
    latest = repository.attempt(session, set_id, user_id)
    if latest is None or repository.answers(session, latest.id):
        _begin(session, set_id, user_id, latest.number + 1 if latest else 1)
    return result(session, set_id, user_id)


def _begin(session: Session, set_id: int, user_id: int, number: int = 1) -> PracticeAttempt:
    attempt = PracticeAttempt(set_id=set_id, user_id=user_id, number=number)
    session.add(attempt)
    session.flush()
    return attempt


def result(session: Session, set_id: int, user_id: int) -> Result:
    """Compare a person's latest attempt with the judgements as they stand now."""
    attempt = repository.attempt(session, set_id, user_id)
    answers = repository.answers(session, attempt.id) if attempt else {}
    poses = [
        Compared(judged, answers.get(judged.pose_id))
        for judged in repository.judged(session, set_id)
    ]
    pairs = [
        (_CATEGORIES[pose.answer.grade], _CATEGORIES[pose.judged.grade])
        for pose in poses
        if pose.answer is not None
    ]
    return Result(
        attempt=attempt.number if attempt else 1,
        poses=poses,
        kappa=cohens_kappa(pairs, len(_CATEGORIES)),
    )
