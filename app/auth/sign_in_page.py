"""The sign-in page with the ways in that this installation has, and why the last try failed."""

from fastapi import Request
from fastapi.responses import Response

from app.config import Settings
from app.errors import AppError
from app.templating import page


def sentence(error: AppError) -> str:
    """Return why something failed, as pages say it."""
    return f"{error.detail[:1].upper()}{error.detail[1:]}."


def sign_in_page(
    request: Request,
    destination: str,
    *,
    error: AppError | None = None,
    email: str = "",
    signed_out: bool = False,
) -> Response:
    """Return the page; `destination` is where one wanted to go, a path of this site."""
    settings: Settings = request.app.state.settings
    told = sentence(error) if error else ""
    response = page(
        request,
        "auth/login.html",
        status_code=error.status if error else 200,
        email=email,
        error=told,
        next=destination,
        provider=settings.oidc_button if settings.has_provider else "",
        signed_out=signed_out and settings.has_provider,
        can_reset=settings.sends_mail,
    )
    if error:
        response.headers.update(error.headers)
    return response
