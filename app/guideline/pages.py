"""The page of the guideline."""

from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope, allowed
from app.guideline import service
from app.ids import RowId
from app.templating import page

router = APIRouter()

Reader = Annotated[Access, allowed(Scope.READ)]


@router.get("/guideline")
def show_guideline(request: Request, access: Reader, version: RowId | None = None) -> Response:
    """Show what each grade means, with examples; an earlier version on request."""
    return page(
        request,
        "guideline/guideline.html",
        crumbs=[{"label": "Guideline"}],
        guide=service.current() if version is None else service.of_version(version),
        may_review=access.may_anywhere(Scope.REVIEW),
    )
