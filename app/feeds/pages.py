"""Pages of live feeds: all of them, one as it stands now, and the form for both."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import RedirectResponse
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.db import Database
from app.dependencies import DatabaseDep, SessionDep, SettingsDep
from app.feeds import actions, service
from app.feeds.schemas import FeedIn, FeedPatch
from app.forms import ENTRY_ERRORS, Form, Submitted, check_version, parse, rejected
from app.paging import Paging
from app.sites import service as sites
from app.tables.feeds import AisFeed
from app.tables.sites import Site
from app.templating import page

LARGEST_ID = 2**31 - 1
router = APIRouter(prefix="/ais/feeds")
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]
AIS = {"label": "AIS", "href": "/ais"}
FEEDS = {"label": "Live feeds", "href": "/ais/feeds"}
ALL = Paging(limit=1000, after=None)
NEW_FEED = {"kind": "tcp", "host": "", "port": "", "silent_after_s": "120"}


@router.get("")
def show_feeds(
    request: Request,
    session: SessionDep,
    access: Reader,
    site_id: Annotated[int | None, Query(ge=1, le=LARGEST_ID)] = None,
) -> Response:
    """List the feeds one may read, of all sites or of one, as they stand now."""
    views, _ = service.list_views(session, access.site_ids(Scope.READ), site_id=site_id)
    places = _sites(session, access.site_ids(Scope.READ))
    return page(
        request,
        "feeds/list.html",
        crumbs=[AIS, {"label": "Live feeds"}],
        views=views,
        sites=places,
        site_id=site_id if site_id in places else None,
        may_ingest=access.may_anywhere(Scope.INGEST),
    )


@router.get("/new")
def new_feed(
    request: Request,
    session: SessionDep,
    access: Operator,
    site_id: Annotated[int | None, Query(ge=1, le=LARGEST_ID)] = None,
) -> Response:
    """Show the form for a new feed."""
    return _form_page(request, session, access, None, Form(NEW_FEED | {"site_id": site_id}))


@router.post("")
def create_feed(
    request: Request,
    database: DatabaseDep,
    settings: SettingsDep,
    access: Operator,
    entered: Submitted,
) -> Response:
    """Set up a feed and show it."""
    try:
        data = parse(FeedIn, entered)
        actions.check_new(database, settings, access, data)
        with database.writing() as session:
            feed = actions.create_feed(session, access, data)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            form = rejected(entered, error)
            return _form_page(request, session, access, None, form, error.status)
    return RedirectResponse(f"/ais/feeds/{feed.id}", status_code=303)


@router.get("/{feed_id:int}")
def show_feed(request: Request, feed_id: int, session: SessionDep, access: Reader) -> Response:
    """Show a feed as it stands now, with what became of every line."""
    feed = actions.feed_for(session, access, Scope.READ, feed_id)
    return page(
        request,
        "feeds/feed.html",
        crumbs=[AIS, FEEDS, {"label": feed.name}],
        view=service.view(session, feed),
        site=sites.get_site(session, feed.site_id),
        may_ingest=access.may(Scope.INGEST, feed.site_id),
    )


@router.get("/{feed_id:int}/edit")
def edit_feed(request: Request, feed_id: int, session: SessionDep, access: Operator) -> Response:
    """Show the form that changes a feed."""
    feed = actions.feed_for(session, access, Scope.INGEST, feed_id)
    return _form_page(request, session, access, feed, Form(_values(feed)))


@router.post("/{feed_id:int}")
def update_feed(
    request: Request,
    feed_id: int,
    database: DatabaseDep,
    settings: SettingsDep,
    access: Operator,
    entered: Submitted,
) -> Response:
    """Change, start or stop a feed and show it."""
    try:
        # A field that was emptied is a change: no sender is no longer any sender.
        senders: dict[str, list[str]] = (
            {"allowed_senders": []} if entered.get("allowed_senders") == "" else {}
        )
        values = {name: value for name, value in entered.items() if name != "version"}
        data = parse(FeedPatch, values | senders)
        actions.check_change(database, settings, access, feed_id, data)
        with database.writing() as session:
            feed = actions.feed_for(session, access, Scope.INGEST, feed_id)
            check_version(entered, feed.version)
            actions.update_feed(session, access, feed, data)
    except ENTRY_ERRORS as error:
        form = rejected(entered, error)
        return _edit_again(request, database, access, feed_id, form, error.status)
    return RedirectResponse(f"/ais/feeds/{feed_id}", status_code=303)


@router.post("/{feed_id:int}/remove")
def remove_feed(feed_id: int, session: SessionDep, access: Operator) -> Response:
    """Stop and remove a feed; what it brought stays."""
    feed = actions.feed_for(session, access, Scope.INGEST, feed_id)
    actions.remove_feed(session, access, feed)
    return RedirectResponse("/deletions", status_code=303)


def _edit_again(
    request: Request, database: Database, access: Access, feed_id: int, form: Form, status: int
) -> Response:
    # Asked again: the form may be wrong before anybody asked whose feed it is.
    with database.reading() as session:
        feed = actions.feed_for(session, access, Scope.INGEST, feed_id)
        return _form_page(request, session, access, feed, form, status)


def _form_page(
    request: Request,
    session: Session,
    access: Access,
    feed: AisFeed | None,
    form: Form,
    status: int = 200,
) -> Response:
    place = {"label": feed.name, "href": f"/ais/feeds/{feed.id}"} if feed else None
    last = {"label": "Edit" if feed else "New feed"}
    own = _sites(session, access.site_ids(Scope.INGEST))
    return page(
        request,
        "feeds/edit.html",
        status_code=status,
        crumbs=[crumb for crumb in (AIS, FEEDS, place, last) if crumb],
        feed=feed,
        form=form,
        site_choices=[(site.id, site.name) for site in own.values()],
    )


def _values(feed: AisFeed) -> dict[str, object]:
    return {
        "name": feed.name,
        "kind": feed.kind.value,
        "host": feed.host,
        "port": feed.port,
        "allowed_senders": ", ".join(feed.allowed_senders),
        "silent_after_s": f"{feed.silent_after_s:g}",
    }


def _sites(session: Session, site_ids: frozenset[int] | None) -> dict[int, Site]:
    found, _ = sites.list_sites(session, site_ids, ALL)
    return {site.id: site for site in found}
