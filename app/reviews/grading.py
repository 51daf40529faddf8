"""Giving grades, adding words to them, and taking them back.

A verdict never changes: grading again puts a new one in the place of the person's last, and the
old one stays readable. Another person's verdict is a second opinion: it stands beside the first and
does not overrule it, unless it was given to settle a disagreement. People speak of their decisions
by names their own programs chose, because the key for a reason is often pressed before the answer
to the grade has arrived.
"""

import uuid
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from sqlalchemy.orm import Session

from app.db import now
from app.domain.grading import GUIDELINE_VERSION, check_reasons
from app.errors import Invalid, NotFound
from app.reviews import grade_repository as repository
from app.reviews import queue_items
from app.tables.reviews import Grade, Review

NO_DECISION = "there is no such decision of yours"


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a person says of a pose; `decision` None lets a name be made."""

    grade: Grade
    reasons: Sequence[str] = ()
    comment: str | None = None
    seconds: float | None = None
    decision: str | None = None
    settle: bool = False


def grade_pose(session: Session, pose_id: int, user_id: int, verdict: Verdict) -> Review:
    """Store a person's verdict on a pose that exists.

    Raises Invalid naming `reasons` where they do not fit the grade.
    """
    _check(verdict.grade, verdict.reasons)
    repository.lock(session, [pose_id])
    return _grade(session, pose_id, user_id, verdict, now())


def _check(grade: Grade, reasons: Sequence[str]) -> None:
    try:
        check_reasons(grade, reasons)
    except ValueError as error:
        raise Invalid.field("reasons", str(error)) from error


def _grade(session: Session, pose_id: int, user_id: int, verdict: Verdict, at: datetime) -> Review:
    found = repository.standing(session, pose_id)
    mine = next((review for review in found if review.user_id == user_id), None)
    others = [review for review in found if review.user_id != user_id]
    settles = queue_items.note_graded(
        session, pose_id, user_id, at, is_first_of_person=mine is None
    )
    settles = (verdict.settle or settles) and bool(others)
    if mine is not None:
        repository.replace(session, mine.id, at)
    if settles:
        repository.demote(session, [review.id for review in others])
    return repository.add(
        session,
        {
            "pose_id": pose_id,
            "user_id": user_id,
            "grade": verdict.grade,
            "reasons": list(dict.fromkeys(verdict.reasons)),
            "comment": verdict.comment or None,
            "seconds": verdict.seconds,
            "guideline_version": GUIDELINE_VERSION,
            "decision": verdict.decision or str(uuid.uuid4()),
            "second_opinion": not settles and (mine.second_opinion if mine else bool(others)),
            "settles": settles or (mine is not None and mine.settles),
            "created_at": at,
        },
    )


def grade_rest(
    session: Session,
    run_id: int,
    image_id: int,
    user_id: int,
    verdict: Verdict,
    pose_ids: Sequence[int] | None = None,
) -> tuple[str, list[Review], list[int]]:
    """Grade what is left of an image in one stroke.

    Returns the decision's name, the reviews and the poses passed over.

    Without `pose_ids` every pose that nobody graded; with them, those that this person has not.
    Raises Invalid naming `pose_ids` for one that is not of this image and run.
    """
    there = repository.poses_of_image(session, run_id, image_id)
    strangers = sorted(set(pose_ids or ()) - set(there))
    if strangers:
        raise Invalid.field("pose_ids", f"pose {strangers[0]} is not of this image and run")
    repository.lock(session, there)
    wanted = there if pose_ids is None else sorted(set(pose_ids))
    done = repository.graded(session, wanted, by=None if pose_ids is None else user_id)
    at = now()
    decision = verdict.decision or str(uuid.uuid4())
    verdict = replace(verdict, decision=decision)
    reviews = [
        _grade(session, pose_id, user_id, verdict, at) for pose_id in wanted if pose_id not in done
    ]
    return decision, reviews, [pose_id for pose_id in wanted if pose_id in done]


def add_words(
    session: Session,
    user_id: int,
    decision: str,
    *,
    reasons: Sequence[str] | None,
    comment: str | None,
    sets_comment: bool,
) -> Sequence[Review]:
    """Put reasons or a comment on a decision made before, whatever was decided since.

    The same words twice change nothing. Raises NotFound for a decision this person did not make,
    Invalid naming `reasons`.
    """
    reviews = _decided(session, user_id, decision)
    columns: dict[str, object] = {}
    if reasons is not None:
        for review in reviews:
            _check(review.grade, reasons)
        columns["reasons"] = list(dict.fromkeys(reasons))
    if sets_comment:
        columns["comment"] = comment or None
    changed = [
        review.id
        for review in reviews
        if any(getattr(review, name) != value for name, value in columns.items())
    ]
    if changed:
        repository.set_words(session, changed, now(), **columns)
        session.expire_all()
    return repository.of_decision(session, user_id, decision)


def withdraw(session: Session, user_id: int, decision: str) -> tuple[list[int], bool]:
    """Take a decision back; what the person had said before stands again.

    Returns its poses and whether anything was left to take back. Raises NotFound.
    """
    reviews = _decided(session, user_id, decision)
    pose_ids = sorted({review.pose_id for review in reviews})
    repository.lock(session, pose_ids)
    at = now()
    left = [review for review in reviews if review.withdrawn_at is None]
    for review in left:
        repository.withdraw(session, review, at)
        queue_items.reopen(session, review.pose_id, user_id, at)
    session.expire_all()
    return pose_ids, bool(left)


def _decided(session: Session, user_id: int, decision: str) -> Sequence[Review]:
    reviews = repository.of_decision(session, user_id, decision)
    if not reviews:
        raise NotFound(NO_DECISION)
    return reviews
