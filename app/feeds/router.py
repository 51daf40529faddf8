"""REST of live feeds."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, set_etag
from app.dependencies import DatabaseDep, Page, PagingDep, SessionDep, SettingsDep
from app.feeds import actions, service
from app.feeds.schemas import FeedIn, FeedOut, FeedPatch

LARGEST_ID = 2**31 - 1
router = APIRouter(prefix="/ais/feeds", tags=["AIS"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.post("", status_code=201)
def create_feed(
    data: FeedIn,
    database: DatabaseDep,
    session: SessionDep,
    settings: SettingsDep,
    access: Operator,
    response: Response,
) -> FeedOut:
    """Set up a live feed: a TCP server to connect to, or a UDP port to listen on.

    A worker takes it within seconds. Addresses inside this installation's network are refused
    (422) unless an administrator allowed their network.
    """
    actions.check_new(database, settings, access, data)
    feed = actions.create_feed(session, access, data)
    set_etag(response, feed.version)
    response.headers["Location"] = f"/api/v1/ais/feeds/{feed.id}"
    return FeedOut.of(service.view(session, feed))


@router.get("")
def list_feeds(
    session: SessionDep,
    access: Reader,
    paging: PagingDep,
    site_id: Annotated[int | None, Query(ge=1, le=LARGEST_ID)] = None,
) -> Page[FeedOut]:
    """List the feeds of the sites one may read as they stand now, oldest first."""
    views, next_cursor = service.list_views(
        session, access.site_ids(Scope.READ), paging, site_id=site_id
    )
    return Page(items=[FeedOut.of(view) for view in views], next_cursor=next_cursor)


@router.get("/{feed_id:int}")
def get_feed(feed_id: int, session: SessionDep, access: Reader, response: Response) -> FeedOut:
    """Show a feed as it stands now; its ETag is what an edit sends as If-Match."""
    feed = actions.feed_for(session, access, Scope.READ, feed_id)
    set_etag(response, feed.version)
    return FeedOut.of(service.view(session, feed))


@router.patch("/{feed_id:int}", dependencies=[VERSIONED])
def update_feed(
    feed_id: int,
    data: FeedPatch,
    request: Request,
    database: DatabaseDep,
    session: SessionDep,
    settings: SettingsDep,
    access: Operator,
    response: Response,
) -> FeedOut:
    """Change a feed; fields left out stay. `enabled` starts and stops it."""
    actions.check_change(database, settings, access, feed_id, data)
    feed = actions.feed_for(session, access, Scope.INGEST, feed_id)
    check_if_match(request, feed.version)
    actions.update_feed(session, access, feed, data)
    set_etag(response, feed.version)
    return FeedOut.of(service.view(session, feed))


@router.delete("/{feed_id:int}", status_code=204, dependencies=[VERSIONED])
def remove_feed(feed_id: int, request: Request, session: SessionDep, access: Operator) -> None:
    """Stop and delete a feed; the reports it brought stay, and it can be restored for 30 days."""
    feed = actions.feed_for(session, access, Scope.INGEST, feed_id)
    if "if-match" in request.headers:
        check_if_match(request, feed.version)
    actions.remove_feed(session, access, feed)
