"""The page of a site's retention rules."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from app.auth.access import Access, Scope, allowed
from app.dependencies import DatabaseDep, SessionDep
from app.forms import ENTRY_ERRORS, Form, Submitted, parse, rejected
from app.retention import actions, service
from app.retention.schemas import RuleIn
from app.sites import actions as sites
from app.tables.live import RetentionKind
from app.templating import page

router = APIRouter()
Administrator = Annotated[Access, allowed(Scope.ADMIN)]
KINDS = {
    RetentionKind.IMAGES: "images",
    RetentionKind.AIS_POSITIONS: "AIS positions that no pose rests on",
    RetentionKind.PREVIEWS: "previews, made again when looked at",
}


@router.get("/sites/{site_id:int}/retention")
def show_rules(
    request: Request, site_id: int, session: SessionDep, access: Administrator
) -> Response:
    """Show a site's rules and what each would let go."""
    return _rules_page(request, session, access, site_id, Form({"keep_days": "365"}))


@router.post("/sites/{site_id:int}/retention-rules")
def add_rule(
    request: Request, site_id: int, database: DatabaseDep, access: Administrator, entered: Submitted
) -> Response:
    """Add a rule, switched off."""
    try:
        data = parse(RuleIn, entered)
        with database.writing() as session:
            site = sites.site_for(session, access, Scope.ADMIN, site_id)
            actions.add(session, access, site, data)
    except ENTRY_ERRORS as error:
        with database.reading() as session:
            form = rejected(entered, error)
            return _rules_page(request, session, access, site_id, form, error.status)
    return RedirectResponse(f"/sites/{site_id}/retention", status_code=303)


@router.post("/retention-rules/{rule_id:int}/on")
def switch_on(rule_id: int, session: SessionDep, access: Administrator) -> Response:
    """Switch a rule on."""
    row = actions.switch(session, access, rule_id, on=True)
    return RedirectResponse(f"/sites/{row.site_id}/retention", status_code=303)


@router.post("/retention-rules/{rule_id:int}/off")
def switch_off(rule_id: int, session: SessionDep, access: Administrator) -> Response:
    """Switch a rule off."""
    row = actions.switch(session, access, rule_id, on=False)
    return RedirectResponse(f"/sites/{row.site_id}/retention", status_code=303)


@router.post("/retention-rules/{rule_id:int}/delete")
def remove_rule(rule_id: int, session: SessionDep, access: Administrator) -> Response:
    """Delete a rule, after it was asked."""
    site_id = actions.rule_for(session, access, rule_id).site_id
    actions.remove(session, access, rule_id)
    return RedirectResponse(f"/sites/{site_id}/retention", status_code=303)


def _rules_page(
    request: Request,
    session: SessionDep,
    access: Access,
    site_id: int,
    form: Form,
    status: int = 200,
) -> Response:
    site = sites.site_for(session, access, Scope.ADMIN, site_id)
    return page(
        request,
        "retention/rules.html",
        status_code=status,
        crumbs=[{"label": site.name, "href": f"/sites/{site.id}"}, {"label": "Retention"}],
        site=site,
        rules=[(row, service.preview(session, row)) for row in service.rules(session, site.id)],
        kinds=[(kind.value, text) for kind, text in KINDS.items()],
        words={kind.value: text for kind, text in KINDS.items()},
        form=form,
    )
