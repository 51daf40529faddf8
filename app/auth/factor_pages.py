"""Pages of the second factor, of one's own sessions, and of links to join or to a new password."""

import io
from typing import Annotated

import segno
from fastapi import APIRouter, Depends, Form, Query, Request
from fastapi.responses import RedirectResponse, Response

from app.auth import links, mailed_links, second_factor, service, totp
from app.auth.access import Access, allowed, public
from app.auth.authentication import SESSION_COOKIE
from app.auth.destination import CODE, SIGN_IN, safe_destination
from app.auth.pages import browser_of, signed_in
from app.auth.sign_in_page import sentence
from app.config import Settings
from app.dependencies import DatabaseDep, JobsDep, SessionDep, SettingsDep
from app.errors import Conflict, Invalid, NotFound, TooManyRequests, Unauthenticated, Unavailable
from app.templating import page

router = APIRouter()
FORGOTTEN = "/sign-in/forgotten"
SignedIn = Annotated[Access, allowed(None)]
Text = Annotated[str, Form(max_length=2000)]
Token = Annotated[str, Query(max_length=200)]


@router.get(CODE, dependencies=[Depends(public)])
def ask_code(request: Request, destination: Annotated[str, Query(alias="next")] = "/") -> Response:
    """Ask for the code of the second factor."""
    return page(request, "auth/code.html", next=safe_destination(destination), error="")


@router.post(CODE, dependencies=[Depends(public)])
def confirm_code(
    request: Request,
    database: DatabaseDep,
    settings: SettingsDep,
    code: Text,
    destination: Annotated[str, Form(alias="next")] = "/",
) -> Response:
    """Check the code; on success set a fresh session cookie and go on."""
    destination = safe_destination(destination)
    try:
        cookie = service.confirm_code(
            database,
            request.app.state.sign_in_throttle,
            cookie=request.cookies.get(SESSION_COOKIE, ""),
            code=code,
            browser=browser_of(request),
            hours=settings.session_hours,
        )
    except (Unauthenticated, TooManyRequests, Unavailable) as error:
        response = page(
            request,
            "auth/code.html",
            status_code=error.status,
            next=destination,
            error=sentence(error),
        )
        response.headers.update(error.headers)
        return response
    return signed_in(request, settings, cookie, destination)


@router.get("/account/second-factor")
def show_second_factor(request: Request, access: SignedIn) -> Response:
    """Show a fresh secret as a QR code, to be confirmed with its first code."""
    return _set_up(request, access, totp.new_secret())


@router.post("/account/second-factor")
def set_up_second_factor(
    request: Request,
    session: SessionDep,
    access: SignedIn,
    secret: Annotated[str, Form(pattern="^[A-Z2-7]{32}$")],
    code: Text,
    password: Text,
) -> Response:
    """Turn the second factor on and show the recovery codes, this once."""
    try:
        codes = second_factor.set_up(session, access, secret, code, password)
    except Invalid as error:
        return _set_up(request, access, secret, error=error.detail)
    return page(request, "auth/recovery_codes.html", codes=codes)


@router.post("/account/second-factor/off")
def turn_off_second_factor(session: SessionDep, access: SignedIn, password: Text) -> Response:
    """Turn the second factor off."""
    second_factor.turn_off(session, access, password)
    return RedirectResponse("/account?done=factor-off", status_code=303)


@router.post("/account/sessions/end")
def end_session(
    session: SessionDep, access: SignedIn, session_id: Annotated[int, Form()]
) -> Response:
    """Sign another browser of one's own out."""
    service.end_session(session, access, session_id)
    return RedirectResponse("/account?done=ended", status_code=303)


@router.post("/account/sign-out-everywhere")
def sign_out_everywhere(session: SessionDep, access: SignedIn) -> Response:
    """Sign all browsers of one's own out."""
    service.sign_out_everywhere(session, access)
    return RedirectResponse(SIGN_IN, status_code=303)


@router.get(FORGOTTEN, dependencies=[Depends(public)])
def show_forgotten(request: Request, settings: SettingsDep) -> Response:
    """Show the form for a new password by mail, where mail is sent."""
    _demand_mail(settings)
    return page(request, "auth/forgotten.html", sent=False, email="", error="")


@router.post(FORGOTTEN, dependencies=[Depends(public)])
def ask_for_mail(
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    jobs: JobsDep,
    email: Annotated[str, Form(max_length=254)],
) -> Response:
    """Send a link for a new password; the answer is the same whether or not anybody is known."""
    _demand_mail(settings)
    try:
        request.app.state.reset_throttle.count_wish(email, browser_of(request).address)
    except TooManyRequests as error:
        response = page(
            request,
            "auth/forgotten.html",
            status_code=error.status,
            sent=False,
            email=email,
            error=sentence(error),
        )
        response.headers.update(error.headers)
        return response
    mailed_links.queue_wished_reset(session, jobs, email.strip())
    return page(request, "auth/forgotten.html", sent=True, email=email.strip())


@router.get("/join", dependencies=[Depends(public)])
def show_link(request: Request, session: SessionDep, token: Token = "") -> Response:
    """Show the form behind an invitation or a link for a new password."""
    if not token:
        return RedirectResponse(SIGN_IN, status_code=303)
    link = links.look_up(session, token)
    return page(request, "auth/join.html", link=link, token=token, name="", error="")


@router.post("/join", dependencies=[Depends(public)])
def follow_link(
    request: Request,
    database: DatabaseDep,
    token: Annotated[str, Form(max_length=200)],
    password: Text,
    name: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    """Join, or set the new password; then sign in with it."""
    try:
        links.follow(database, token, password=password, name=name)
    except (Invalid, Conflict) as error:
        with database.reading() as session:
            link = links.look_up(session, token)
        return page(
            request,
            "auth/join.html",
            status_code=error.status,
            link=link,
            token=token,
            name=name,
            error=error.detail,
        )
    return RedirectResponse(SIGN_IN, status_code=303)


def _demand_mail(settings: Settings) -> None:
    if not settings.sends_mail:
        raise NotFound("no mail server is configured")


def _set_up(request: Request, access: Access, secret: str, error: str = "") -> Response:
    picture = io.BytesIO()
    code = segno.make(totp.app_address(secret, access.email), micro=False)
    code.save(
        picture,
        kind="svg",
        scale=5,
        light="white",
        xmldecl=False,
        svgns=False,
        title="QR code",
        nl=False,
    )
    return page(
        request,
        "auth/second_factor.html",
        status_code=422 if error else 200,
        secret=secret,
        picture=picture.getvalue().decode(),
        error=error,
    )
