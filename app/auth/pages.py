"""Pages of the caller: signing in and out, the account with its password and tokens."""

from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Form, Query, Request
from fastapi.responses import RedirectResponse, Response
from sqlalchemy.orm import Session

from app.auth import second_factor, service, users
from app.auth.access import Access, Scope, access_of, allowed, public
from app.auth.authentication import SESSION_COOKIE
from app.auth.destination import CODE, SIGN_IN, safe_destination
from app.auth.sign_in_page import sign_in_page
from app.config import Settings
from app.dependencies import DatabaseDep, SessionDep, SettingsDep
from app.errors import Invalid, TooManyRequests, Unauthenticated, Unavailable
from app.paging import Paging
from app.templating import page

router = APIRouter()
SignedIn = Annotated[Access, allowed(None)]
Text = Annotated[str, Form(max_length=2000)]
MOST_TOKENS_SHOWN = 1000
NOTICES = {
    "password": "Your password is changed; your other browsers are signed out.",
    "revoked": "The token is revoked.",
    "ended": "That browser is signed out.",
    "factor-off": "Signing in asks for no code any more.",
}


@router.get(SIGN_IN, dependencies=[Depends(public)])
def show_sign_in(
    request: Request, destination: Annotated[str, Query(alias="next")] = "/", done: str = ""
) -> Response:
    """Show the sign-in page; who is signed in goes on at once."""
    destination = safe_destination(destination)
    if access_of(request) is not None:
        return RedirectResponse(destination, status_code=303)
    return sign_in_page(request, destination, signed_out=done == "signed-out")


@router.post(SIGN_IN, dependencies=[Depends(public)])
def sign_in(
    request: Request,
    database: DatabaseDep,
    settings: SettingsDep,
    email: Text,
    password: Text,
    destination: Annotated[str, Form(alias="next")] = "/",
) -> Response:
    """Check the password; on success set a fresh session cookie and go where one wanted to go."""
    destination = safe_destination(destination)
    try:
        opened = service.sign_in(
            database,
            request.app.state.sign_in_throttle,
            email=email,
            password=password,
            browser=browser_of(request),
            hours=settings.session_hours,
            replaces=access_of(request),
        )
    except (Unauthenticated, TooManyRequests, Unavailable) as error:
        return sign_in_page(request, destination, error=error, email=email)
    if opened.awaits_code:
        destination = f"{CODE}?{urlencode({'next': destination})}"
    return signed_in(request, settings, opened.cookie, destination)


@router.post("/sign-out")
def sign_out(session: SessionDep, settings: SettingsDep, access: SignedIn) -> Response:
    """End this browser's session; who came from a provider may go on to sign out there."""
    service.sign_out(session, access)
    told = "?done=signed-out" if settings.has_provider else ""
    response = RedirectResponse(SIGN_IN + told, status_code=303)
    response.delete_cookie(SESSION_COOKIE, httponly=True, samesite="lax")
    return response


@router.get("/account")
def show_account(
    request: Request, session: SessionDep, access: SignedIn, done: str = ""
) -> Response:
    """Show one's roles, tokens and the form for a new password."""
    return _account(request, session, access, notice=NOTICES.get(done, ""))


@router.post("/account/password")
def change_password(
    request: Request, session: SessionDep, access: SignedIn, old_password: Text, new_password: Text
) -> Response:
    """Change one's own password."""
    try:
        users.change_own_password(session, access, old_password, new_password)
    except Invalid as error:
        return _account(request, session, access, password_error=error.detail)
    return RedirectResponse("/account?done=password", status_code=303)


@router.post("/account/tokens")
def create_token(
    request: Request,
    session: SessionDep,
    access: SignedIn,
    scopes: Annotated[list[Scope] | None, Form()] = None,
    name: Annotated[str, Form(max_length=200)] = "",
    days: Annotated[int, Form()] = 90,
) -> Response:
    """Make a token and show its text; it is never shown again."""
    try:
        _, text = service.create_token(session, access, name=name, scopes=scopes or [], days=days)
    except Invalid as error:
        return _account(request, session, access, token_error=error.detail)
    return _account(request, session, access, new_token=text)


@router.post("/account/tokens/{token_id}/revoke")
def revoke_token(token_id: int, session: SessionDep, access: SignedIn) -> Response:
    """Revoke one of one's own tokens."""
    service.revoke_token(session, access, token_id)
    return RedirectResponse("/account?done=revoked", status_code=303)


def _account(
    request: Request,
    session: Session,
    access: Access,
    *,
    notice: str = "",
    password_error: str = "",
    token_error: str = "",
    new_token: str = "",
) -> Response:
    tokens, _ = service.list_tokens(session, access, Paging(limit=MOST_TOKENS_SHOWN, after=None))
    return page(
        request,
        "auth/account.html",
        status_code=422 if password_error or token_error else 200,
        access=access,
        sessions=service.sessions_of(session, access.user_id),
        factor=second_factor.state_of(session, access),
        sites=service.site_names(session, access),
        tokens=[token for token in tokens if token.revoked_at is None],
        scopes=[scope for scope in Scope if scope in access.scopes()],
        flashes=[{"message": notice, "tone": "success"}] if notice else [],
        password_error=password_error,
        token_error=token_error,
        new_token=new_token,
    )


def browser_of(request: Request) -> service.Browser:
    """Return where a request comes from."""
    address = request.client.host if request.client else ""
    return service.Browser(address, request.headers.get("user-agent", ""))


def signed_in(request: Request, settings: Settings, cookie: str, destination: str) -> Response:
    """Set the session cookie and go where somebody wanted to go."""
    response = RedirectResponse(destination, status_code=303)
    response.set_cookie(
        SESSION_COOKIE,
        cookie,
        max_age=settings.session_hours * 3600,
        httponly=True,
        samesite="lax",
        secure=is_https(request, settings),
    )
    return response


def is_https(request: Request, settings: Settings) -> bool:
    """Whether a browser's cookies may travel by https only."""
    return request.url.scheme == "https" or settings.public_url.startswith("https://")
