"""Queues: who is to judge what, in which order, and who is at it now.

A queue of a whole run in the order of time, one of a random sample that can be drawn again, of
doubtful poses first, of those that reviewers disagree about, of those that want a second opinion.
Whoever asks for the next item holds it under a lease. A reviewer who leaves loses it after a while
and another gets it; nobody else has it before, unless the queue is for double review.
"""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.db import now
from app.deletions import service as deletions
from app.domain.review_order import doubt, shuffled
from app.errors import Invalid, NotFound
from app.paging import Paging
from app.reviews import queue_repository as repository
from app.reviews import queue_unit_repository
from app.reviews.queue_repository import Counts, LeasedItem, OpenQueue
from app.reviews.queue_unit_repository import Unit
from app.reviews.repository import pose_state
from app.runs import service as runs
from app.tables.queues import QueueOrder, QueueUnit, ReviewQueue
from app.tables.runs import Run

NO_QUEUE = "there is no such queue"
LARGEST_SEED = 2**31 - 1
Graders = Mapping[int, Sequence[tuple[int | None, datetime]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class QueueChoice:
    """What a queue shall hold and in which order."""

    unit: QueueUnit = QueueUnit.POSE
    order: QueueOrder = QueueOrder.TIME
    sample: int | None = None
    seed: int | None = None
    double: bool = False


def is_random_sample(queue: ReviewQueue) -> bool:
    """Whether a queue holds units drawn at random, so that its figures speak for the whole run."""
    return queue.sample is not None and queue.order in {QueueOrder.TIME, QueueOrder.RANDOM}


def describe(queue: ReviewQueue) -> str:
    """Say in words what a queue holds."""
    units = f"{queue.unit}s"
    if is_random_sample(queue):
        text = f"Random sample of {queue.sample} {units}, seed {queue.seed}"
    else:
        some = f"{queue.sample} " if queue.sample is not None else ""
        text = {
            QueueOrder.TIME: f"All {units} in the order of time",
            QueueOrder.RANDOM: f"All {units} in random order, seed {queue.seed}",
            QueueOrder.UNCERTAIN: f"The {some}most doubtful {units} first",
            QueueOrder.DISAGREEMENT: f"{some}{units} that reviewers disagree about".capitalize(),
            QueueOrder.SECOND_OPINION: f"{some}{units} for a second opinion".capitalize(),
        }[queue.order]
    return f"{text}, each by two people" if queue.double else text


def create(
    session: Session, run: Run, choice: QueueChoice, user_id: int
) -> tuple[ReviewQueue, bool]:
    """Make a queue and fix its items; those that are judged already count as done. It is new.

    Raises Invalid naming `double` where it makes no sense.
    """
    queue = _draft(run, choice, user_id)
    session.add(queue)
    session.flush()
    _fill(session, queue)
    return queue, True


def create_or_reuse(
    session: Session, run: Run, choice: QueueChoice, user_id: int
) -> tuple[ReviewQueue, bool]:
    """Return a queue of the run with the same choices and what came since, or a new one (True)."""
    known = repository.alike(session, _draft(run, choice, user_id))
    if known is None:
        return create(session, run, choice, user_id)
    if known.sample is None:
        _fill(session, known)
    return known, False


def _draft(run: Run, choice: QueueChoice, user_id: int) -> ReviewQueue:
    special = {QueueOrder.DISAGREEMENT, QueueOrder.SECOND_OPINION}
    if choice.double and choice.order in special:
        raise Invalid.field("double", f"makes no sense with the order {choice.order}")
    is_random = choice.order is QueueOrder.RANDOM or (
        choice.sample is not None and choice.order is QueueOrder.TIME
    )
    seed = choice.seed if choice.seed is not None else secrets.randbelow(LARGEST_SEED)
    return ReviewQueue(
        run_id=run.id,
        unit=choice.unit,
        order=choice.order,
        sample=choice.sample,
        seed=seed if is_random else None,
        double=choice.double,
        created_by_id=user_id,
    )


def _fill(session: Session, queue: ReviewQueue) -> None:
    """Add the units a queue lacks."""
    there, position = queue_unit_repository.units_in(session, queue.id)
    units = [
        unit for unit in _ordered(session, queue) if (unit.image_id, unit.pose_id) not in there
    ]
    done = _judged(session, queue)
    rows: list[dict[str, object]] = []
    for number, unit in enumerate(units, start=position):
        judges = done.get(unit.pose_id or unit.image_id, ())
        for slot in range(2 if queue.double else 1):
            user_id, at = judges[slot] if slot < len(judges) else (None, None)
            rows.append(
                {
                    "queue_id": queue.id,
                    "position": number,
                    "slot": slot,
                    "image_id": unit.image_id,
                    "pose_id": unit.pose_id,
                    "user_id": user_id,
                    "done_at": at,
                }
            )
    queue_unit_repository.add_items(session, rows)


def _judged(session: Session, queue: ReviewQueue) -> Graders:
    if queue.order in {QueueOrder.DISAGREEMENT, QueueOrder.SECOND_OPINION}:
        return {}
    if queue.unit is QueueUnit.IMAGE:
        return queue_unit_repository.completers(session, queue.run_id)
    return queue_unit_repository.graders(session, queue.run_id)


def _ordered(session: Session, queue: ReviewQueue) -> Sequence[Unit]:
    units = _candidates(session, queue)
    if queue.order is QueueOrder.UNCERTAIN:
        return _doubtful_first(session, queue, units)[: queue.sample]
    if queue.seed is None:
        return units[: queue.sample]
    drawn = shuffled(units, queue.seed, queue.sample)
    if queue.order is QueueOrder.RANDOM:
        return drawn
    chosen = set(drawn)
    return [unit for unit in units if unit in chosen]


def _candidates(session: Session, queue: ReviewQueue) -> Sequence[Unit]:
    """Return all units in the order of time, or those in the state the order is about."""
    if queue.order in {QueueOrder.DISAGREEMENT, QueueOrder.SECOND_OPINION}:
        conditions = [pose_state("disagreement")]
        if queue.order is QueueOrder.SECOND_OPINION:
            conditions = [pose_state("graded"), ~pose_state("second_opinion")]
        poses = queue_unit_repository.poses_in_time(session, queue.run_id, *conditions)
        if queue.unit is QueueUnit.POSE:
            return poses
        return [Unit(image_id, None) for image_id in dict.fromkeys(p.image_id for p in poses)]
    if queue.unit is QueueUnit.POSE:
        return queue_unit_repository.poses_in_time(session, queue.run_id)
    return queue_unit_repository.images_in_time(session, queue.run_id)


def _doubtful_first(session: Session, queue: ReviewQueue, units: Sequence[Unit]) -> Sequence[Unit]:
    run = runs.get_run(session, queue.run_id)
    maximum = float(run.parameters.get("maximum_cost", 1.0))
    of_pose: dict[int, float] = {}
    of_image: dict[int, float] = {}
    for pose_id, known in queue_unit_repository.doubtable(session, run.id).items():
        of_pose[pose_id] = doubt(known.cost, maximum, known.flags, known.certainty)
        of_image[known.image_id] = max(of_image.get(known.image_id, 0.0), of_pose[pose_id])

    def doubt_of(unit: Unit) -> float:
        return of_image.get(unit.image_id, 0.0) if unit.pose_id is None else of_pose[unit.pose_id]

    return sorted(units, key=doubt_of, reverse=True)


def get(session: Session, queue_id: int) -> ReviewQueue:
    """Return a queue. Raises NotFound."""
    queue = repository.get(session, queue_id)
    if queue is None:
        raise NotFound(NO_QUEUE)
    return queue


def listed(
    session: Session, site_ids: frozenset[int] | None, run_id: int | None, paging: Paging
) -> tuple[Sequence[ReviewQueue], str | None]:
    """Return a page of the queues of some sites (None: all)."""
    return repository.listed(session, site_ids, run_id, paging)


def counts(session: Session, queues: Sequence[ReviewQueue], user_id: int) -> Mapping[int, Counts]:
    """Count what is done, held and left of queues."""
    return repository.counts(session, [queue.id for queue in queues], user_id, now())


def label(queue: ReviewQueue) -> str:
    """Return how people call a queue."""
    return f"{queue.unit.value}s of run {queue.run_id}, {queue.order.value.replace('_', ' ')}"


def delete(session: Session, queue: ReviewQueue, user_id: int) -> None:
    """Delete a queue for 30 days; what was graded through it stays."""
    deletions.delete(
        session,
        "review_queue",
        [queue.id],
        site_id=queue.run.site_id,
        label=label(queue),
        user_id=user_id,
    )


def get_open(session: Session, queue_id: int) -> OpenQueue:
    """Return what is needed of a queue to take from it. Raises NotFound."""
    queue = repository.get_open(session, queue_id)
    if queue is None:
        raise NotFound(NO_QUEUE)
    return queue


def take_next(
    session: Session,
    queue: OpenQueue,
    user_id: int,
    *,
    count: int,
    lease: timedelta,
    resume: bool,
) -> list[LeasedItem]:
    """Lease the next items to a person; with `resume` those they hold already come first."""
    at = now()
    until = at + lease
    items: list[LeasedItem] = []
    if resume:
        held = repository.held(session, queue.id, user_id, at)[:count]
        items = [replace(item, leased_until=until) for item in held]
        if items:
            repository.hold(session, [item.id for item in items], user_id, until)
    if len(items) < count:
        items += repository.take(session, queue, user_id, count - len(items), at, until)
    return items


def extend(
    session: Session,
    queue: OpenQueue,
    user_id: int,
    ids: Sequence[int] | None,
    lease: timedelta,
) -> list[tuple[int, datetime]]:
    """Hold on to items for another while; returns those that are still this person's."""
    at = now()
    items = repository.held(session, queue.id, user_id, at, ids)
    until = at + lease
    if items:
        repository.hold(session, [item.id for item in items], user_id, until)
    return [(item.id, until) for item in items]


def hand_over(session: Session, giver_id: int, taker_id: int, lease_s: float) -> int:
    """Let a person go on with another's open queues and leases; returns how many items moved."""
    until = now() + timedelta(seconds=lease_s)
    return repository.hand_over(session, giver_id, taker_id, until)


def count_held(session: Session, user_id: int) -> int:
    """Count what a person holds of all queues and has not done."""
    return repository.count_held(session, user_id)


def let_go(session: Session, user_id: int) -> None:
    """Give back what a person holds, for others to take at once."""
    repository.let_go(session, user_id)


def release(session: Session, queue: OpenQueue, user_id: int, ids: Sequence[int] | None) -> None:
    """Give items back, so that others get them at once."""
    items = repository.held(session, queue.id, user_id, now(), ids)
    if items:
        repository.release(session, [item.id for item in items])
