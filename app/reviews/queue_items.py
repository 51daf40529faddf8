"""What grading a pose or completing an image does to the queues that hold it.

A queue item is done by whoever does the work, with or without a lease: a late grade counts if
nobody else was faster. With double review the work has two items, for two different people.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from itertools import groupby

from sqlalchemy.orm import Session

from app.reviews import queue_repository as repository
from app.reviews.queue_repository import ItemState
from app.tables.queues import QueueOrder

# After an undo the item comes back to the one who undid; as long as a fresh lease by default.
REOPENED_FOR = timedelta(minutes=10)


def note_graded(
    session: Session, pose_id: int, user_id: int, at: datetime, *, is_first_of_person: bool
) -> bool:
    """Mark the queue items that a person's grade of a pose does.

    Returns whether the grade settles a disagreement: it was given for an item of such a queue.
    """
    items = repository.items_of_pose(session, pose_id)
    done = []
    settles = False
    for item in _to_be_done(items, user_id, at):
        if item.order is QueueOrder.SECOND_OPINION and not is_first_of_person:
            continue  # the same person's second thought is no second opinion
        done.append(item.id)
        settles |= item.order is QueueOrder.DISAGREEMENT and item.user_id == user_id
    if done:
        repository.set_done(session, done, user_id, at)
    return settles


def note_completed(
    session: Session, run_id: int, image_id: int, user_id: int, at: datetime
) -> None:
    """Mark the queue items that a person's completing of an image does."""
    items = repository.items_of_image(session, run_id, image_id)
    done = [item.id for item in _to_be_done(items, user_id, at)]
    if done:
        repository.set_done(session, done, user_id, at)


def reopen(session: Session, pose_id: int, user_id: int, at: datetime) -> None:
    """Give the items back that a person had done by grading a pose."""
    items = repository.items_of_pose(session, pose_id)
    _give_back(session, items, user_id, at)


def reopen_image(session: Session, run_id: int, image_id: int, user_id: int, at: datetime) -> None:
    """Give the items back that were done by completing an image, whoever takes it back."""
    items = repository.items_of_image(session, run_id, image_id)
    _give_back(session, items, user_id, at, whoever=True)


def _give_back(
    session: Session,
    items: Sequence[ItemState],
    user_id: int,
    at: datetime,
    *,
    whoever: bool = False,
) -> None:
    done = [item.id for item in items if item.done and (whoever or item.user_id == user_id)]
    if done:
        repository.hold(session, done, user_id, at + REOPENED_FOR)


def _to_be_done(items: Sequence[ItemState], user_id: int, at: datetime) -> Iterable[ItemState]:
    """Give, of each queue's items for the same work, the one that a person's doing it does."""
    for _, group in groupby(items, key=lambda item: (item.queue_id, item.position)):
        slots = list(group)
        if any(item.done and item.user_id == user_id for item in slots):
            continue
        still_open = [item for item in slots if not item.done]
        mine = [item for item in still_open if item.user_id == user_id]
        free = [item for item in still_open if not item.is_held(at)]
        others = [] if slots[0].double else still_open
        chosen = [*mine, *free, *others]
        if chosen:
            yield chosen[0]
