"""Signing in at the identity provider: going there, coming back, and signing out of it too."""

import hmac
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Query, Request
from fastapi.responses import RedirectResponse, Response

from app.auth.access import access_of, public
from app.auth.destination import CODE, SIGN_IN, safe_destination
from app.auth.pages import browser_of, is_https, signed_in
from app.auth.sign_in_page import sign_in_page
from app.auth.throttle import SignInThrottle
from app.config import Settings
from app.dependencies import DatabaseDep, SettingsDep
from app.errors import AppError, Forbidden, NotFound, TooManyRequests, Unavailable
from app.oidc import service
from app.oidc.pending import COOKIE, LASTS_S, PATH, Pending, seal, unseal
from app.oidc.provider import CALLBACK, Provider, new_pending

router = APIRouter(dependencies=[Depends(public)])
STALE = "this sign-in was begun elsewhere or too long ago; begin again"
Told = Annotated[str, Query(max_length=4000)]


@router.get(PATH)
def begin(
    request: Request,
    settings: SettingsDep,
    destination: Annotated[str, Query(alias="next")] = "/",
) -> Response:
    """Send the browser to the provider, with what it has to bring back."""
    destination = safe_destination(destination)
    pending = new_pending(destination)
    try:
        address = _provider(request).address(pending)
    except Unavailable as error:
        return sign_in_page(request, destination, error=error)
    response = RedirectResponse(address, status_code=303)
    response.set_cookie(
        COOKIE,
        seal(pending, settings.secret()),
        max_age=LASTS_S,
        path=PATH,
        httponly=True,
        samesite="lax",
        secure=is_https(request, settings),
    )
    return response


@router.get(CALLBACK)
def come_back(
    request: Request,
    database: DatabaseDep,
    settings: SettingsDep,
    code: Told = "",
    state: Told = "",
    error: Told = "",
    iss: Told = "",
) -> Response:
    """Check what the provider sends back; on success set a session cookie and go on."""
    provider = _provider(request)
    throttle: SignInThrottle = request.app.state.sign_in_throttle
    browser = browser_of(request)
    pending = unseal(request.cookies.get(COOKIE, ""), settings.secret())
    try:
        throttle.check("provider", browser.address)
        pending = _expected(settings, pending, state, error, iss)
        opened = service.sign_in(
            database,
            settings,
            provider.redeem(code, pending),
            browser=browser,
            replaces=access_of(request),
        )
    except (Forbidden, TooManyRequests, Unavailable) as refusal:
        return _refused(request, throttle, refusal, pending)
    destination = pending.destination
    if opened.awaits_code:
        destination = f"{CODE}?{urlencode({'next': destination})}"
    response = signed_in(request, settings, opened.cookie, destination)
    response.delete_cookie(COOKIE, path=PATH, httponly=True, samesite="lax")
    return response


@router.get(f"{PATH}/sign-out")
def sign_out(request: Request) -> Response:
    """Send a browser that is signed out here to sign out of the provider too."""
    try:
        address = _provider(request).sign_out_address()
    except Unavailable as error:
        return sign_in_page(request, "/", error=error)
    return RedirectResponse(address or SIGN_IN, status_code=303)


def _expected(
    settings: Settings, pending: Pending | None, state: str, error: str, issuer: str
) -> Pending:
    """Return the sign-in that an answer belongs to. Raises Forbidden for one that nobody awaits."""
    if pending is None or not hmac.compare_digest(pending.state.encode(), state.encode()):
        raise Forbidden(STALE)
    if issuer and issuer != settings.oidc_issuer:
        raise Forbidden(STALE)
    if error == "access_denied":
        raise Forbidden("you were not let in at the identity provider")
    if error:
        raise Forbidden("the identity provider reports a failure; begin again")
    return pending


def _refused(
    request: Request, throttle: SignInThrottle, error: AppError, pending: Pending | None
) -> Response:
    if isinstance(error, Forbidden):
        throttle.count("provider", browser_of(request).address)
    destination = pending.destination if pending else "/"
    response = sign_in_page(request, destination, error=error)
    response.delete_cookie(COOKIE, path=PATH, httponly=True, samesite="lax")
    return response


def _provider(request: Request) -> Provider:
    provider: Provider | None = request.app.state.identity_provider
    if provider is None:
        raise NotFound("no identity provider is configured")
    return provider
