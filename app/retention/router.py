"""REST of retention rules."""

from typing import Annotated

from fastapi import APIRouter, Request

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, heed_if_match
from app.dependencies import Page, SessionDep
from app.retention import actions, service
from app.retention.schemas import RuleIn, RuleOut
from app.sites import actions as sites

router = APIRouter(tags=["retention"], route_class=IdempotentRoute)
Administrator = Annotated[Access, allowed(Scope.ADMIN)]


@router.get("/sites/{site_id:int}/retention-rules")
def list_retention_rules(site_id: int, session: SessionDep, access: Administrator) -> Page[RuleOut]:
    """List a site's rules with what each would let go now."""
    site = sites.site_for(session, access, Scope.ADMIN, site_id)
    rules = service.rules(session, site.id)
    return Page(items=[RuleOut.of(row, service.preview(session, row)) for row in rules])


@router.post("/sites/{site_id:int}/retention-rules", status_code=201)
def add_retention_rule(
    site_id: int, data: RuleIn, session: SessionDep, access: Administrator
) -> RuleOut:
    """Add a rule, switched off: look at `would_go` first."""
    site = sites.site_for(session, access, Scope.ADMIN, site_id)
    row = actions.add(session, access, site, data)
    return RuleOut.of(row, service.preview(session, row))


@router.post("/retention-rules/{rule_id:int}/on", dependencies=[VERSIONED])
def switch_rule_on(
    rule_id: int, request: Request, session: SessionDep, access: Administrator
) -> RuleOut:
    """Switch a rule on: a worker applies it every day."""
    heed_if_match(request, actions.rule_for(session, access, rule_id).version)
    row = actions.switch(session, access, rule_id, on=True)
    return RuleOut.of(row, service.preview(session, row))


@router.post("/retention-rules/{rule_id:int}/off", dependencies=[VERSIONED])
def switch_rule_off(
    rule_id: int, request: Request, session: SessionDep, access: Administrator
) -> RuleOut:
    """Switch a rule off."""
    heed_if_match(request, actions.rule_for(session, access, rule_id).version)
    row = actions.switch(session, access, rule_id, on=False)
    return RuleOut.of(row, service.preview(session, row))


@router.delete("/retention-rules/{rule_id:int}", status_code=204, dependencies=[VERSIONED])
def remove_retention_rule(
    rule_id: int, request: Request, session: SessionDep, access: Administrator
) -> None:
    """Delete a rule; it can be restored for 30 days."""
    heed_if_match(request, actions.rule_for(session, access, rule_id).version)
    actions.remove(session, access, rule_id)
