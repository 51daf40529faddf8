"""REST of review queues."""

from collections.abc import Sequence
from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.dependencies import PagingDep, SessionDep, SettingsDep
from app.errors import Forbidden, looked_up_by
from app.ids import RowId
from app.paging import Page
from app.reviews import queues, service
from app.reviews.pose_schemas import PoseImage, PoseOut
from app.reviews.queue_repository import LeasedItem, OpenQueue
from app.reviews.queue_schemas import (
    HeldIn,
    HeldItem,
    HeldOut,
    NextIn,
    ProgressOut,
    QueueIn,
    QueueItemOut,
    QueueItemsOut,
    QueueOut,
)
from app.runs import service as runs
from app.tables.queues import QueueUnit, ReviewQueue

router = APIRouter(route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]


@router.post("/review-queues", status_code=201, responses={200: {"model": QueueOut}})
def create_queue(
    body: QueueIn, session: SessionDep, access: Reviewer, response: Response
) -> QueueOut:
    """Make a queue of a run's poses or images; a random one tells its seed."""
    with looked_up_by("run_id"):
        run = runs.get_run(session, body.run_id)
        access.require(Scope.REVIEW, run.site_id)
    choice = queues.QueueChoice(
        unit=body.unit,
        order=body.order,
        sample=body.sample,
        seed=body.seed,
        double=body.double,
    )
    make = queues.create_or_reuse if body.reuse else queues.create
    queue, is_new = make(session, run, choice, access.user_id)
    if is_new:
        record(session, access, "create", "review queue", queue.id, site_id=run.site_id)
    else:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/review-queues/{queue.id}"
    return _shown(session, queue, access)


@router.get("/review-queues")
def list_queues(
    session: SessionDep, access: Reader, paging: PagingDep, run_id: RowId | None = None
) -> Page[QueueOut]:
    """List the queues of the sites one may read."""
    found, cursor = queues.listed(session, access.site_ids(Scope.READ), run_id, paging)
    counts = queues.counts(session, found, access.user_id)
    return Page(items=[QueueOut.of(queue, counts[queue.id]) for queue in found], next_cursor=cursor)


@router.get("/review-queues/{queue_id}")
def get_queue(queue_id: int, session: SessionDep, access: Reader) -> QueueOut:
    """Return a queue and how far it is."""
    return _shown(session, _queue(session, queue_id, access, Scope.READ), access)


@router.get("/review-queues/{queue_id}/progress")
def get_queue_progress(queue_id: int, session: SessionDep, access: Reader) -> ProgressOut:
    """Tell how far a queue is."""
    queue = _queue(session, queue_id, access, Scope.READ)
    return ProgressOut.of(queues.counts(session, [queue], access.user_id)[queue.id])


@router.delete("/review-queues/{queue_id}", status_code=204)
def delete_queue(queue_id: int, session: SessionDep, access: Reviewer) -> None:
    """Delete a queue of one's own, or any as an administrator; what was graded stays.

    It can be restored for 30 days.
    """
    queue = _queue(session, queue_id, access, Scope.REVIEW)
    if queue.created_by_id != access.user_id and not access.may(Scope.ADMIN, queue.run.site_id):
        raise Forbidden("only its maker or an administrator removes a queue")
    record(session, access, "delete", "review queue", queue.id, site_id=queue.run.site_id)
    queues.delete(session, queue, access.user_id)


@router.post(
    "/review-queues/{queue_id}/next",
    responses={204: {"description": "Nothing is free"}},
    response_model=QueueItemOut | QueueItemsOut,
)
def take_next_item(
    queue_id: int,
    session: SessionDep,
    access: Reviewer,
    settings: SettingsDep,
    body: NextIn | None = None,
) -> Response:
    """Lease the next item, or several; 204 where nothing is free."""
    wanted = body or NextIn()
    queue = _open(session, queue_id, access)
    items = queues.take_next(
        session,
        queue,
        access.user_id,
        count=wanted.count or 1,
        lease=timedelta(seconds=settings.review_lease_s),
        resume=wanted.resume,
    )
    if not items:
        return Response(status_code=204)
    found = _items(session, queue, items, access.user_id)
    answer = found[0] if wanted.count is None else QueueItemsOut(items=found)
    return Response(answer.model_dump_json(), media_type="application/json")


@router.post("/review-queues/{queue_id}/extend")
def extend_lease(
    queue_id: int,
    session: SessionDep,
    access: Reviewer,
    settings: SettingsDep,
    body: HeldIn | None = None,
) -> HeldOut:
    """Hold on to items for another while; those that others got meanwhile are not in the answer."""
    queue = _open(session, queue_id, access)
    lease = timedelta(seconds=settings.review_lease_s)
    ids = body.items if body else None
    held = queues.extend(session, queue, access.user_id, ids, lease)
    return HeldOut(items=[HeldItem(id=item, leased_until=until) for item, until in held])


@router.post("/review-queues/{queue_id}/release", status_code=204)
def release_item(
    queue_id: int, session: SessionDep, access: Reviewer, body: HeldIn | None = None
) -> None:
    """Give items back, so that others get them at once."""
    queue = _open(session, queue_id, access)
    queues.release(session, queue, access.user_id, body.items if body else None)


def _queue(session: Session, queue_id: int, access: Access, scope: Scope) -> ReviewQueue:
    queue = queues.get(session, queue_id)
    access.require(scope, queue.run.site_id)
    return queue


def _open(session: Session, queue_id: int, access: Access) -> OpenQueue:
    queue = queues.get_open(session, queue_id)
    access.require(Scope.REVIEW, queue.site_id)
    return queue


def _shown(session: Session, queue: ReviewQueue, access: Access) -> QueueOut:
    return QueueOut.of(queue, queues.counts(session, [queue], access.user_id)[queue.id])


def _items(
    session: Session, queue: OpenQueue, items: Sequence[LeasedItem], user_id: int
) -> list[QueueItemOut]:
    """Put leased items together with what is to be seen of them."""
    if queue.unit is QueueUnit.IMAGE:
        image_ids = [item.image_id for item in items]
        by_image = service.poses_of_images(session, queue.run_id, image_ids, user_id)
        images = service.images_by_id(session, image_ids)
        return [
            _item(queue, item, PoseImage.of(images[item.image_id]), None).model_copy(
                update={"poses": [PoseOut.of(p) for p in by_image[item.image_id]]}
            )
            for item in items
        ]
    pose_ids = [item.pose_id for item in items if item.pose_id is not None]
    poses = service.poses_by_id(session, pose_ids, user_id)
    shown = {pose_id: PoseOut.of(reviewed) for pose_id, reviewed in poses.items()}
    return [
        _item(queue, item, shown[item.pose_id].image, shown[item.pose_id])
        for item in items
        if item.pose_id is not None
    ]


def _item(
    queue: OpenQueue, item: LeasedItem, image: PoseImage, pose: PoseOut | None
) -> QueueItemOut:
    return QueueItemOut(
        id=item.id,
        queue_id=queue.id,
        run_id=queue.run_id,
        position=item.position,
        unit=queue.unit,
        image_id=item.image_id,
        pose_id=item.pose_id,
        leased_until=item.leased_until,
        image=image,
        pose=pose,
        poses=[],
    )
