"""Which part of the work is evaluated: filters that stand in the URL, the same for every table.

A selection never reaches further than its caller: the sites one may read are part of it, and an id
of another site answers as if there were no such thing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import Query
from pydantic import AfterValidator, BeforeValidator
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.errors import Invalid
from app.evaluation import queue_repository
from app.ids import RowId
from app.runs import service as runs
from app.sites import service as sites
from app.tables.queues import ReviewQueue

# A form sends the fields that were left empty, too.
FILLED = BeforeValidator(lambda text: None if text == "" else text)
_IN_UTC = AfterValidator(
    lambda moment: moment.replace(tzinfo=UTC) if moment and moment.tzinfo is None else moment
)
Id = Annotated[RowId | None, FILLED]
Moment = Annotated[datetime | None, FILLED, _IN_UTC]


@dataclass(frozen=True, slots=True)
class Asked:
    """The filters as they were asked for."""

    run_id: int | None
    site_id: int | None
    camera_id: int | None
    viewport_id: int | None
    queue_id: int | None
    since: datetime | None
    until: datetime | None

    def query(self, **more: object) -> str:
        """Return the filters as a query string, with more fields behind; without empty ones."""
        values = {
            "run_id": self.run_id,
            "site_id": self.site_id,
            "camera_id": self.camera_id,
            "viewport_id": self.viewport_id,
            "queue_id": self.queue_id,
            "from": _text(self.since),
            "to": _text(self.until),
        } | more
        given = {name: value for name, value in values.items() if value not in {None, ""}}
        return f"?{urlencode(given)}" if given else ""


@dataclass(frozen=True, slots=True)
class Selection:
    """The filters with the sites the caller may read (None: all) and the queue that was named.

    `site_id` is the one site it lies within, None where it may span several.
    """

    asked: Asked
    site_ids: frozenset[int] | None
    site_id: int | None
    queue: ReviewQueue | None


def _text(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat().replace("+00:00", "Z")


async def asked_for(
    run_id: Id = None,
    site_id: Id = None,
    camera_id: Id = None,
    viewport_id: Id = None,
    queue_id: Annotated[
        Id, Query(description="Only the images or poses of this review queue (a sample)")
    ] = None,
    since: Annotated[
        Moment,
        Query(alias="from", description="Images taken at this time or later; UTC without a zone"),
    ] = None,
    until: Annotated[
        Moment, Query(alias="to", description="Images taken before this time; UTC without a zone")
    ] = None,
) -> Asked:
    """Read the filters of a query."""
    return Asked(run_id, site_id, camera_id, viewport_id, queue_id, since, until)


def select(session: Session, access: Access, asked: Asked) -> Selection:
    """Bind filters to what the caller may read.

    Raises NotFound for ids of nothing or of sites one may not read, Invalid for times that leave
    nothing between them and for a queue of another run.
    """
    within = set(_sites_named(session, asked))
    if asked.since is not None and asked.until is not None and asked.since >= asked.until:
        raise Invalid.field("to", "must be later than `from`")
    queue = None
    if asked.queue_id is not None:
        queue = queue_repository.queue(session, asked.queue_id)
        within.add(queue.run.site_id)
    for site_id in within:
        access.require(Scope.READ, site_id)
    if queue is not None and asked.run_id not in {None, queue.run_id}:
        raise Invalid.field("queue_id", f"belongs to run {queue.run_id}, not to this one")
    return Selection(asked, access.site_ids(Scope.READ), min(within, default=None), queue)


def _sites_named(session: Session, asked: Asked) -> Iterator[int]:
    """Give the sites of everything a filter names. Raises NotFound for what is not there."""
    if asked.run_id is not None:
        yield runs.get_run(session, asked.run_id).site_id
    if asked.site_id is not None:
        yield sites.get_site(session, asked.site_id).id
    if asked.camera_id is not None:
        yield sites.get_camera(session, asked.camera_id).site_id
    if asked.viewport_id is not None:
        yield sites.site_id_of_viewport(session, asked.viewport_id)
