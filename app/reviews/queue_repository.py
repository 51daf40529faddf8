"""SQL of review queues: finding them, taking leases, giving them back.

On SQLite one writing transaction at a time sees and takes what is free. On Postgres rows that
somebody else is just taking are skipped; with double review the queue itself is locked, because a
person must not take both halves of the same work in two windows at once.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from app.db import Base, find
from app.ids import LARGEST_ROW_ID
from app.paging import Paging, fetch_page
from app.tables.imagery import Image
from app.tables.queues import QueueOrder, QueueUnit, ReviewQueue, ReviewQueueItem
from app.tables.reviews import Review
from app.tables.runs import Run

_OPEN = ReviewQueueItem.done_at.is_(None)
_STANDING = Review.replaced_at.is_(None)
_STATES = (
    sa.select(
        ReviewQueueItem.id,
        ReviewQueueItem.queue_id,
        ReviewQueueItem.position,
        ReviewQueueItem.user_id,
        ReviewQueueItem.leased_until,
        ReviewQueueItem.done_at,
        ReviewQueue.order,
        ReviewQueue.double,
    )
    .join(ReviewQueue, ReviewQueue.id == ReviewQueueItem.queue_id)
    .order_by(ReviewQueueItem.queue_id, ReviewQueueItem.position, ReviewQueueItem.slot)
)
_OF_POSE = _STATES.where(ReviewQueueItem.pose_id == sa.bindparam("pose_id"))
_OF_IMAGE = _STATES.where(
    ReviewQueueItem.image_id == sa.bindparam("image_id"),
    ReviewQueueItem.pose_id.is_(None),
    ReviewQueue.run_id == sa.bindparam("run_id"),
)
# The table's own statements: the session holds no items that would have to follow.
_ITEMS = Base.metadata.tables["review_queue_items"]
_THESE = _ITEMS.c.id.in_(sa.bindparam("ids", expanding=True))
_SET = (
    sa.update(_ITEMS)
    .where(_THESE)
    .values(
        user_id=sa.bindparam("holder"),
        leased_until=sa.bindparam("until"),
        done_at=sa.bindparam("done"),
    )
)
_QUEUE = (
    sa.select(
        ReviewQueue.id,
        ReviewQueue.run_id,
        Run.site_id,
        ReviewQueue.unit,
        ReviewQueue.order,
        ReviewQueue.double,
    )
    .join(Run, Run.id == ReviewQueue.run_id)
    .where(ReviewQueue.id == sa.bindparam("queue_id"))
)


@dataclass(frozen=True, slots=True)
class ItemState:
    """Where an item stands, with what its queue says of it."""

    id: int
    queue_id: int
    position: int
    user_id: int | None
    leased_until: datetime | None
    done_at: datetime | None
    order: QueueOrder
    double: bool

    @property
    def done(self) -> bool:
        """Whether the work is done."""
        return self.done_at is not None

    def is_held(self, at: datetime) -> bool:
        """Whether somebody holds it at a moment."""
        return (
            self.user_id is not None and self.leased_until is not None and self.leased_until >= at
        )


@dataclass(frozen=True, slots=True)
class OpenQueue:
    """What is needed of a queue to take from it."""

    id: int
    run_id: int
    site_id: int
    unit: QueueUnit
    order: QueueOrder
    double: bool


@dataclass(frozen=True, slots=True)
class LeasedItem:
    """An item that a person holds until a moment."""

    id: int
    position: int
    image_id: int
    pose_id: int | None
    leased_until: datetime


@dataclass(frozen=True, slots=True)
class Counts:
    """How many items there are, and of whom."""

    total: int
    done: int
    leased: int
    mine_done: int
    mine_leased: int
    units: int
    units_open: int


def get(session: Session, queue_id: int) -> ReviewQueue | None:
    """Return a queue."""
    return find(session, ReviewQueue, queue_id, sa.orm.joinedload(ReviewQueue.run))


def get_open(session: Session, queue_id: int) -> OpenQueue | None:
    """Return what is needed of a queue to take from it."""
    if not 0 < queue_id <= LARGEST_ROW_ID:
        return None
    row = session.execute(_QUEUE, {"queue_id": queue_id}).one_or_none()
    return None if row is None else OpenQueue(*row)


def listed(
    session: Session, site_ids: Iterable[int] | None, run_id: int | None, paging: Paging
) -> tuple[Sequence[ReviewQueue], str | None]:
    """Return a page of the queues of some sites (None: all)."""
    statement = sa.select(ReviewQueue).join(ReviewQueue.run)
    if site_ids is not None:
        statement = statement.where(Run.site_id.in_(site_ids))
    if run_id is not None:
        statement = statement.where(ReviewQueue.run_id == run_id)
    return fetch_page(session, statement, ReviewQueue.id, paging)


def alike(session: Session, queue: ReviewQueue) -> ReviewQueue | None:
    """Return the newest queue of the same run with the same choices."""
    return session.scalars(
        sa.select(ReviewQueue)
        .where(
            ReviewQueue.run_id == queue.run_id,
            ReviewQueue.unit == queue.unit,
            ReviewQueue.order == queue.order,
            ReviewQueue.double == queue.double,
            ReviewQueue.sample.is_not_distinct_from(queue.sample),
            *([] if queue.seed is None else [ReviewQueue.seed == queue.seed]),
        )
        .order_by(ReviewQueue.id.desc())
        .limit(1)
    ).first()


def take(
    session: Session, queue: OpenQueue, user_id: int, count: int, at: datetime, until: datetime
) -> Sequence[LeasedItem]:
    """Lease free items to a person, the first ones of the queue."""
    is_postgres = session.get_bind().dialect.name == "postgresql"
    if is_postgres and queue.double:
        session.execute(
            sa.select(ReviewQueue.id).where(ReviewQueue.id == queue.id).with_for_update()
        )
    statement = _FREE
    if queue.double:
        statement = statement.where(~_other_half())
    if queue.order is QueueOrder.SECOND_OPINION:
        own = sa.exists().where(
            Review.pose_id == ReviewQueueItem.pose_id,
            Review.user_id == sa.bindparam("taker"),
            _STANDING,
        )
        statement = statement.where(~own)
    if is_postgres:
        statement = statement.with_for_update(of=ReviewQueueItem, skip_locked=True)
    rows = session.execute(
        statement, {"queue_id": queue.id, "at": at, "taker": user_id, "most": count}
    )
    items = [LeasedItem(*row, until) for row in rows]
    if items:
        hold(session, [item.id for item in items], user_id, until)
    return items


def _free(
    item: type[ReviewQueueItem] | sa.orm.util.AliasedClass[ReviewQueueItem],
) -> sa.ColumnElement[bool]:
    """Whether nobody holds an item at the moment `at`."""
    ran_out = item.leased_until < sa.bindparam("at")
    return item.user_id.is_(None) | item.leased_until.is_(None) | ran_out


_FREE = (
    sa.select(
        ReviewQueueItem.id,
        ReviewQueueItem.position,
        ReviewQueueItem.image_id,
        ReviewQueueItem.pose_id,
    )
    .join(Image, Image.id == ReviewQueueItem.image_id)
    .where(
        ReviewQueueItem.queue_id == sa.bindparam("queue_id"),
        _OPEN,
        _free(ReviewQueueItem),
        Image.deleted_at.is_(None),
    )
    .order_by(ReviewQueueItem.position, ReviewQueueItem.slot)
    .limit(sa.bindparam("most", type_=sa.Integer))
)


def _other_half() -> sa.ColumnElement[bool]:
    """Whether a person may not have an item: the other half is theirs, or comes first."""
    half = aliased(ReviewQueueItem)
    same_work = (
        (half.queue_id == ReviewQueueItem.queue_id)
        & (half.position == ReviewQueueItem.position)
        & (half.slot != ReviewQueueItem.slot)
    )
    theirs = (half.user_id == sa.bindparam("taker")) & (
        half.done_at.is_not(None) | (half.leased_until >= sa.bindparam("at"))
    )
    first = (half.slot < ReviewQueueItem.slot) & half.done_at.is_(None) & _free(half)
    return sa.exists().where(same_work, theirs | first)


def held(
    session: Session, queue_id: int, user_id: int, at: datetime, ids: Collection[int] | None = None
) -> Sequence[LeasedItem]:
    """Return the items of a queue that a person holds, or those of them that are named."""
    statement = sa.select(
        ReviewQueueItem.id,
        ReviewQueueItem.position,
        ReviewQueueItem.image_id,
        ReviewQueueItem.pose_id,
        ReviewQueueItem.leased_until,
    ).where(
        ReviewQueueItem.queue_id == queue_id,
        _OPEN,
        ReviewQueueItem.user_id == user_id,
        ReviewQueueItem.leased_until >= at,
    )
    if ids is not None:
        statement = statement.where(ReviewQueueItem.id.in_(ids))
    if session.get_bind().dialect.name == "postgresql":
        # What is locked is just being graded: neither to be waited for nor to be held any longer.
        statement = statement.with_for_update(of=ReviewQueueItem, skip_locked=True)
    rows = session.execute(statement.order_by(ReviewQueueItem.position, ReviewQueueItem.slot))
    return [LeasedItem(row[0], row[1], row[2], row[3], row[4] or at) for row in rows]


def hold(session: Session, ids: Collection[int], user_id: int, until: datetime) -> None:
    """Let a person hold items until a moment; those that were done are open again."""
    session.execute(_SET, {"ids": list(ids), "holder": user_id, "until": until, "done": None})


def hand_over(session: Session, giver_id: int, taker_id: int, until: datetime) -> int:
    """Let a person hold what another holds and has not done; returns how many items."""
    items = session.execute(
        sa.update(ReviewQueueItem)
        .where(ReviewQueueItem.user_id == giver_id, _OPEN)
        .values(user_id=taker_id, leased_until=until)
        .execution_options(synchronize_session=False)
        .returning(ReviewQueueItem.id)
    ).all()
    session.execute(
        sa.update(ReviewQueue)
        .where(
            ReviewQueue.created_by_id == giver_id,
            sa.exists().where(ReviewQueueItem.queue_id == ReviewQueue.id, _OPEN),
        )
        .values(created_by_id=taker_id)
        .execution_options(synchronize_session=False)
    )
    return len(items)


def count_held(session: Session, user_id: int) -> int:
    """Count what a person holds and has not done."""
    statement = sa.select(sa.func.count(ReviewQueueItem.id)).where(
        ReviewQueueItem.user_id == user_id, _OPEN
    )
    return session.scalar(statement) or 0


def let_go(session: Session, user_id: int) -> None:
    """Give back what a person holds and has not done."""
    session.execute(
        sa.update(ReviewQueueItem)
        .where(ReviewQueueItem.user_id == user_id, _OPEN)
        .values(user_id=None, leased_until=None)
        .execution_options(synchronize_session=False)
    )


def release(session: Session, ids: Collection[int]) -> None:
    """Let go of items."""
    session.execute(
        sa.update(ReviewQueueItem)
        .where(ReviewQueueItem.id.in_(ids), _OPEN)
        .values(user_id=None, leased_until=None)
        .execution_options(synchronize_session=False)
    )


def set_done(session: Session, ids: Collection[int], user_id: int, at: datetime) -> None:
    """Say that a person did items."""
    session.execute(_SET, {"ids": list(ids), "holder": user_id, "until": None, "done": at})


def items_of_pose(session: Session, pose_id: int) -> Sequence[ItemState]:
    """Return the items that are about a pose."""
    return [ItemState(*row) for row in session.execute(_OF_POSE, {"pose_id": pose_id})]


def items_of_image(session: Session, run_id: int, image_id: int) -> Sequence[ItemState]:
    """Return the items of a run that are about an image as a whole."""
    rows = session.execute(_OF_IMAGE, {"run_id": run_id, "image_id": image_id})
    return [ItemState(*row) for row in rows]


def counts(
    session: Session, queue_ids: Collection[int], user_id: int, at: datetime
) -> Mapping[int, Counts]:
    """Count the items of queues; those of deleted images are left out."""
    done = ReviewQueueItem.done_at.is_not(None)
    leased = _OPEN & ReviewQueueItem.user_id.is_not(None) & (ReviewQueueItem.leased_until >= at)
    mine = ReviewQueueItem.user_id == user_id

    def number(condition: sa.ColumnElement[bool]) -> sa.ColumnElement[int]:
        return sa.func.count(sa.case((condition, 1)))

    rows = session.execute(
        sa.select(
            ReviewQueueItem.queue_id,
            sa.func.count(),
            number(done),
            number(leased),
            number(done & mine),
            number(leased & mine),
            sa.func.count(ReviewQueueItem.position.distinct()),
            sa.func.count(sa.case((_OPEN, ReviewQueueItem.position)).distinct()),
        )
        .join(Image, Image.id == ReviewQueueItem.image_id)
        .where(ReviewQueueItem.queue_id.in_(queue_ids), Image.deleted_at.is_(None))
        .group_by(ReviewQueueItem.queue_id)
    )
    found = {row[0]: Counts(*row[1:]) for row in rows}
    nothing = Counts(0, 0, 0, 0, 0, 0, 0)
    return {queue_id: found.get(queue_id, nothing) for queue_id in queue_ids}
