"""Lists of work for reviewers, and who holds which piece of it until when.

A queue fixes its items when it is made, so that a random sample stays the sample it was. An item is
held under a lease; whoever holds it grades it, and a lease that ran out is free for others.
"""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, enum_type, now
from app.tables.ais import WideId
from app.tables.deletion import DeletableAlone, index_of_deleted
from app.tables.identity import User
from app.tables.runs import Run


class QueueUnit(StrEnum):
    """What is judged at a time."""

    POSE = "pose"
    IMAGE = "image"


class QueueOrder(StrEnum):
    """Which items come first, or at all."""

    TIME = "time"
    RANDOM = "random"
    UNCERTAIN = "uncertain"
    DISAGREEMENT = "disagreement"  # only poses whose reviewers differ
    SECOND_OPINION = "second_opinion"  # only poses that one person has graded


class ReviewQueue(DeletableAlone, Base):
    """A list of poses or images of a run, in an order.

    `seed` is that of the random order or sample; the same seed and run give the same.
    """

    __tablename__ = "review_queues"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    unit: Mapped[QueueUnit] = mapped_column(enum_type(QueueUnit))
    order: Mapped[QueueOrder] = mapped_column(enum_type(QueueOrder))
    sample: Mapped[int | None]
    seed: Mapped[int | None]
    double: Mapped[bool]
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    created_at: Mapped[datetime] = mapped_column(default=now)

    run: Mapped[Run] = relationship()
    created_by: Mapped[User | None] = relationship(lazy="joined")

    __table_args__ = (index_of_deleted("review_queues"),)


class ReviewQueueItem(Base):
    """One person's part in a piece of work: a pose, or an image with all its poses.

    With double review a piece has two rows, `slot` 0 and 1, never held or done by the same person.
    `user_id` holds it until `leased_until`, or did it at `done_at`.
    """

    __tablename__ = "review_queue_items"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    queue_id: Mapped[int] = mapped_column(sa.ForeignKey("review_queues.id", ondelete="CASCADE"))
    position: Mapped[int]
    slot: Mapped[int] = mapped_column(default=0)
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    pose_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("poses.id", ondelete="CASCADE"), index=True
    )
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    leased_until: Mapped[datetime | None]
    done_at: Mapped[datetime | None]

    __table_args__ = (
        sa.UniqueConstraint("queue_id", "position", "slot"),
        sa.Index(
            "ix_review_queue_items_open",
            "queue_id",
            "position",
            "slot",
            sqlite_where=sa.text("done_at IS NULL"),
            postgresql_where=sa.text("done_at IS NULL"),
        ),
    )
