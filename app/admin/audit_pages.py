"""The audit log as administrators search it: the filter stands in the address, a file takes it."""

import json
from datetime import UTC, datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Request
from fastapi.responses import Response
from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from app.admin import service
from app.auth import service as auth
from app.auth.access import Access, Scope, allowed
from app.dependencies import PagingDep, SessionDep
from app.errors import Invalid
from app.evaluation.tables import csv_response
from app.paging import Paging
from app.templating import page

router = APIRouter(prefix="/admin/audit")
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
MOST_IN_FILE = 100_000
COLUMNS = ("at", "who", "action", "entity", "entity_id", "site_id", "details")


class AuditQuery(BaseModel):
    """The log's filter as it stands in the address; empty fields are open."""

    who: str = Field("", max_length=254)
    action: str = Field("", max_length=64)
    entity: str = Field("", max_length=64)
    site_id: str = Field("", pattern="^[0-9]{0,9}$")
    since: str = Field("", max_length=10)
    until: str = Field("", max_length=10)

    def wanted(self, session: Session) -> service.AuditFilter:
        """Return what is looked for. Raises Invalid for what is no day."""
        return service.AuditFilter(
            user_id=service.user_id_of(session, self.who) if self.who else None,
            action=self.action or None,
            entity=self.entity or None,
            site_id=int(self.site_id) if self.site_id else None,
            since=_day("since", self.since),
            until=_day("until", self.until),
        )

    def address(self) -> str:
        """Return the filter as a query string."""
        return urlencode({name: value for name, value in self.model_dump().items() if value})


Query = Annotated[AuditQuery, Depends()]


@router.get("")
def show_audit(
    request: Request, session: SessionDep, access: Administrator, paging: PagingDep, query: Query
) -> Response:
    """Show the changes that fit, newest first."""
    entries, next_cursor = service.list_audit(session, access, query.wanted(session), paging)
    people = {entry.user_id for entry in entries if entry.user_id is not None}
    return page(
        request,
        "admin/audit.html",
        entries=entries,
        emails=service.emails_of(session, people),
        sites=auth.administered_sites(session, access),
        query=query,
        next_cursor=next_cursor,
    )


@router.get("/csv")
def download_audit(session: SessionDep, access: Administrator, query: Query) -> Response:
    """Give the changes that fit as a CSV file, newest first."""
    paging = Paging(limit=MOST_IN_FILE, after=None)
    entries, _ = service.list_audit(session, access, query.wanted(session), paging)
    people = {entry.user_id for entry in entries if entry.user_id is not None}
    emails = service.emails_of(session, people)
    rows = [
        {
            "at": entry.at.isoformat(),
            "who": emails.get(entry.user_id or 0, ""),
            "action": entry.action,
            "entity": entry.entity,
            "entity_id": entry.entity_id,
            "site_id": entry.site_id,
            "details": json.dumps(entry.details),
        }
        for entry in entries
    ]
    return csv_response("audit-log", COLUMNS, rows)


def _day(field: str, text: str) -> datetime | None:
    try:
        return datetime.strptime(text, "%Y-%m-%d").replace(tzinfo=UTC) if text else None
    except ValueError as error:
        raise Invalid.field(field, "must be a day such as 2026-11-22") from error
