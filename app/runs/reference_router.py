"""REST of the run that a site's others are measured by."""

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import check_if_match, set_etag
from app.dependencies import SessionDep
from app.ids import RowId
from app.runs import reference_repository as repository
from app.runs import references
from app.sites import service as sites

router = APIRouter(tags=["runs"], route_class=IdempotentRoute)


class ReferenceRunIn(BaseModel):
    """Which run shall be the reference."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"run_id": 1}]})

    run_id: Annotated[RowId | None, Field(description="A run of the site; null for none")]


class ReferenceRunOut(BaseModel):
    """A site's reference run."""

    site_id: int
    run_id: int | None = Field(description="null where none was named, or where it was deleted")
    chosen_at: datetime | None
    version: int = Field(description="0 where none was ever named; If-Match of a change")


@router.get("/sites/{site_id:int}/reference-run")
def get_reference_run(
    site_id: int,
    session: SessionDep,
    access: Annotated[Access, allowed(Scope.READ)],
    response: Response,
) -> ReferenceRunOut:
    """Tell which run the others of a site are compared with, unless another one is named."""
    access.require(Scope.READ, sites.get_site(session, site_id).id)
    return _shown(session, site_id, response)


@router.put("/sites/{site_id:int}/reference-run")
def choose_reference_run(
    site_id: int,
    data: ReferenceRunIn,
    request: Request,
    session: SessionDep,
    access: Annotated[Access, allowed(Scope.INGEST)],
    response: Response,
) -> ReferenceRunOut:
    """Name a run the reference of its site, or take the name back; needs the site's `ingest`."""
    access.require(Scope.INGEST, sites.get_site(session, site_id).id)
    repository.lock_site(session, site_id)
    check_if_match(request, references.version(session, site_id))
    references.choose(session, access, site_id, data.run_id)
    return _shown(session, site_id, response)


def _shown(session: Session, site_id: int, response: Response) -> ReferenceRunOut:
    chosen, run = repository.of_site(session, site_id), references.reference_of(session, site_id)
    version = references.version(session, site_id)
    set_etag(response, version)
    return ReferenceRunOut(
        site_id=site_id,
        run_id=run.id if run else None,
        chosen_at=chosen.chosen_at if chosen else None,
        version=version,
    )
