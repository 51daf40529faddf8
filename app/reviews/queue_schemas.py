"""Shapes of review queues in REST."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.ids import RowId
from app.reviews import queues
from app.reviews.pose_schemas import PoseImage, PoseOut
from app.reviews.queue_repository import Counts
from app.reviews.schemas import WideId
from app.tables.queues import QueueOrder, QueueUnit, ReviewQueue

MOST_AT_ONCE = 50
LARGEST_SAMPLE = 1_000_000


class QueueIn(BaseModel):
    """What a queue shall hold."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [{"run_id": 1, "unit": "image", "order": "random", "sample": 100}]
        },
    )

    run_id: RowId
    unit: QueueUnit = QueueUnit.POSE
    order: QueueOrder = QueueOrder.TIME
    sample: Annotated[
        int | None, Field(ge=1, le=LARGEST_SAMPLE, description="So many units; left out: all")
    ] = None
    seed: Annotated[
        int | None,
        Field(ge=0, le=queues.LARGEST_SEED, description="Left out: one is chosen and told"),
    ] = None
    double: Annotated[bool, Field(description="Each unit goes to two different people")] = False
    reuse: Annotated[
        bool, Field(description="Take the run's queue with the same choices if there is one")
    ] = False


class ProgressOut(BaseModel):
    """How far a queue is; with double review every unit counts twice in `total`."""

    total: int
    done: int
    leased: int
    remaining: int
    mine_done: int
    mine_leased: int
    units: int
    units_done: int

    @classmethod
    def of(cls, counts: Counts) -> "ProgressOut":
        """Take counts."""
        return cls(
            total=counts.total,
            done=counts.done,
            leased=counts.leased,
            remaining=counts.total - counts.done,
            mine_done=counts.mine_done,
            mine_leased=counts.mine_leased,
            units=counts.units,
            units_done=counts.units - counts.units_open,
        )


class QueueOut(BaseModel):
    """A queue and how far it is."""

    id: int
    run_id: int
    unit: QueueUnit
    order: QueueOrder
    sample: int | None
    seed: int | None
    double: bool
    is_random_sample: bool
    description: str
    created_by: str | None
    created_at: datetime
    progress: ProgressOut

    @classmethod
    def of(cls, queue: ReviewQueue, counts: Counts) -> "QueueOut":
        """Take the columns of a queue."""
        maker = queue.created_by
        return cls(
            id=queue.id,
            run_id=queue.run_id,
            unit=queue.unit,
            order=queue.order,
            sample=queue.sample,
            seed=queue.seed,
            double=queue.double,
            is_random_sample=queues.is_random_sample(queue),
            description=queues.describe(queue),
            created_by=maker.name or maker.email if maker else None,
            created_at=queue.created_at,
            progress=ProgressOut.of(counts),
        )


class NextIn(BaseModel):
    """How much is wanted at once."""

    model_config = ConfigDict(extra="forbid")

    count: Annotated[int | None, Field(ge=1, le=MOST_AT_ONCE)] = None
    resume: Annotated[bool, Field(description="First what the caller holds already")] = False


class HeldIn(BaseModel):
    """Which items are meant; left out: all that the caller holds."""

    model_config = ConfigDict(extra="forbid")

    items: Annotated[list[WideId] | None, Field(max_length=MOST_AT_ONCE)] = None


class HeldItem(BaseModel):
    """An item that the caller still holds."""

    id: int
    leased_until: datetime


class HeldOut(BaseModel):
    """The items that the caller still holds."""

    items: list[HeldItem]


class QueueItemOut(BaseModel):
    """A leased item: a pose, or an image with all its poses."""

    id: int
    queue_id: int
    run_id: int
    position: int
    unit: QueueUnit
    image_id: int
    pose_id: int | None
    leased_until: datetime
    image: PoseImage
    pose: PoseOut | None
    poses: list[PoseOut]


class QueueItemsOut(BaseModel):
    """Several leased items."""

    items: list[QueueItemOut]
