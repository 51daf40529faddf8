"""Shapes that all evaluations share: shares with their intervals, the sample they rest on."""

from pydantic import BaseModel, Field

from app.domain.sampling import Share
from app.evaluation.selection import Selection
from app.tables.queues import QueueOrder, ReviewQueue

Interval = tuple[float, float]


class ShareOut(BaseModel):
    """A share with its denominator and Wilson's 95 % interval; fractions of one."""

    count: int
    total: int
    share: float | None
    interval: Interval

    @classmethod
    def of(cls, share: Share) -> "ShareOut":
        """Write a share out."""
        return cls(count=share.count, total=share.total, share=share.value, interval=share.interval)


class SampleOut(BaseModel):
    """The review queue that figures are limited to; a random one says its seed."""

    queue_id: int
    is_random: bool
    sample: int | None = Field(description="How many were drawn; null for all of the run")
    seed: int | None
    description: str


def sample_of(selection: Selection) -> SampleOut | None:
    """Tell which sample a selection is, None where it is none."""
    queue = selection.queue
    if queue is None:
        return None
    is_random = queue.sample is not None and queue.seed is not None
    return SampleOut(
        queue_id=queue.id,
        is_random=is_random,
        sample=queue.sample,
        seed=queue.seed,
        description=describe(queue),
    )


def describe(queue: ReviewQueue) -> str:
    """Say in words what a queue holds and how it was chosen."""
    units = f"{queue.unit.value}s"
    if queue.sample is not None and queue.seed is not None:
        return f"random sample of {queue.sample} {units}, seed {queue.seed}"
    orders = {
        QueueOrder.TIME: f"all {units} in order of time",
        QueueOrder.RANDOM: f"all {units} in random order, seed {queue.seed}",
        QueueOrder.UNCERTAIN: f"{units}, most uncertain first: no random sample",
        QueueOrder.DISAGREEMENT: f"{units} whose reviewers differ: no random sample",
        QueueOrder.SECOND_OPINION: f"{units} for a second opinion: no random sample",
    }
    return orders[queue.order]
